from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.contact_windows import contact_windows
from solver.diagnosis.causes.observed_trial import force_at


def pushed(scene, force, start, end):
    """A force at the centre of mass between two frames."""
    time_history = np.zeros((scene.frames, 1))
    time_history[start:end] = 1.0
    return force_at(time_history * np.array(force, dtype=float), scene.com_ground)


def test_nothing_is_found_where_forces_balance(closed):
    assert contact_windows(closed) == []


@pytest.mark.parametrize("force", [(0, 60, 0), (-40, 0, 20), (0, -80, 0)])
def test_finds_when_something_pushes(scene, recorded, force):
    found = contact_windows(recorded(scene.required_ground - pushed(scene, force, 80, 150)))
    assert len(found) == 1
    assert abs(found[0].stretch.start - 80) <= 10
    assert abs(found[0].stretch.end - 150) <= 10


def test_two_pushes_are_two_windows_the_stronger_first(scene, recorded):
    missing = pushed(scene, (0, 60, 0), 30, 70) + pushed(scene, (-120, 0, 0), 160, 210)
    found = contact_windows(recorded(scene.required_ground - missing))
    assert len(found) >= 2
    assert found[0].score > found[1].score
    first, second = (w.stretch for w in found[:2])
    assert 150 <= first.start <= 170
    assert 20 <= second.start <= 40


def test_what_a_person_flagged_is_not_looked_at(scene, recorded):
    faulty = recorded(scene.required_ground - pushed(scene, (0, 60, 0), 80, 150))
    counts = np.ones(scene.frames, dtype=bool)
    counts[75:155] = False
    assert contact_windows(replace(faulty, counts=counts)) == []


@pytest.mark.parametrize("weight_N", [-40.0, 40.0])
@pytest.mark.parametrize(
    ("force", "frames"), [((-60, 0, 40), (80, 150)), ((0, 40, 0), (80, 150)), ((0, 300, 0), (0, 150))]
)
def test_beside_a_wrong_weight_a_contact_begins_and_ends(scene, recorded, weight_N, force, frames):
    """What is missing upward before, in and after it is no contact; a seat's force is no wrong weight."""
    missing = pushed(scene, (0, weight_N, 0), 0, scene.frames) + pushed(scene, force, *frames)
    faulty = recorded(scene.required_ground - missing)
    counts = faulty.counts.copy()
    counts[200:220] = False  # as if a person had flagged them
    (found,) = contact_windows(replace(faulty, counts=counts))
    assert abs(found.stretch.start - frames[0]) <= 10
    assert abs(found.stretch.end - frames[1]) <= 10
    assert found.wrong_weight_N == pytest.approx(weight_N, abs=8.0)


@pytest.mark.parametrize(("share", "sign"), [(0.5, 1), (0.5, -1), (0.65, 1)])
def test_whom_only_the_plates_weighed_a_long_push_does_not_make_two(scene, recorded, share, sign):
    """The mean of the forces holds part of the push: without it they seem to lack the opposite."""
    start, end = 20, 20 + round(share * scene.frames)
    missing = pushed(scene, (0, 80.0 * sign, 0), start, end)
    missing -= force_at(np.array([0, 80.0 * sign * (end - start) / scene.frames, 0]), scene.com_ground)
    unweighed = replace(recorded(scene.required_ground - missing), mass_was_entered=False)
    found = contact_windows(unweighed)
    assert len(found) == 1
    assert abs(found[0].stretch.start - start) <= 10
    assert abs(found[0].stretch.end - end) <= 10
