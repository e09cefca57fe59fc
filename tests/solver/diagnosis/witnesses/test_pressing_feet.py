"""Two feet that stand still keep their distance as well."""

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.diagnosis.witnesses.pressing_feet import pressing_feet

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
