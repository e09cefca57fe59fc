"""Labels of several subjects in one file: one is kept, the others are told and left out."""

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.several_subjects import one_subject

LABELS = ("RASI", "LASI", "RKNE", "LKNE", "RANK", "LANK")


def recorded(names, shift_m=None):
    """Markers beside each other; those of another name than the first one's stand off."""
    places = np.array([[0.1 * k % 0.6, 1.0, 0.0] for k in range(len(names))])
    whose = [n.rpartition(":")[0] for n in names]
    places[[w != whose[0] for w in whose]] += [0.0, 0.0, 1.5 if shift_m is None else shift_m]
    return Markers(tuple(names), np.tile(places, (10, 1, 1)), 100.0)


@pytest.mark.parametrize("first", ["", "Ann:"])
def test_the_second_person_is_left_out_and_told(first):
    whole = recorded([*(first + label for label in LABELS), *(f"Bob:{label}" for label in LABELS)])
    kept, (note,) = one_subject(whole)
    assert kept.names == tuple(first + label for label in LABELS)
    np.testing.assert_array_equal(kept.positions_ground, whole.positions_ground[:, : len(LABELS)])
    assert "6 of 'Bob'" in note
    assert ("'Ann'" if first else "no name") in note


def test_who_was_seen_most_is_kept():
    whole = recorded([*LABELS, *(f"Bob:{label}" for label in LABELS)])
    whole.positions_ground[:6, : len(LABELS)] = np.nan
    kept, (note,) = one_subject(whole)
    assert kept.names == tuple(f"Bob:{label}" for label in LABELS)
    assert "6 of no name, 1.5 m away, are left out" in note


def test_the_same_markers_written_twice_are_no_second_person():
    _, (note,) = one_subject(recorded([*LABELS, *(f"raw:{label}" for label in LABELS)], 0.001))
    assert "written twice" in note


@pytest.mark.parametrize(
    "names",
    [
        LABELS,
        [f"Ann:{label}" for label in LABELS],
        [f"{side}:{label}" for side in ("L", "R") for label in ("ASI", "PSI", "KNE", "ANK", "HEE", "TOE")],
        [*LABELS, "cart:a", "cart:b", "cart:c", "cart:d", "cart:e", "cart:f"],
        [*LABELS, "Bob:RASI", "Bob:LASI"],
    ],
)
def test_one_person_stays_whole(names):
    whole = recorded(names)
    assert one_subject(whole) == (whole, ())
