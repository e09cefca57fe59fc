import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.capture.capture import Markers
from solver.capture.trajectory_joining import join_trajectories

PLACES = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0.05, 0.1, 0.08], [0.12, 0.15, 0.02]], dtype=float)


@pytest.fixture
def segment():
    """Five markers on one turning and travelling segment."""
    turn = Rotation.from_euler("yz", np.stack([np.linspace(0, 2, 100), np.linspace(0, 1, 100)], axis=1))
    path = np.linspace([0, 1, 0], [2, 1.2, 0.4], 100)
    x = np.stack([turn.apply(place) + path for place in PLACES], axis=1)
    return x + np.random.default_rng(0).normal(0, 0.0005, x.shape)


def broken(x, names, frames, by=0.0):
    """The last marker's trajectory goes on under another label from some frame on, moved by some metres."""
    piece = np.full((len(x), 1, 3), np.nan)
    piece[frames:, 0] = x[frames:, 4] + by
    first = x.copy()
    first[frames:, 4] = np.nan
    return Markers(names, np.concatenate([first, piece], axis=1), 100.0)


def test_a_piece_under_a_number_continues_the_named_marker(segment):
    markers, notes = join_trajectories(broken(segment, ("A", "B", "C", "D", "RTHI", "*17"), 60))
    assert markers.names == ("A", "B", "C", "D", "RTHI")
    np.testing.assert_array_equal(markers.positions_ground, segment)
    assert notes == ("pieces of one trajectory under several labels, joined: RTHI with *17",)


def test_of_three_pieces_all_are_one(segment):
    markers = broken(segment, ("A", "B", "C", "D", "*1", "*2"), 60)
    third = np.full((100, 1, 3), np.nan)
    third[80:, 0] = markers.positions_ground[80:, 5]
    x = np.concatenate([markers.positions_ground, third], axis=1)
    x[80:, 5] = np.nan
    joined, notes = join_trajectories(Markers((*markers.names, "*3"), x, 100.0))
    assert joined.names == ("A", "B", "C", "D", "*1")
    assert np.isfinite(joined.positions_ground).all()
    assert notes == ("pieces of one trajectory under several labels, joined: *1 with *2, *3",)


def test_another_place_on_the_segment_is_another_marker(segment):
    markers = broken(segment, ("A", "B", "C", "D", "RTHI", "*17"), 60, by=0.03)
    assert join_trajectories(markers) == (markers, ())


def test_two_names_that_mean_something_are_left_alone(segment):
    markers = broken(segment, ("A", "B", "C", "D", "RTHI", "RTHX"), 60)
    assert join_trajectories(markers) == (markers, ())


def test_markers_seen_together_are_two(segment):
    markers = broken(segment, ("A", "B", "C", "D", "RTHI", "*17"), 60)
    markers.positions_ground[60, 4] = segment[60, 4]
    assert join_trajectories(markers) == (markers, ())


def test_pieces_of_one_name_that_never_meet_are_one_marker(segment):
    markers = broken(segment, ("A", "B", "C", "D", "RTHI", "RTHI#2"), 60, by=0.05)
    joined, notes = join_trajectories(markers)
    assert joined.names == ("A", "B", "C", "D", "RTHI")
    assert np.isfinite(joined.positions_ground).all()
    assert "RTHI with RTHI#2" in notes[0]
    markers.positions_ground[60, 4] = segment[60, 4]
    assert join_trajectories(markers) == (markers, ())
