"""Labels of several subjects in one file: one is kept, the others are told and left out."""

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.recording_files import one_subject

LABELS = ("RASI", "LASI", "RKNE", "LKNE", "RANK", "LANK")
SIDED = tuple(f"{side}:{label}" for side in "LR" for label in ("ASI", "PSI", "KNE", "ANK", "HEE", "TOE"))


LEFT_AND_RIGHT = tuple(
    f"{side}_{label}"
    for side in ("Left", "Right")
    for label in ("asis", "psis", "knee", "ankle", "heel", "toe")
)
CLUSTERS = tuple(
    f"{body}_{label}" for body in ("thigh", "shank", "foot") for label in ("l1", "r1", "l2", "r2", "a", "b")
)


def recorded(names, shift_m=None, sign=":"):
    """Markers beside each other; those of other names than the first one's stand off, each its own way."""
    places = np.array([[0.1 * k % 0.6, 1.0, 0.0] for k in range(len(names))])
    whose = [n.rpartition(sign)[0] for n in names]
    aside = np.array([list(dict.fromkeys(whose)).index(w) for w in whose])
    places[:, 2] += aside * (1.5 if shift_m is None else shift_m)
    return Markers(tuple(names), np.tile(places, (10, 1, 1)), 100.0)


@pytest.mark.parametrize("first", ["", "Ann"])
def test_the_second_person_is_left_out_and_told(first):
    labels = [f"{first}:{label}" if first else label for label in LABELS]
    whole = recorded([*labels, *(f"Bob:{label}" for label in LABELS)])
    found = one_subject(whole)
    assert found.markers.names == LABELS
    np.testing.assert_array_equal(found.markers.positions_ground, whole.positions_ground[:, : len(LABELS)])
    assert (found.name, found.others) == (first, ("Bob",))
    assert f"2 people in one file: {first or 'no name'} (6 markers) is taken" in found.notes[0]
    assert "Bob (6 markers, 1.5 m away) left out" in found.notes[0]
    assert 'prefix = "Bob"' in found.notes[0]


def test_who_was_seen_most_is_kept():
    whole = recorded([*LABELS, *(f"Bob:{label}" for label in LABELS)])
    whole.positions_ground[:6, : len(LABELS)] = np.nan
    found = one_subject(whole)
    assert (found.name, found.others) == ("Bob", ("",))
    np.testing.assert_array_equal(found.markers.positions_ground, whole.positions_ground[:, len(LABELS) :])


@pytest.mark.parametrize("wanted", ["Ann", "Bob", "Cleo"])
def test_whoever_is_wanted_is_taken(wanted):
    names = [f"{who}:{label}" for who in ("Ann", "Bob", "Cleo") for label in LABELS]
    whole = recorded(names)
    found = one_subject(whole, wanted)
    assert found.name == wanted
    assert set(found.others) == {"Ann", "Bob", "Cleo"} - {wanted}
    assert "are left out, as subject.toml says" in found.notes[0]
    first = names.index(f"{wanted}:RASI")
    np.testing.assert_array_equal(
        found.markers.positions_ground, whole.positions_ground[:, first : first + 6]
    )


@pytest.mark.parametrize("sign", ["_", "-", ".", " "])
def test_people_are_told_by_other_signs_where_both_have_left_and_right_labels(sign):
    names = [f"{who}{sign}{label}" for who in ("P1", "P2") for label in LABELS]
    found = one_subject(recorded(names, sign=sign), "P2")
    assert (found.markers.names, found.name, found.others) == (LABELS, "P2", ("P1",))


def test_who_is_not_in_the_file_decides_nothing():
    whole = recorded([f"Ann:{label}" for label in LABELS])
    assert one_subject(whole, "Bob").markers.names == LABELS


def test_the_same_markers_written_twice_are_no_second_person():
    found = one_subject(recorded([*LABELS, *(f"raw:{label}" for label in LABELS)], 0.001))
    assert "written twice" in found.notes[0]
    assert (found.markers.names, found.others) == (LABELS, ())


@pytest.mark.parametrize(
    ("names", "kept"),
    [
        (LABELS, LABELS),
        ([f"Ann:{label}" for label in LABELS], LABELS),
        (SIDED, SIDED),
        (LEFT_AND_RIGHT, LEFT_AND_RIGHT),
        (CLUSTERS, CLUSTERS),
        ([*LABELS, *(f"cart:{c}" for c in "abcdef")], (*LABELS, *"abcdef")),
        ([*(f"Legs:{label}" for label in LABELS), "Arms:LELB"], (*LABELS, "LELB")),
        ([*LABELS, "Bob:RASI", "Bob:LASI", "Bob:bar"], (*LABELS, "bar")),
    ],
)
def test_one_person_stays_whole_without_the_name(names, kept):
    found = one_subject(recorded(names))
    assert found.markers.names == tuple(kept)
    assert found.others == ()
    left = [name for name in names if name.startswith("Bob") and not name.endswith("bar")]
    assert all(any(name in note for note in found.notes) for name in left)
