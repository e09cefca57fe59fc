"""One motion exported twice is one trial; two motions of one person are two."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.subject.opened_subject import open_subject
from solver.capture.subject.same_motion import is_static, markers_of, same_motion

SPRINT = "sprint_overground_dorn2012_JA1_9ms/"
TWO_TRIALS = [
    ("opencap_subject4/MarkerData/walking1.trc", "opencap_subject4/MarkerData/walkingTO1.trc"),
    ("exo_apo_gordon/S1_NE21_no_exo/NE21.trc", "exo_apo_gordon/S1_ET21_exo_transparent/ET21.trc"),
    ("opencap_subject4/MarkerData/walking1.trc", "opencap_subject6/walking1.trc"),
    ("opencap_subject4/MarkerData/static1.trc", "opencap_subject6/static1.trc"),
]
WALK, STATIC = "opencap_subject4/MarkerData/walking1.trc", "opencap_subject4/MarkerData/static1.trc"
JUMP = "opencap_subject4/MarkerData/DJ1.trc"
STANDING = """
    static Static1 RBDS001static GAIT01_STATIC StaticTrial statique02 Statisch estático statico Standing
    Standing_Cal_SL STANDINGCAL StandingCal cal CAL1 Cal_01 calibration PiG_Calibration-FlatFoot Stand01
    calibración calibrazione kalibration s03_Kalibrierung T-pose Tpose TPose t_pose2 npose A-Pose Stehen
    anat_pose_P1 Test_func_anat anatomical_posture debout_1
"""
NO_WORDS = """
    uphill_walking_calibrated recalibrated walk1 local vertical_jump calf_raise calm normal standup posest
    understanding standardwalk radical outstanding ecstasis
"""


def test_a_c3d_and_a_trc_under_other_names_and_axes(real_data):
    trc, c3d = (
        markers_of(real_data / SPRINT / "run0900cms.trc"),
        markers_of(real_data / SPRINT / "JA1Gait35.c3d"),
    )
    assert same_motion(trc, c3d)
    assert same_motion(c3d, trc)


def test_labels_clock_place_and_rate_may_differ(real_data):
    walk = markers_of(real_data / "walk_treadmill_stepwidth/example1/markers.trc")
    quarter_turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    other = Markers(
        names=tuple(f"T{k}" for k in range(len(walk.names)))[::-1],
        positions_ground=walk.positions_ground[40:-20:2, ::-1] @ quarter_turn + [3.0, 0.02, 1.0],
        rate=walk.rate / 2,
        start_time=100.0,
    )
    assert same_motion(walk, other)


@pytest.mark.parametrize(("one", "other"), TWO_TRIALS)
def test_like_trials_are_not_one(real_data, one, other):
    assert not same_motion(markers_of(real_data / one), markers_of(real_data / other))


def test_recordings_too_short_or_without_markers_are_never_the_same(real_data):
    walk = markers_of(real_data / TWO_TRIALS[0][0])
    assert not same_motion(walk, replace(walk, positions_ground=walk.positions_ground[:5]))
    assert not same_motion(walk, replace(walk, names=(), positions_ground=walk.positions_ground[:, :0]))


@pytest.mark.parametrize("name", STANDING.split())
def test_a_static_trial_by_name(name):
    assert is_static(name)


@pytest.mark.parametrize("name", NO_WORDS.split())
def test_parts_of_words_are_no_words(name):
    assert not is_static(name)


@pytest.fixture
def opened(real_data, tmp_path):
    """A subject of recordings under other names; cut to the first frames where a number is given."""

    def of(files):
        for name, source in files.items():
            if isinstance(source, str):
                shutil.copyfile(real_data / source, tmp_path / name)
            else:
                markers = read_trc(real_data / source[0]).markers
                cut = markers.positions_ground[: source[1]]
                write_trc(tmp_path / name, Markers(markers.names, cut, markers.rate, markers.start_time))
        subject = open_subject(tmp_path)
        return subject, {trial.name for trial in subject.trials}

    return of


@pytest.mark.parametrize("name", ["static_walk", "Standing1", "cal", "T-pose"])
def test_a_static_trial_by_its_name_in_which_somebody_walks_is_a_trial(opened, name):
    subject, trials = opened({f"{name}.trc": WALK, "jump.trc": JUMP})
    assert subject.static is None
    assert trials == {name, "jump"}
    assert any("somebody moves in it" in note for note in subject.notes)


def test_where_no_name_tells_it_the_one_recording_in_which_nobody_moves_is_it(opened, tmp_path):
    subject, trials = opened({"P1_03.trc": WALK, "P1_01.trc": STATIC, "P1_02.trc": JUMP})
    assert subject.static == tmp_path / "P1_01.trc"
    assert trials == {"P1_02", "P1_03"}
    assert any("nobody moves in it" in note for note in subject.notes)


def test_of_two_recordings_without_a_name_in_which_nobody_moves_neither_is(opened):
    subject, trials = opened({"a.trc": STATIC, "b.trc": STATIC, "walk.trc": WALK})
    assert subject.static is None
    assert trials == {"a", "b", "walk"}


@pytest.mark.parametrize("frames", [1, 19])
def test_a_whole_static_trial_comes_before_one_of_a_few_frames(opened, tmp_path, frames):
    subject, trials = opened({"static1.trc": (STATIC, frames), "static2.trc": STATIC, "walk.trc": WALK})
    assert subject.static == tmp_path / "static2.trc"
    assert trials == {"walk"}
    assert any("static1.trc: another static trial" in note for note in subject.notes)


def test_a_static_trial_that_cannot_be_read_comes_last(opened, real_data, tmp_path):
    (tmp_path / "static1.trc").write_bytes((real_data / STATIC).read_bytes()[:3000])
    subject, _ = opened({"static2.trc": STATIC, "walk.trc": WALK})
    assert subject.static == tmp_path / "static2.trc"
