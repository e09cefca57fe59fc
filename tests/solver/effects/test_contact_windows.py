from dataclasses import replace

import numpy as np
import pytest

from solver.effects.contact_windows import contact_windows
from solver.effects.scene import force_at


def pushed(scene, force, start, end):
    """A force at the centre of mass between two frames."""
    course = np.zeros((scene.frames, 1))
    course[start:end] = 1.0
    return force_at(course * np.array(force, dtype=float), scene.com_ground)


def test_nothing_is_found_where_forces_balance(closed):
    assert contact_windows(closed) == []


@pytest.mark.parametrize("force", [(0, 60, 0), (-40, 0, 20), (0, -80, 0)])
def test_finds_when_something_pushes(scene, recorded, force):
    found = contact_windows(recorded(scene.demanded_ground - pushed(scene, force, 80, 150)))
    assert len(found) == 1
    assert abs(found[0].stretch.start - 80) <= 10
    assert abs(found[0].stretch.end - 150) <= 10


def test_two_pushes_are_two_windows_the_stronger_first(scene, recorded):
    missing = pushed(scene, (0, 60, 0), 30, 70) + pushed(scene, (-120, 0, 0), 160, 210)
    found = contact_windows(recorded(scene.demanded_ground - missing))
    assert len(found) >= 2
    assert found[0].score > found[1].score
    first, second = (w.stretch for w in found[:2])
    assert 150 <= first.start <= 170
    assert 20 <= second.start <= 40


def test_what_a_person_flagged_is_not_looked_at(scene, recorded):
    faulty = recorded(scene.demanded_ground - pushed(scene, (0, 60, 0), 80, 150))
    counts = np.ones(scene.frames, dtype=bool)
    counts[75:155] = False
    assert contact_windows(replace(faulty, counts=counts)) == []
