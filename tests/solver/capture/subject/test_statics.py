"""A static trial is told by whole words of several languages, and by nobody moving; never by a name alone."""

import shutil

import pytest

from solver.capture.capture import Markers
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.subject.statics import is_static
from solver.capture.subject.subject import open_subject

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
