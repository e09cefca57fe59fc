"""Two trials whose forces are late, each by its own time."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.about import Reading, of_each_trial
from solver.diagnosis.causes.clocks import MOST_TRIALS, TARGET, TrialClocks
from solver.diagnosis.causes.effect import Fitted

LATE = {"walk": 0.012, "again": -0.03}


@pytest.fixture(scope="module")
def late_trials(on_one_plate, seen):
    return {
        name: replace(seen(on_one_plate(lambda times, late=late: times - late)), name=name)
        for name, late in LATE.items()
    }


def test_the_true_wrench_comes_back_in_each_trial(late_trials, on_one_plate, seen):
    true = seen(on_one_plate(lambda times: times)).measured_ground
    (candidate,) = TrialClocks.candidates(list(late_trials.values()))
    eta = tuple(LATE[name] for name in candidate.trials)
    inside = slice(20, -20)  # the filter's ends are its own
    for scene in late_trials.values():
        left = (scene.measured_ground + candidate.signature(scene, eta).fixed - true)[inside]
        was = (scene.measured_ground - true)[inside]
        assert np.sqrt((left**2).mean()) < 1e-4 * np.sqrt((was**2).mean())


def test_other_trials_are_left_alone_and_ends_unrecorded(late_trials):
    candidate = TrialClocks(TARGET, ("walk", "again"))
    strange = replace(late_trials["walk"], name="third")
    assert candidate.signature(strange, (0.1, 0.0)) is None
    assert not candidate.unrecorded(strange, (0.1, 0.0)).any()
    assert candidate.unrecorded(late_trials["walk"], (0.1, 0.0))[-9:].all()
    assert not candidate.unrecorded(late_trials["again"], (0.1, 0.0)).any()


def test_each_trials_offset_is_told(late_trials):
    scenes = list(late_trials.values())
    (candidate,) = TrialClocks.candidates(scenes)
    nothing = np.zeros(0), np.zeros((0, 0))
    found = candidate.estimates(scenes, Fitted((0.012, -0.03), (0.001, 0.002), *nothing))
    assert {n: (e.value, e.std) for n, e in found.items()} == {
        "offset_s walk": (0.012, 0.001),
        "offset_s again": (-0.03, 0.002),
    }
    assert candidate.is_notable(found)
    alike = candidate.estimates(scenes, Fitted((0.012, 0.013), (0.001, 0.002), *nothing))
    assert not candidate.is_notable(alike)  # one clock
    said = [r for r in of_each_trial(TrialClocks.about.readings, found) if isinstance(r, Reading)]
    assert [r.parameter for r in said] == list(found)
    assert "again" in said[1].text
    assert all(candidate.admissible(eta) for eta in candidate.starts(scenes))
    assert not candidate.admissible((0.0, 0.5))


def test_one_trial_has_a_clock_and_many_are_too_many(late_trials):
    scene = late_trials["walk"]
    many = [replace(scene, name=f"trial {k}") for k in range(MOST_TRIALS + 1)]
    assert TrialClocks.candidates([scene]) == []
    assert TrialClocks.candidates(many) == []
    assert TrialClocks.candidates(many[:-1])[0].trials == tuple(s.name for s in many[:-1])
