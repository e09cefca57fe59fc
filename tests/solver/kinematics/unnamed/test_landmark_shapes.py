"""A pelvis with more markers behind than it has spines, seen in poses that are wrong."""

import numpy as np
import pytest

from solver.kinematics.unnamed.landmark_mixture import by_shape, landmark_mixture
from solver.markers.atlas import atlas

MIXTURE = landmark_mixture()
PLACE = dict(zip(MIXTURE.skeleton.marker_names, MIXTURE.place_body, strict=True))
SPINES = ("asis_r", "asis_l", "psis_r", "psis_l", "sacrum")
EXTRA = len(SPINES)  # the marker without a landmark


def turned_by(angle_rad):
    """About the axis to the right, as a wrong pelvic tilt turns all markers in the body's frame."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def shape(places, names=SPINES, angle_rad=0.0):
    """What becomes of markers at these places, called by these landmarks."""
    R = turned_by(angle_rad)
    at = {i: atlas()[name] for i, name in enumerate(names)}
    return by_shape(at, {i: R @ p for i, p in enumerate(places)}, MIXTURE)


def names_of(found):
    return {i: mark.name for i, mark in found.at.items()}


@pytest.mark.parametrize("angle_rad", [0.0, 0.3, -0.3])
def test_a_plate_below_the_sacrum_gives_the_sacrum_back(angle_rad):
    plate = PLACE["sacrum"] + [-0.02, -0.07, 0.0]
    places = [*(PLACE[n] for n in SPINES[:-1]), plate, PLACE["sacrum"]]
    found = shape(places, angle_rad=angle_rad)
    assert names_of(found) == {0: "asis_r", 1: "asis_l", 2: "psis_r", 3: "psis_l", EXTRA: "sacrum"}
    np.testing.assert_allclose(found.place_body[4], plate, atol=1e-6)  # laid anew, whatever the pose was


def test_markers_that_fit_keep_their_landmarks_and_their_places():
    places = [*(PLACE[n] for n in SPINES), PLACE["sacrum"] + [0.0, 0.10, 0.0]]
    found = shape(places, angle_rad=0.2)
    assert names_of(found) == dict(enumerate(SPINES))
    np.testing.assert_allclose(found.place_body[0], turned_by(0.2) @ places[0])
    assert found.spread_m[4] == pytest.approx(atlas()["sacrum"].spread_m, rel=0.05)


def test_a_rival_that_fits_as_well_loosens_the_place():
    apart = np.array([0.0, 0.015, 0.0])
    places = [*(PLACE[n] for n in SPINES[:-1]), PLACE["sacrum"] - apart, PLACE["sacrum"] + apart]
    found = shape(places)
    doubt = 0.5 * (2 * 0.015) ** 2  # either, as far apart as they are
    assert found.spread_m[4] == pytest.approx(np.sqrt(0.012**2 + doubt), rel=0.1)
    assert found.spread_m[0] == pytest.approx(0.012, rel=0.01)


def test_three_landmarks_are_taken_as_they_are():
    far = PLACE["psis_r"] + [0.05, 0.05, 0.05]
    found = shape([PLACE["asis_r"], PLACE["asis_l"], far, PLACE["psis_r"]], SPINES[:3])
    assert names_of(found) == dict(enumerate(SPINES[:3]))
    assert found.spread_m[2] == atlas()["psis_r"].spread_m
