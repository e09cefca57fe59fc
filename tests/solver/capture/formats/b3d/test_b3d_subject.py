"""A .b3d file as a subject: the person, the review, the model, and where its decisions lie."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import ImportedReason, Subject
from solver.capture.formats.b3d.b3d_fields import B3dFile
from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.capture.formats.b3d.places import recording_of, results_folder_of, subject_folder_of
from solver.capture.subject.opened_subject import open_subject, subjects_in
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError


def save(subject, path, about=(), **of_header):
    """The small subject with other headers; `about` changes those of its trials."""
    trials = tuple(replace(trial, header=replace(trial.header, **dict(about))) for trial in subject.trials)
    header = replace(subject.header, trial_header=tuple(t.header for t in trials), **of_header)
    write_b3d(B3dFile(header, trials), path)
    return path


def quiet(subject):
    """Reasons that say nothing."""
    return tuple(
        replace(t, header=replace(t.header, missing_GRF_reason=np.zeros(t.header.trial_length, np.int32)))
        for t in subject.trials
    )


def test_the_person(subject, tmp_path):
    found = open_subject(save(subject, tmp_path / "who.b3d", mass_kg=0.0, age_years=31))
    assert (found.name, found.height_m, found.sex, found.age_years) == ("who", 1.65, "female", 31)
    assert found.mass_kg is None
    assert found.foot_bodies == ("calcn_r",)
    assert found.tags == ("healthy",)
    assert [trial.name for trial in found.trials] == ["trial 0", "trial 1"]


def test_numbers_that_are_none_count_as_unknown(subject, tmp_path):
    found = open_subject(save(subject, tmp_path / "who.b3d", mass_kg=-3.0, height_m=170.0))
    assert (found.mass_kg, found.height_m) == (None, None)
    assert any("height 170 m is not possible" in note for note in found.notes)


def test_decisions_and_results_lie_beside_it(subject, tmp_path):
    path = save(subject, tmp_path / "who.b3d")
    folder = subject_folder_of(path)
    assert (folder, results_folder_of(folder)) == (tmp_path / "who.b3d.subject", tmp_path / "who.b3d.results")
    assert recording_of(folder) == path
    assert open_subject(folder) == open_subject(path)
    assert not folder.exists()
    folder.mkdir()
    (folder / "subject.toml").write_text('mass_kg = 71.5\nmodel_is = "default"\n')
    found = open_subject(path)
    assert (found.mass_kg, found.height_m, found.model) == (71.5, 1.65, None)


def test_trials_are_those_of_the_file(subject, tmp_path):
    path = save(subject, tmp_path / "who.b3d")
    subject_folder_of(path).mkdir()
    (subject_folder_of(path) / "a.trc").write_text("")
    (subject_folder_of(path) / "subject.toml").write_text('[trials.a]\nmarkers = "a.trc"\n')
    with pytest.raises(CaptureError, match=r"who\.b3d\.subject/subject\.toml: names trials"):
        open_subject(path)


def test_reasons_are_a_review_with_words(subject, tmp_path):
    """Number 10 is a person's; what has no number among the format's is a person's, too."""
    path = save(subject, tmp_path / "who.b3d")
    first, second = open_subject(path).trials
    assert (first.inner_review_finished, second.inner_review_finished) == (True, True)
    capture = read_trial(second)
    assert capture.imported_missing_force.tolist() == [False, True, True, False, True]
    assert capture.imported_reasons == (
        ImportedReason(1, 2, "manualReview"),
        ImportedReason(2, 3, "extendedToNearestPeakForce"),
        ImportedReason(4, 5, "notOverForcePlate"),
    )


def test_zeros_before_anybody_looked_are_no_review(subject, tmp_path):
    path = tmp_path / "who.b3d"
    trials = quiet(subject)
    write_b3d(replace(subject, trials=trials), path)
    assert [trial.inner_review_finished for trial in open_subject(path).trials] == [None, None]
    assert read_trial(open_subject(path).trials[0]).imported_missing_force is None
    marked = tuple(
        replace(t, header=replace(t.header, has_manual_GRF_annotation=np.ones(t.header.trial_length, bool)))
        for t in trials
    )
    write_b3d(replace(subject, trials=marked), path)
    assert [trial.inner_review_finished for trial in open_subject(path).trials] == [True, True]
    assert read_trial(open_subject(path).trials[0]).imported_missing_force.tolist() == [False] * 3


def test_a_folder_of_them(subject, tmp_path):
    (tmp_path / "cohort").mkdir()
    for name in ("a", "b"):
        save(subject, tmp_path / "cohort" / f"{name}.b3d")
    (tmp_path / "cohort" / "broken.b3d").write_bytes(b"no such thing")
    subject_folder_of(tmp_path / "cohort" / "a.b3d").mkdir()
    (tmp_path / "cohort" / "a.b3d.results").mkdir()
    for place in (tmp_path / "cohort", tmp_path):
        found, notes = subjects_in(place)
        assert [one.name for one in found] == ["a", "b"]
        assert len(notes) == 1
        assert "broken.b3d is left out" in notes[0]


def test_a_damaged_file_names_itself(subject, tmp_path):
    path = save(subject, tmp_path / "who.b3d")
    path.write_bytes(path.read_bytes()[:-7])
    with pytest.raises(CaptureError, match=r"who\.b3d: is cut off"):
        open_subject(path)


def test_the_reading_of_a_file_leaves_it_as_it_was(subject, tmp_path):
    path = save(subject, tmp_path / "who.b3d")
    before = path.read_bytes()
    for files in open_subject(path).trials:
        read_trial(files)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["who.b3d"]
    assert len(read_b3d(path).trials) == 2


@pytest.mark.parametrize(("file", "name"), [("results.b3d", "S04"), ("Results.b3d", "S04"), ("P7.b3d", "P7")])
def test_a_file_whose_name_tells_nobody_is_called_by_its_folder(tmp_path, file, name):
    recording = tmp_path / "S04" / file
    assert Subject(tmp_path / "S04" / f"{file}.subject", (), recording=recording).name == name
