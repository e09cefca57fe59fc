"""One file that cannot be read takes no other trial with it, and is told."""

import shutil
from dataclasses import replace

import pytest

from solver.capture.subject.readable_trials import read_trials
from solver.capture.subject.subject import open_subject
from solver.common.errors import CaptureError
from solver.fitting.fit import Groundwork
from solver.fitting.summary import summary
from solver.kinematics.marker_matching import MarkerMatch

WALK, WALK_FORCES = "opencap_subject4/MarkerData/walking1.trc", "opencap_subject4/ForceData/walking1_grf.mot"
JUMP, STATIC = "opencap_subject4/MarkerData/DJ1.trc", "opencap_subject4/MarkerData/static1.trc"


@pytest.fixture
def broken(real_data, tmp_path):
    """A walk and a jump whose marker file was cut off inside a row by a full disk."""
    shutil.copyfile(real_data / WALK, tmp_path / "walk.trc")
    whole = (real_data / JUMP).read_bytes()
    (tmp_path / "jump.trc").write_bytes(whole[: len(whole) // 2])
    return tmp_path


def test_the_other_trials_are_read_and_the_broken_one_is_told(broken):
    subject = open_subject(broken)
    read = read_trials(subject, subject.trials)
    assert [capture.name for capture in read.captures] == ["walk"]
    (unread,) = read.unread
    assert (unread.name, unread.file.file) == ("jump", "jump.trc")
    assert "cut off" in unread.file.reason
    assert str(broken) not in unread.file.reason
    assert read.notes == (f"jump: left out, jump.trc cannot be used: {unread.file.reason}",)


def test_forces_that_cannot_be_read_are_the_file_that_is_named(broken, real_data):
    whole = (real_data / WALK_FORCES).read_bytes()
    (broken / "walk_grf.mot").write_bytes(whole[: len(whole) // 2])
    shutil.copyfile(real_data / JUMP, broken / "jump.trc")
    subject = open_subject(broken)
    read = read_trials(subject, subject.trials)
    assert [capture.name for capture in read.captures] == ["jump"]
    assert [(trial.name, trial.file.file, trial.file.harm) for trial in read.unread] == [
        ("walk", "walk_grf.mot", 0)
    ]


def test_a_static_trial_that_cannot_be_read_is_left_out_and_told(broken, real_data):
    shutil.copyfile(real_data / JUMP, broken / "jump.trc")
    (broken / "static.trc").write_bytes((real_data / STATIC).read_bytes()[:5000])
    subject = open_subject(broken)
    read = read_trials(subject, subject.trials)
    assert read.static is None
    assert len(read.captures) == 2
    assert "static trial: left out, so the trials alone scale the body; static.trc" in read.notes[0]


def test_with_no_trial_that_can_be_read_it_is_an_error_that_names_the_first(broken):
    (broken / "walk.trc").write_bytes(b"PathFileType\t4\t(X/Y/Z)\twalk.trc\n")
    subject = open_subject(broken)
    with pytest.raises(CaptureError, match=r"jump\.trc: line .*Nor can any of the 1 other trials be read"):
        read_trials(subject, subject.trials)


def test_fit_json_lists_it_first_among_what_is_not_used(broken, small_fit):
    subject = open_subject(broken)
    unread = read_trials(subject, subject.trials).unread
    (broken / "emg.mat").write_text("x")
    groundwork = Groundwork(small_fit.skeleton, MarkerMatch((), (), ()), (), unread=unread)
    again = replace(open_subject(broken), trials=())
    listed = summary(replace(small_fit, subject=again, groundwork=groundwork))["unused"]
    assert [file["file"] for file in listed] == ["jump.trc", "emg.mat"]
