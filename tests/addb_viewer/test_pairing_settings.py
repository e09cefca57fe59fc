"""Which force files are taken obeys the subject's settings.toml wherever the subject is opened."""

import shutil

import pytest

from addb_viewer.jobs.reviewing import subject_in
from addb_viewer.jobs.root_folder import open_root
from addb_viewer.jobs.solving import job_for
from solver.capture.trial import read_trial
from solver.fitting.settings import FILE_NAME, settings_for

pytestmark = pytest.mark.real
STRICT = "[force_files]\ntaken = 50.0\n"
OPENED = {
    "fit": lambda folder: job_for(folder).subject,
    "review": subject_in,
    "app": lambda folder: open_root(folder).subject("."),
}


@pytest.fixture
def folder(real_data, tmp_path):
    """A walk under a laboratory's names, which tell together with the contents alone."""
    walk = real_data / "overground_falisse_AdDB"
    shutil.copy(walk / "Gait_7_markers.trc", tmp_path / "motion_capture_run.trc")
    shutil.copy(walk / "Gait_7_grf.mot", tmp_path / "grf_run.mot")
    return tmp_path


@pytest.mark.parametrize("opened", OPENED.values(), ids=OPENED)
def test_a_pair_is_taken_as_clearly_as_settings_toml_asks(folder, opened):
    (trial,) = opened(folder).trials
    assert trial.forces == folder / "grf_run.mot"
    (folder / FILE_NAME).write_text(STRICT)
    subject = opened(folder)
    assert subject.trials[0].forces is None
    assert [unused.file for unused in subject.unused] == ["grf_run.mot"]


def test_the_app_opens_a_subject_whose_settings_cannot_be_used(folder):
    (folder / FILE_NAME).write_text("[force_files]\ntaken = 'nonsense'\n")
    (trial,) = open_root(folder).subject(".").trials
    assert trial.forces == folder / "grf_run.mot"


def test_when_loads_are_said_to_lie_elsewhere_is_a_setting(folder):
    (folder / FILE_NAME).write_text("[under_feet]\ncontradiction = 1000.0\n")
    (trial,) = subject_in(folder).trials
    usual, warned = (
        read_trial(trial, settings.reading).notes
        for settings in (settings_for(folder.parent), settings_for(folder))
    )
    assert not any("NOT lie under the feet" in note for note in usual)
    assert any("NOT lie under the feet" in note for note in warned)
