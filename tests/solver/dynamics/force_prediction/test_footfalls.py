"""Times of steps: those of the plates where seen, near them where not, never told by what is hidden."""

import numpy as np

from solver.dynamics.force_prediction.learnt_columns import footfalls, heading_frame
from tests.solver.dynamics.force_prediction.conftest import FEET


def falls(walk, known, in_contact=None):
    return footfalls(
        walk.skeleton,
        walk.motion,
        heading_frame(walk.skeleton, walk.motion),
        feet=FEET,
        in_contact=walk.in_contact if in_contact is None else in_contact,
        known=known,
    )


def loadings(walk):
    """Frames on which a foot is first loaded, those of a foot that stood from the beginning left out."""
    at, foot = np.nonzero(walk.in_contact[1:] & ~walk.in_contact[:-1])
    return sorted(zip(at + 1, foot, strict=True))


def found_near(found, starts):
    """How far off the found time of each true start is [frames]."""
    off = []
    for start, foot in starts:
        own = found.frames[found.feet == foot]
        off.append(np.abs(own - start).min())
    return np.array(off)


def test_steps_begin_when_plates_say_so(hidden_wrench_walk):
    known = np.ones(hidden_wrench_walk.motion.frames, dtype=bool)
    found = falls(hidden_wrench_walk, known)
    assert found_near(found, loadings(hidden_wrench_walk)[1:-1]).max() == 0
    assert (np.diff(found.feet) != 0).all()


def test_a_hidden_step_is_timed_by_its_markers(hidden_wrench_walk):
    starts = loadings(hidden_wrench_walk)[1:-1]
    known = np.ones(hidden_wrench_walk.motion.frames, dtype=bool)
    for start, _ in starts[::2]:
        known[int(start) - 11 : int(start) + 11] = False
    assert found_near(falls(hidden_wrench_walk, known), starts).max() <= 4


def test_what_plates_say_on_hidden_frames_changes_nothing(hidden_wrench_walk):
    known = np.ones(hidden_wrench_walk.motion.frames, dtype=bool)
    known[100:140] = False
    other = hidden_wrench_walk.in_contact.copy()
    other[100:140] = ~other[100:140]
    one, two = falls(hidden_wrench_walk, known), falls(hidden_wrench_walk, known, other)
    np.testing.assert_array_equal(one.frames, two.frames)
    np.testing.assert_array_equal(one.feet, two.feet)
