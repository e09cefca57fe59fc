"""People whose markers on the pelvic spines sit high or low in front."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.storage import read_storage
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.fitting.settings import Settings
from solver.kinematics.calibration import calibrate, choose_frames
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.marker_matching import match_markers
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.upright_pelvis import of_bone, on_upright_pelvis, pitch_of_spines, upright_inclination
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.scaling import with_offsets

SETTINGS = KinematicsSettings()

NAMES = ("RASI", "LASI", "RPSI", "LPSI", "RKNE", "LKNE", "RANK", "LANK")


@pytest.fixture(scope="module")
def body():
    return default_skeleton()


def recording(body, tilt_deg, names=NAMES, squatting=0):
    """Quiet stance with the pelvis tipped, and as many frames with it lower and tipped further."""
    q = np.tile(body.default_q, (20 + squatting, 1))
    q[:, body.dofs.index("pelvis_tilt")] = np.radians(tilt_deg)
    q[20:, body.dofs.index("pelvis_tilt")] -= 0.6
    q[20:, body.dofs.index("pelvis_ty")] -= 0.3
    x = marker_positions(body, q)[:, [body.marker_names.index(n) for n in names]]
    c, s = np.cos(0.8), np.sin(0.8)  # a heading
    return Markers(names, x @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]), 100.0)


def inclination_deg(skeleton, back="PSI"):
    """Of the line from the front to the back in the pelvis frame."""
    place = {m.name: m.position_body for m in skeleton.markers}
    front = (place["RASI"] + place["LASI"]) / 2
    rear = place["SACR"] if back == "SACR" else (place["RPSI"] + place["LPSI"]) / 2
    return np.degrees(np.arctan2(rear[1] - front[1], front[0] - rear[0]))


def turned(body, markers):
    return on_upright_pelvis(body, match_markers(body, [markers]), [markers])


@pytest.mark.parametrize("tilt_deg", [-20.0, 15.0])
def test_the_bone_takes_its_share_of_what_is_unusual(body, tilt_deg):
    after = turned(body, recording(body, tilt_deg))
    # tilted backwards (positive) the front stands higher: the line falls forward by less
    assert inclination_deg(after) - inclination_deg(body) == pytest.approx(of_bone(-tilt_deg), abs=0.05)


def test_posture_takes_most_of_a_small_deviation_and_little_of_what_people_do_not_stand_in():
    unusual = np.arange(1.0, 45.0)
    bone = np.array([of_bone(u) for u in unusual])
    np.testing.assert_allclose([of_bone(-u) for u in unusual], -bone)
    assert (np.diff(bone) > 0).all()
    posture = unusual - bone
    assert (posture[unusual < 12] > 0.65 * unusual[unusual < 12]).all()
    assert posture.max() < 17.0  # 1.7 deviations of people's postures
    assert posture[unusual == 37].item() < 14.5


def test_the_turn_of_the_spines_is_the_change_of_their_inclination(body):
    markers = recording(body, 15.0)
    match = match_markers(body, [markers])
    shared = match.skeleton(body)
    landmarks = {"asis_r": "RASI", "asis_l": "LASI", "psis_r": "RPSI", "psis_l": "LPSI"}
    pitch = pitch_of_spines(shared, landmarks)
    rng = np.random.default_rng(4)
    moved = rng.normal(0, 1e-5, pitch.shape)
    after = with_offsets(shared, moved)
    turn = np.radians(inclination_deg(shared) - inclination_deg(after))
    assert (pitch * moved).sum() == pytest.approx(turn, rel=1e-3)
    assert pitch_of_spines(shared, {"asis_r": "RASI"}) is None


def test_a_pelvis_that_was_pitched_by_its_spines_is_not_pitched_again_to_suit_the_trunk(real_data):
    """OpenSim's example of a walk: its own model leans the pelvis by 4°, on spines that are nearly level."""
    folder = real_data / "walk_gait2354_subject01"
    subject = replace(open_subject(folder), model=None)
    walk = next(trial for trial in subject.trials if trial.name == "walk1")
    reading = Settings().reading
    walked = read_trial(walk, reading).markers
    static = read_static(subject.static, reading).markers
    body = default_skeleton(mass_kg=subject.mass_kg)
    named = name_markers(body, [walked, static], default_body=True)
    shared, observed = named.match.skeleton(named.skeleton), named.match.observed
    found = calibrate(
        shared,
        choose_frames([observed(walked)], observed(static), SETTINGS),
        SETTINGS,
        pitch_of_spines=pitch_of_spines(shared, named.landmarks),
    )
    seen = observed(walked)[::10]
    q = inverse_kinematics(found.skeleton, seen, walked.rate / 10, SETTINGS)
    ours = np.degrees(q[:, found.skeleton.dofs.index("pelvis_tilt")].mean())
    example = read_storage(folder / "reference" / "subject01_walk1_ik.mot")
    theirs = example.column("pelvis_tilt").mean()
    assert abs(ours - theirs) < 10.0


def test_the_spines_stay_where_they_are_in_the_mean_and_apart_as_they_were(body):
    after = turned(body, recording(body, 15.0))
    here, there = ({m.name: m.position_body for m in s.markers} for s in (body, after))
    spines = ("RASI", "LASI", "RPSI", "LPSI")
    np.testing.assert_allclose(sum(there[n] for n in spines), sum(here[n] for n in spines), atol=1e-9)
    for one in spines:
        for other in spines:
            assert np.linalg.norm(there[one] - there[other]) == pytest.approx(
                np.linalg.norm(here[one] - here[other])
            )
    assert all(a is b for a, b in zip(body.markers, after.markers, strict=True) if a.name not in spines)


def test_a_marker_on_the_sacrum_stands_for_the_posterior_spines(body):
    names = ("RASI", "LASI", "SACR", *NAMES[4:])
    after = turned(body, recording(body, 15.0, names))
    expected = inclination_deg(body, "SACR") + of_bone(-15.0)
    assert inclination_deg(after, "SACR") == pytest.approx(expected, abs=0.05)


def test_the_usual_posture_and_a_squat_change_nothing(body):
    after = turned(body, recording(body, 0.0, squatting=60))
    assert all(a is b for a, b in zip(after.markers, body.markers, strict=True))


def test_who_lies_or_shows_no_posterior_spines_tells_nothing(body):
    for markers in (recording(body, 80.0), recording(body, 15.0, ("RASI", "LASI", *NAMES[4:]))):
        assert turned(body, markers) is body


def test_inclination_does_not_depend_on_heading_and_gaps():
    front, back = np.zeros((9, 3)), np.zeros((9, 3))
    heading = np.linspace(0, 6, 9)
    back[:, 0], back[:, 2] = -0.15 * np.cos(heading), 0.15 * np.sin(heading)
    back[:, 1] = 0.15 * np.tan(0.2)
    front[4] = np.nan
    assert upright_inclination(front, back) == pytest.approx(0.2)
    assert np.isnan(upright_inclination(np.full((3, 3), np.nan), back[:3]))
