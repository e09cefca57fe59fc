"""Feet whose markers stand higher or lower than usual, resting on level ground."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.kinematics.default_body_naming import on_flat_feet, resting_heights
from solver.kinematics.marker_matching import match_markers
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions

RATE = 100.0
NAMES = ("RASI", "LASI", "RKNE", "LKNE", "RANK", "RHEE", "RTOE", "RMT5", "LHEE", "LTOE")


@pytest.fixture(scope="module")
def body():
    return default_skeleton()


def standing(body, raised_m, frames=40, ground_m=0.0):
    """Quiet stance of a person whose markers sit higher on the foot than the default body's."""
    marks = [
        replace(m, position_body=m.position_body + np.array([0, raised_m.get(m.name, 0), 0]))
        for m in body.markers
    ]
    own = body.with_markers(marks)
    q = np.tile(body.default_q, (frames, 1))
    q[:, body.dofs.index("pelvis_ty")] += ground_m
    return Markers(NAMES, marker_positions(own, q)[:, [body.marker_names.index(n) for n in NAMES]], RATE)


def heights(skeleton):
    return {m.name: m.position_body[1] for m in skeleton.markers}


def laid(body, recordings):
    match = match_markers(body, recordings)
    return on_flat_feet(body, match, recordings)


def test_a_heel_marker_that_sits_high_is_found_high(body):
    found, usual = heights(laid(body, [standing(body, {"RHEE": 0.02})])), heights(body)
    apart = (found["RHEE"] - found["RTOE"]) - (usual["RHEE"] - usual["RTOE"])
    assert apart == pytest.approx(0.02, abs=0.005)
    assert found["LHEE"] == usual["LHEE"]


def test_the_grounds_own_height_does_not_matter(body):
    here = heights(laid(body, [standing(body, {"RHEE": 0.02})]))
    there = heights(
        laid(body, [standing(body, {"RHEE": 0.02}), standing(body, {"RHEE": 0.02}, ground_m=0.3)])
    )
    assert there["RHEE"] == pytest.approx(here["RHEE"], abs=1e-9)


def test_usual_feet_and_markers_elsewhere_stay_as_they_are(body):
    after = laid(body, [standing(body, {"RKNE": 0.05})])
    assert all(a is b for a, b in zip(after.markers, body.markers, strict=True))


def test_a_foot_that_never_rests_shows_nothing(body):
    markers = standing(body, {"RHEE": 0.02})
    moving = markers.positions_ground.copy()
    moving[:, NAMES.index("RTOE"), 1] += 0.2 * np.arange(len(moving)) / RATE
    after = heights(laid(body, [replace(markers, positions_ground=moving)]))
    assert after["RHEE"] == heights(body)["RHEE"]


def test_a_heel_far_off_the_ground_is_no_flat_foot(body):
    after = heights(laid(body, [standing(body, {"RHEE": 0.10})]))
    assert after["RHEE"] == heights(body)["RHEE"]


def test_rests_in_the_air_and_short_ones_do_not_count():
    time = np.arange(200) / RATE
    lifted = np.where(time > 1.0, 0.3, 0.0)[:, None] + np.array([0.03, 0.05])
    lifted[time > 1.0, 0] += 0.04  # held still with the heel raised
    np.testing.assert_allclose(resting_heights([(lifted, RATE)]), [-0.01, 0.01], atol=1e-6)
    hopping = 0.05 * np.abs(np.sin(2 * np.pi * 3 * time))[:, None] + np.array([0.03, 0.05])
    assert np.isnan(resting_heights([(hopping, RATE)])).all()
