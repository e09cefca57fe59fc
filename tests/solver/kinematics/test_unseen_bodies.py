import numpy as np
import pytest

from solver.kinematics.motion import Motion
from solver.kinematics.unseen_bodies import unseen_body_notes

MOTION = Motion(("any",), np.zeros((100, 1)), 100.0)


@pytest.fixture
def foot(crane):
    """The last segment that carries markers: its name, and which markers are on it."""
    body = max(marker.body for marker in crane.markers)
    return crane.bodies[body].name, np.array([marker.body == body for marker in crane.markers])


@pytest.fixture
def observed(crane):
    return np.ones((100, len(crane.markers), 3))


def test_nothing_is_said_of_segments_with_one_marker_left(crane, observed, foot):
    _, on_foot = foot
    observed[:, np.flatnonzero(on_foot)[1:]] = np.nan
    assert unseen_body_notes(crane, observed, MOTION) == ()


def test_a_segment_that_is_never_seen_is_named(crane, observed, foot):
    name, on_foot = foot
    observed[:, on_foot] = np.nan
    assert unseen_body_notes(crane, observed, MOTION) == (
        f"no marker on {name} is ever seen: how they move is a guess",
    )


def test_long_gaps_are_named_and_short_ones_are_not(crane, observed, foot):
    name, on_foot = foot
    observed[20:50, on_foot] = np.nan
    observed[70:75, on_foot] = np.nan
    assert unseen_body_notes(crane, observed, MOTION) == (
        f"no marker on {name} is seen in frames 20-49: their pose is interpolated",
    )
