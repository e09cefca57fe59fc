"""How wide and deep the pelvis becomes: flesh over the spines, and hip centres that a laboratory computed."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.kinematics.calibration import Calibration, calibrate, choose_frames
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.settings import KinematicsSettings
from solver.markers.atlas import atlas
from solver.settings import Settings
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses
from solver.skeleton.segment_tables import lengths
from tests.solver.kinematics.conftest import walking

SETTINGS = KinematicsSettings()
SKIN_FRONT_M, SKIN_BACK_M = 0.0097, 0.0196  # Mantovani et al. 2016, over anterior and posterior spines
MARKER_M = 0.008  # from the skin to the marker's centre
LEGS = ("KNE", "KNM", "ANK", "MED", "HEE", "TOE", "MT5", "MT1")


@pytest.fixture(scope="module")
def body():
    return default_skeleton(height_m=1.72)


def bone_spines(body):
    """The tips of the four spines in the pelvis' frame [m], from the table of lengths alone."""
    of = lengths(1.72, None)
    beside = body.markers[body.marker_names.index("RPSI")].position_body[2]
    back = -of.pelvis_depth * np.array([np.cos(np.radians(11)), -np.sin(np.radians(11)), 0.0])
    return np.array([0.0, 0.0, of.pelvis_width / 2]), back + np.array([0.0, 0.0, beside])


def recorded(body):
    """A walk of a person of usual size: markers on the skin over the spines, and on the legs."""
    R, p = body_poses(body, walking(body))
    front, back = bone_spines(body)
    pelvis, places = body.body_index("pelvis"), {}
    for side, sign in (("R", 1.0), ("L", -1.0)):
        mirror = np.array([1.0, 1.0, sign])
        outward = np.array([np.cos(np.radians(11)), -np.sin(np.radians(11)), 0.0])
        places[f"{side}ASI"] = pelvis, front * mirror + (SKIN_FRONT_M + MARKER_M, 0, 0)
        places[f"{side}PSI"] = pelvis, back * mirror - (SKIN_BACK_M + MARKER_M) * outward
        for name in LEGS:
            marker = body.markers[body.marker_names.index(side + name)]
            places[side + name] = marker.body, marker.position_body
    x = np.stack([p[:, b] + R[:, b] @ place for b, place in places.values()], axis=1)
    return Markers(tuple(places), x, 100.0)


def fitted(body, markers) -> Calibration:
    named = name_markers(body, [markers], default_body=True)
    frames = choose_frames([named.match.observed(markers)], None, SETTINGS)
    return calibrate(named.match.skeleton(named.skeleton), frames, SETTINGS)


def hip_width(skeleton):
    return 2 * abs(skeleton.joints[skeleton.body_index("femur_r")].p_parent_frame[2])


def test_flesh_over_the_spines_makes_no_deeper_pelvis(body):
    found = fitted(body, recorded(body))
    np.testing.assert_allclose(found.factors[body.body_index("pelvis")], 1.0, atol=0.01)
    assert hip_width(found.skeleton) == pytest.approx(hip_width(body), abs=0.002)


@pytest.mark.parametrize("folder", ["opencap_subject4", "opencap_subject6"])
def test_hips_follow_the_centres_that_a_laboratory_found_by_moving_them(real_data, folder):
    """The recordings show each hip twice: found by moving the leg, and by a regression ("_reg")."""
    subject = replace(open_subject(real_data / folder), model=None)
    walk = next(trial for trial in subject.trials if trial.name == "walking1")
    walked, static = (
        read(files, Settings().reading).markers
        for read, files in ((read_trial, walk), (read_static, subject.static))
    )
    body = default_skeleton(mass_kg=subject.mass_kg)
    named = name_markers(body, [walked, static], default_body=True)
    assert {"R_HJC", "L_HJC"} < {name for names in named.match.measured for name in names}
    frames = choose_frames([named.match.observed(walked)], named.match.observed(static), SETTINGS)
    found = calibrate(named.match.skeleton(named.skeleton), frames, SETTINGS).skeleton
    right, left = (walked.positions_ground[:, walked.names.index(f"{side}_HJC")] for side in "RL")
    shown = np.nanmedian(np.linalg.norm(right - left, axis=1))
    of_two_centres = np.sqrt(2) * atlas()["hip_centre_r"].spread_m
    assert abs(hip_width(found) - shown) < 1.5 * of_two_centres
