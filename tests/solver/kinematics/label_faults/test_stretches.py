"""Which wrong frames make a stretch that something may be done about; states are spelled as letters."""

import numpy as np
import pytest

from solver.kinematics.label_faults.rigid_neighbours import RIGHT, UNCLEAR, UNKNOWN, WRONG, stretches

STATE = {"r": RIGHT, "W": WRONG, "?": UNCLEAR, ".": UNKNOWN}
OFF_M = {"r": 0.002, "W": 0.08, "?": 0.02, ".": np.nan}
RATE = 10.0  # [Hz] so that a gap of one second is ten frames


def found(spelled, off=OFF_M):
    state = np.array([STATE[letter] for letter in spelled], dtype=np.int8)
    off_m = np.array([off[letter] for letter in spelled])
    return [(s.start, s.end) for s in stretches(state, off_m, RATE)]


@pytest.mark.parametrize(
    ("spelled", "expected"),
    [
        ("rrrrrrrrrr", []),
        ("rrrrrWWWrrrrr", [(5, 8)]),
        ("WWWWrrrrrrrrr", [(0, 4)]),  # from the recording's start
        ("rrrrrrrrWWW", [(8, 11)]),  # to its end
        ("rrrrr..WWW....rrrrr", [(7, 10)]),  # in a gap
        ("rrrrrWWW" + 11 * "." + "rrrrr", []),  # in a gap too long to tell
        ("rrrrrr?WWW??rrrrrr", [(7, 10)]),  # a step
        ("rrrrr???WWWrrrrr", []),  # gradually: movement
        ("rrrrrWW.WWrrrrrr", [(5, 10)]),  # hidden for a moment
        ("rrrrrrW?W?W?Wrrrrrr", []),  # not clearly wrong
        ("rrrrrWWrrrrr", []),  # too short
        ("rrrrrrrWWWrrrWWWWrrrrrr", [(7, 10), (13, 17)]),
        ("rrWWWWWWW", []),  # what holds for most is right
        ("WWW", []),
    ],
)
def test_stretches(spelled, expected):
    assert found(spelled) == expected


def test_distances_that_were_off_before_are_no_step():
    assert found("rrrrrWWWrrrrr", OFF_M | {"r": 0.05}) == []
