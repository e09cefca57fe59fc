"""Two feet that stand still keep their distance as well."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.trial import READING
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.pressure_path import pressing_feet, pressure_path

FOOT = {"heel": (-0.10, 0.0), "toe": (0.14, 0.01), "side": (0.05, 0.05)}  # x and z about its middle
APART_M = 0.26
TRAVEL = np.linspace(0.0, 1.0, 200)


def feet(right="R_{}", left="L_{}", travel_m=(0.0, 0.0)):
    names, places = [], []
    for label, z, way in ((right, APART_M / 2, travel_m[0]), (left, -APART_M / 2, travel_m[1])):
        for part, (x, aside) in FOOT.items():
            names.append(label.format(part))
            places.append(np.stack([x + way * TRAVEL, 0.03 + 0 * TRAVEL, z + aside + 0 * TRAVEL], axis=1))
    return Markers(tuple(names), np.stack(places, axis=1), 100.0)


def middles(markers):
    return sorted(float(np.mean(foot.middle[:, 1])) for foot in pressing_feet(markers))


RIGHT_AND_LEFT = pytest.approx([-APART_M / 2 + 0.02, APART_M / 2 + 0.02])


@pytest.mark.parametrize("travel_m", [(0.0, 0.0), (0.6, -0.6)])
def test_they_are_two_by_their_labels(travel_m):
    assert middles(feet(travel_m=travel_m)) == RIGHT_AND_LEFT


def test_without_sides_they_are_two_once_they_move():
    assert middles(feet("one {}", "two {}", (0.6, -0.6))) == RIGHT_AND_LEFT


def test_where_nothing_tells_them_apart_there_is_none():
    assert pressing_feet(feet("one {}", "two {}")) == []


@settings(max_examples=60, deadline=None)
@example([((0, 3), 0, 200)])
@given(
    st.lists(
        st.tuples(st.sampled_from([(0, 3), (3, 6), (0, 6), (1, 2)]), st.integers(0, 199), st.integers(1, 200))
    )
)
def test_feet_that_are_not_seen_for_a_while_tell_nothing_and_break_nothing(gaps):
    markers = feet(travel_m=(0.6, -0.6))
    places = markers.positions_ground.copy()
    for (first, last), start, length in gaps:
        places[start : start + length, first:last] = np.nan
    frames = len(places)
    at = np.stack([0.6 * TRAVEL, 0 * TRAVEL, np.full(frames, APART_M / 2)], axis=1)
    force = np.tile([0.0, 700.0, 0.0], (frames, 1))
    plate = ForcePlate("plate 1", force, np.cross(at, force), at, 100.0)
    capture = Capture("walk", replace(markers, positions_ground=places), (plate,))
    told = pressure_path([Measured(capture, READING)])
    seen = np.isfinite(places[:, :, 0])
    if not (seen[:, :3].any(axis=1).mean() > 0.7 and seen[:, 3:].any(axis=1).mean() > 0.7):
        assert not told
    for statement in told:
        assert statement.figures["off_m"] < 0.15
