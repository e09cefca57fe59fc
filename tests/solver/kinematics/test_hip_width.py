"""How wide and deep the pelvis becomes: soft tissue over the spines, and hip centres of a laboratory."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.fitting.settings import Settings
from solver.kinematics.calibration import Calibration, calibrate, choose_frames
from solver.kinematics.hip_width import expected_hip_width, hip_pair
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.settings import KinematicsSettings
from solver.markers.atlas import atlas
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses
from solver.skeleton.osim import load_skeleton
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
    expected = expected_hip_width(named.landmarks, named.match, [markers])
    return calibrate(named.match.skeleton(named.skeleton), frames, SETTINGS, hip_width_m=expected)


def hip_width(skeleton):
    return 2 * abs(skeleton.joints[skeleton.body_index("femur_r")].p_parent_frame[2])


def test_soft_tissue_over_the_spines_makes_no_deeper_pelvis(body):
    found = fitted(body, recorded(body))
    np.testing.assert_allclose(found.factors[body.body_index("pelvis")], 1.0, atol=0.01)
    assert hip_width(found.skeleton) == pytest.approx(hip_width(body), abs=0.002)


def test_bone_and_muscles_attachments_go_with_the_hips_and_inertia_stays(body):
    wide, pelvis = hip_pair(body).widened(body, 1.2), body.body_index("pelvis")
    assert hip_width(wide) == pytest.approx(1.2 * hip_width(body))
    own, found = body.bodies[pelvis], wide.bodies[pelvis]
    drawn = found.geometry[0].scale / own.geometry[0].scale
    np.testing.assert_allclose([found.scale, drawn], [(1.0, 1.0, 1.2)] * 2)
    assert found.inertia_body is own.inertia_body


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
    found = calibrated(named, [walked], static).skeleton
    right, left = (walked.positions_ground[:, walked.names.index(f"{side}_HJC")] for side in "RL")
    shown = np.nanmedian(np.linalg.norm(right - left, axis=1))
    of_two_centres = np.sqrt(2) * atlas()["hip_centre_r"].spread_m
    assert abs(hip_width(found) - shown) < 1.5 * of_two_centres


def calibrated(named, moving, static):
    everything = [*moving, *([static] if static else [])]
    observed = named.match.observed
    frames = choose_frames([observed(m) for m in moving], observed(static) if static else None, SETTINGS)
    return calibrate(
        named.match.skeleton(named.skeleton),
        frames,
        SETTINGS,
        hip_width_m=expected_hip_width(named.landmarks, named.match, everything),
    )


@pytest.mark.parametrize("default_body", [True, False])
@pytest.mark.parametrize(
    ("folder", "by_hand"),
    [("opencap_subject4", "manually_scaled.osim"), ("opencap_subject6", "hand_scaled.osim")],
)
def test_hips_are_as_far_apart_as_in_the_model_that_an_expert_scaled(
    real_data, folder, by_hand, default_body
):
    subject = open_subject(real_data / folder)
    walk = next(trial for trial in subject.trials if trial.name == "walking1")
    walked = read_trial(walk, Settings().reading).markers
    static = read_static(subject.static, Settings().reading).markers
    model = default_skeleton(mass_kg=subject.mass_kg) if default_body else load_skeleton(subject.model)
    named = name_markers(model, [walked, static], default_body=default_body)
    found = calibrated(named, [walked], static).skeleton
    expert = load_skeleton(real_data / folder / "reference" / by_hand)
    assert hip_width(found) == pytest.approx(hip_width(expert), abs=0.010)


def test_regressions_expect_what_their_authors_print(body):
    """Spines 240 mm apart: Harrington's 0.33 · 240 + 7.3 a side; legs of 850 mm: Hara's 0.086 · 850 + 8."""
    names = ("RASI", "LASI", "RKNE", "RANK", "RMED")
    x = np.array([[0.0, 0.9, 0.12], [0, 0.9, -0.12], [0, 0.45, 0.12], [0, 0.04, 0.12], [0, 0.05, 0.12]])
    recording = Markers(names, np.stack([x] * 3), 100.0)
    match = MarkerMatch(names, tuple((name,) for name in names), ())
    marks = ("asis_r", "asis_l", "knee_lateral_r", "ankle_lateral_r", "ankle_medial_r")
    landmarks = dict(zip(marks, names, strict=True))
    harrington, hara = 2 * (0.33 * 0.240 + 0.0073), 2 * (0.086 * 0.850 + 0.008)
    both = expected_hip_width(landmarks, match, [recording])
    assert both == pytest.approx((harrington + hara) / 2)
    bent = replace(recording, positions_ground=recording.positions_ground.copy())
    bent.positions_ground[:, 2, 0] = 0.3
    assert expected_hip_width(landmarks, match, [bent]) == pytest.approx(harrington)
    assert expected_hip_width({}, match, [recording]) is None
