"""Zeros that settings allow work: a short trial of a real recording is fitted with all of a table at once."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings, settings_for
from tests.addb_viewer.app.ten_trials import RECORDINGS, write_windows

pytestmark = pytest.mark.real

STAGES = [f.name for f in fields(Settings) if f.name != "diagnosis"]  # no fit obeys that


def may_be_zero(table):
    return [f.name for f in fields(table) if not is_dataclass(getattr(table, f.name)) and allowed(f)]


def allowed(described):
    bounds = described.metadata.get("bounds")
    return isinstance(described.default, int | float) and bounds is not None and bounds.allow(0)


@pytest.fixture(scope="module")
def folder(real_data, tmp_path_factory):
    """Two steps of a walk."""
    recording = RECORDINGS["gait"]
    folder = tmp_path_factory.mktemp("short")
    write_windows(replace(recording, windows=((0.0, 1.2),)), real_data / recording.folder, folder / "gait")
    return folder / "gait"


@pytest.mark.slow
@pytest.mark.parametrize("stage", [name for name in STAGES if may_be_zero(getattr(Settings(), name))])
def test_a_trial_is_fitted_with_all_zeros_that_a_table_allows(folder, tmp_path, stage):
    zeros = dict.fromkeys(may_be_zero(getattr(Settings(), stage)), 0)
    file = tmp_path / "zeros.toml"
    file.write_text(f"[{stage}]\n" + "".join(f"{name} = {zero}\n" for name, zero in zeros.items()))
    (trial,) = solve(open_subject(folder), settings_for(folder, file)).trials
    assert np.isfinite(trial.motion.q).all()
    assert trial.dynamics.used.any()
    assert np.isfinite(trial.dynamics.residual_root[trial.dynamics.used]).all()
