"""Labels against models that others made: parts of the body, exchanges, and what a wrong one costs."""

import numpy as np
import pytest

from benchmarks import marker_labels
from benchmarks.marker_labels import (
    BY_DISTANCE,
    BY_NAME,
    EXCHANGED,
    NOT_READ,
    SHARE,
    LabelSet,
    exchanges,
    not_right,
    part_of,
    read_as,
    right_parts,
    sets_table,
    ways_of,
)
from solver.capture.capture import Markers

LABELS = ("RASI", "LASI", "RKNE", "LKNE", "RANK", "LANK", "C7", "STRN", "RHEE", "LHEE", "NOBODY")
PARTS = (
    "pelvis",
    "pelvis",
    "thigh r",
    "thigh l",
    "shank r",
    "shank l",
    "trunk",
    "trunk",
    "foot r",
    "foot l",
    "hand r",
)


@pytest.fixture
def named():
    return LabelSet("made up", dict(zip(LABELS, PARTS, strict=True)), ())


@pytest.mark.parametrize(
    ("body", "part"),
    [
        ("toes_l", "foot l"),
        ("radius_r", "forearm r"),
        ("torso", "trunk"),
        ("pelvis", "pelvis"),
        ("rod_r", "rod_r"),
    ],
)
def test_a_body_belongs_to_a_part(body, part):
    assert part_of(body) == part


def test_labels_are_read_by_name_and_what_no_table_has_is_left_out(named):
    assert ways_of(named) == (BY_NAME,)
    read = read_as(named, BY_NAME)
    assert read == {**right_parts(named, BY_NAME), "NOBODY": NOT_READ}


def test_what_is_exchanged_is_on_another_part_and_right_when_left_out(named):
    pairs = exchanges(named)
    assert SHARE * len(LABELS) <= len(pairs) < SHARE * len(LABELS) + 2
    for label, other in pairs.items():
        assert pairs[other] == label
        assert named.part[label] != named.part[other]
    right = right_parts(named, EXCHANGED)
    assert {label for label, part in right.items() if part == NOT_READ} == set(pairs)


def test_recordings_are_read_with_the_labels_exchanged(named, monkeypatch):
    seen = []
    monkeypatch.setattr(
        marker_labels, "understand", lambda labels, recordings: seen.append((labels, recordings)) or Nothing()
    )
    markers = Markers(LABELS, np.zeros((3, len(LABELS), 3)), 100.0)
    recorded = LabelSet(named.name, named.part, (markers,))
    assert ways_of(recorded) == (BY_NAME, BY_DISTANCE, EXCHANGED)
    for way in ways_of(recorded):
        read_as(recorded, way)
    (_, none), (_, plain), (_, exchanged) = seen
    assert none == ()
    assert plain[0].names == LABELS
    at = {label: exchanged[0].names.index(label) for label in LABELS}
    other = exchanges(named)
    assert all(LABELS[place] == other.get(label, label) for label, place in at.items())


class Nothing:
    def by_label(self):
        return {}


def test_a_wrong_part_costs_twice_what_is_left_out(named, monkeypatch):
    monkeypatch.setattr(marker_labels, "label_sets", lambda: (named,))
    right = list(PARTS)
    assert not_right([right]) == {"made up": 0.0}
    assert not_right([[NOT_READ, *right[1:]]]) == {"made up": pytest.approx(0.5 / len(PARTS))}
    assert not_right([["trunk", *right[1:]]]) == {"made up": pytest.approx(1 / len(PARTS))}


def test_the_table_names_what_is_wrong(named, monkeypatch):
    one = LabelSet("made up", {**named.part, "RHEE": "foot l"}, ())
    monkeypatch.setattr(marker_labels, "label_sets", lambda: (one,))
    assert sets_table().splitlines()[-1] == "| made up | 11 | name | 9 | 1 | RHEE: foot r |"
