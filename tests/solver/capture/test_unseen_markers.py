"""Positions that say "not seen": zeros, half a position, and markers heaped into one point."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.capture.unseen_markers import unseen_as_nan

NAMES = ("LASI", "RASI", "SACR", "LKNE", "LANK", "LHEE")


def person(frames=20, seed=0):
    """Markers some decimetres apart, moving forward [m]."""
    random = np.random.default_rng(seed)
    placed = random.uniform(-0.5, 0.5, (len(NAMES), 3)) + np.array([0.0, 1.0, 0.0])
    return (
        placed + random.normal(0.0, 1e-3, (frames, len(NAMES), 3)) + np.linspace(0, 1, frames)[:, None, None]
    )


@given(
    st.sets(st.integers(0, 5), min_size=3),
    st.integers(0, 19),
    st.integers(1, 20),
    st.sampled_from([1.0, 1e3]),
)
def test_markers_heaped_into_one_point_count_as_not_seen(group, start, frames, unit):
    positions = person() * unit
    columns = sorted(group)
    heaped = slice(start, min(start + frames, 19))  # one frame at least shows where they are else
    positions[heaped, columns] = positions[heaped, columns[:1]]
    seen, notes = unseen_as_nan(positions, NAMES, "walk.trc")
    expected = np.zeros(positions.shape[:2], dtype=bool)
    expected[heaped, columns] = True
    assert np.array_equal(np.isnan(seen).all(axis=2), expected)
    assert any("in exactly one point" in note for note in notes) == expected.any()


def test_most_of_the_markers_in_one_point_throughout_are_not_seen():
    positions = person()
    positions[:, :4] = positions[:, :1]
    seen, _ = unseen_as_nan(positions, NAMES, "walk.trc")
    assert np.isnan(seen[:, :4]).all()
    assert np.isfinite(seen[:, 4:]).all()


@pytest.mark.parametrize("rounded", [9, 3])
def test_points_computed_onto_a_marker_leave_it_where_it_is(rounded):
    """A foot model's points lie on the heel's marker; rounding makes them equal on some frames."""
    positions = person()
    random = np.random.default_rng(1)
    positions[:, 3:5] = positions[:, 5:] + random.normal(0.0, 2e-4, (20, 2, 3))
    positions = positions.round(rounded)
    positions[7, 3:5] = positions[7, 5]
    seen, notes = unseen_as_nan(positions, NAMES, "walk.c3d")
    assert np.isfinite(seen).all()
    assert not notes


def test_a_marker_with_two_names_is_seen():
    positions = person()
    positions[:, 4] = positions[:, 5]
    assert np.isfinite(unseen_as_nan(positions, NAMES, "walk.c3d")[0]).all()


def test_unseen_markers_are_no_heap():
    positions = person()
    positions[3, :4] = 0.0
    positions[4, :4] = np.nan
    positions[5, 1, 2] = np.nan
    seen, notes = unseen_as_nan(positions, NAMES, "walk.trc")
    assert np.isnan(seen[[3, 4], :4]).all()
    assert np.isnan(seen[5, 1]).all()
    assert [note.split(":")[1].strip() for note in notes] == [
        "0 0 0 counts as not seen",
        "a coordinate is missing, the marker counts as not seen",
    ]
