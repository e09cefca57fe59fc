"""A pelvis, a trunk and arms without legs: angles of what is seen, and nothing made up below."""

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.common.typed_json import plain
from solver.export.c3d_file import _outputs
from solver.export.trial_table import trial_columns
from solver.fitting.pipeline import solve
from solver.fitting.summary import all_notes, summary
from solver.kinematics.marker_naming import name_markers
from solver.skeleton.default_body import default_skeleton
from tests.conftest import NO_HELD_OUT

pytestmark = pytest.mark.real

WALK, FRAMES = "walk_rajagopal2015", 50
SEEN = ("pelvis", "torso", "humerus", "ulna", "radius", "hand")
LEGS = ("hip_", "knee_", "ankle_", "subtalar_", "mtp_")


@pytest.fixture(scope="module")
def fit(real_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheelchair")
    (trial, *_) = open_subject(real_data / WALK).trials
    markers = read_trial(trial).markers
    named = name_markers(default_skeleton(), [markers], default_body=True)
    body = named.match.skeleton(named.skeleton)
    columns = zip(named.match.columns(markers), body.markers, strict=True)
    keep = [k for k, m in columns if k is not None and body.body_names[m.body].startswith(SEEN)]
    few = Markers(
        tuple(markers.names[k] for k in keep), markers.positions_ground[:FRAMES, keep], markers.rate
    )
    write_trc(folder / "push.trc", few)
    return solve(open_subject(folder), NO_HELD_OUT)


def test_neither_mass_nor_height_nor_forces_are_synthetic(fit):
    assert np.isnan(fit.mass_kg)
    assert np.isnan(fit.height_m)
    (trial,) = fit.trials
    assert trial.dynamics is None
    notes = " ".join(all_notes(fit))
    assert "legs are not seen" in notes
    assert "no torques" in notes
    assert "people of" not in notes
    figures = plain(summary(fit))
    assert figures["subject"]["mass_kg"] is None
    assert not figures["trials"][0]["forces_predicted"]


def test_only_segments_that_are_seen_have_angles(fit):
    (trial,) = fit.trials
    columns = trial_columns(trial, fit.skeleton)
    angles = {name: np.isfinite(v).any() for name, v in columns.items() if name.endswith(("_rad", "_m"))}
    below = {name for name in angles if name.startswith(LEGS)}
    assert len(below) > 10
    assert not any(angles[name] for name in below)
    assert angles["lumbar_bending_rad"]
    assert angles["arm_flex_r_rad"]
    points = _outputs(trial, fit.skeleton)
    assert not any("knee" in point.description or "hip" in point.description for point in points)
    assert any("lumbar" in point.description for point in points)
