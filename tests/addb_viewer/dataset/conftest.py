"""One person's walk, recorded at 100 and at 200 Hz, each fitted once; and a release of both."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.dataset import subject_files
from addb_viewer.dataset.build import build
from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import solve
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.simulate.subject_folder import write_subject
from tests.addb_viewer.dataset.builds import ALL, Here, planned_apart
from tests.conftest import NO_HELD_OUT

QUICK = replace(NO_HELD_OUT, prediction=replace(NO_HELD_OUT.prediction, enabled=False))
WALK_S = 1.2


def write_walk(folder, rate, seed=3):
    """A walk with a step beside the plates."""
    rng, who = np.random.default_rng(seed), Person(sex="female")
    trial = simulate_trial(Scenario("walk", "walk", duration=WALK_S), body_of(who, rng), rng)
    plates = plates_under(trial.contacts, (0.0, WALK_S), missed=(1,))
    equipment = replace(MeasurementSettings(), marker_rate=rate)
    write_subject(folder, who, [measure(trial, plates, MARKERS, equipment, rng)])
    return trial


@pytest.fixture(scope="session")
def walks(tmp_path_factory):
    """Folders of subjects, by rate; the same steps in both."""
    root = tmp_path_factory.mktemp("source")
    for rate in (100, 200):
        write_walk(root / f"at_{rate}", float(rate))
    return root


@pytest.fixture(scope="session")
def fit_100(walks):
    return solve(open_subject(walks / "at_100"), QUICK)


@pytest.fixture(scope="session")
def fit_200(walks):
    return solve(open_subject(walks / "at_200"), QUICK)


@pytest.fixture(scope="session")
def instead_of_solving(fit_100, fit_200):
    """Within it, the walks are not fitted again: what is judged comes after the fits."""
    fits = {"at_100": fit_100, "at_200": fit_200}

    @contextmanager
    def within():
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(subject_files, "solve", lambda subject, *_, **__: fits[subject.name])
            yield

    return within


@pytest.fixture
def fitted(instead_of_solving):
    with instead_of_solving():
        yield


@pytest.fixture(scope="session")
def release(walks, instead_of_solving, tmp_path_factory):
    """Both walks, unreviewed."""
    out = tmp_path_factory.mktemp("out") / "release"
    with instead_of_solving():
        build(planned_apart(walks), out, ALL, Here())
    return out
