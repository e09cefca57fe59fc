"""Provenance tells two inputs apart exactly when a fit of them could differ."""

import hashlib
from dataclasses import replace

import pytest

from solver.capture.capture import Subject, TrialFiles
from solver.fitting.provenance import differences, other_recordings, provenance_of, without_reviews
from tests.flagged import flagged


@pytest.fixture
def subject(tmp_path):
    trials = []
    for name in ("walk", "run"):
        (tmp_path / f"{name}.trc").write_text(f"markers of {name}")
        (tmp_path / f"{name}.mot").write_text(f"forces of {name}")
        trials.append(TrialFiles(name, tmp_path / f"{name}.trc", tmp_path / f"{name}.mot"))
    (tmp_path / "model.osim").write_text("model")
    return Subject(tmp_path, tuple(trials), mass_kg=70.0, model=tmp_path / "model.osim")


def test_every_input_is_hashed(subject):
    record = provenance_of(subject, subject.trials)
    hashes = {
        name.removeprefix("sha256 "): value for name, value in record.items() if name.startswith("sha256")
    }
    assert hashes == {
        "model.osim": hashlib.sha256(b"model").hexdigest(),
        "walk.trc": hashlib.sha256(b"markers of walk").hexdigest(),
        "walk.mot": hashlib.sha256(b"forces of walk").hexdigest(),
        "run.trc": hashlib.sha256(b"markers of run").hexdigest(),
        "run.mot": hashlib.sha256(b"forces of run").hexdigest(),
    }
    assert {"python", "numpy", "pin", "addb-viewer"} <= set(record)


@pytest.mark.parametrize("name", ["model.osim", "walk.trc", "walk.mot"])
def test_a_changed_file_changes_it(subject, name):
    before = provenance_of(subject, subject.trials)
    (subject.folder / name).write_text("edited")
    assert provenance_of(subject, subject.trials) != before


def test_a_file_of_another_trial_does_not(subject):
    before = provenance_of(subject, subject.trials[:1])
    (subject.folder / "run.trc").write_text("edited")
    assert provenance_of(subject, subject.trials[:1]) == before


def test_the_description_counts(subject):
    record = provenance_of(subject, subject.trials)
    assert provenance_of(replace(subject, mass_kg=71.0), subject.trials) != record
    assert provenance_of(replace(subject, foot_bodies=("foot_r",)), subject.trials) != record


def test_which_files_are_a_trial_or_the_static_one_counts(subject):
    walk, run = subject.trials
    exchanged = (replace(walk, forces=run.forces), replace(run, forces=walk.forces))
    known = provenance_of(subject, subject.trials)
    renamed = provenance_of(subject, (replace(walk, name="stroll"), run))
    other_forces = provenance_of(subject, exchanged)
    standing = provenance_of(replace(subject, static=run.markers), subject.trials)
    records = [known, renamed, other_forces, standing]
    assert all(one != other for k, one in enumerate(records) for other in records[:k])
    assert other_recordings(known, other_forces) == ["files of walk", "files of run"]
    assert other_recordings(known, standing) == ["static"]


def test_a_moved_folder_is_the_same_subject(subject, tmp_path):
    before = provenance_of(subject, subject.trials[:1])
    moved = tmp_path / "moved"
    moved.mkdir()
    for path in tmp_path.glob("*.*"):
        path.rename(moved / path.name)
    walk = TrialFiles("walk", moved / "walk.trc", moved / "walk.mot")
    assert provenance_of(replace(subject, folder=moved, model=moved / "model.osim"), [walk]) == before


def test_a_review_of_a_fitted_trial_counts_down_to_foot_reason_and_frame(subject):
    walk = subject.trials[:1]
    reviews = [
        None,
        {"walk": flagged()},
        {"walk": flagged((5, 9, None, "manualReview"))},
        {"walk": flagged((5, 9, "calcn_r", "manualReview"))},
        {"walk": flagged((5, 9, "calcn_r", "missingBlip"))},
        {"walk": flagged((5, 10, "calcn_r", "missingBlip"))},
    ]
    records = [provenance_of(subject, walk, review) for review in reviews]
    assert all(one != other for k, one in enumerate(records) for other in records[:k])
    assert provenance_of(subject, walk, {"walk": flagged((5, 9, None, "manualReview"))}) == records[2]
    assert provenance_of(subject, walk, {"run": flagged((5, 9, None, "manualReview"))}) == records[0]


def test_without_its_reviews_it_is_that_of_unreviewed_files(subject):
    reviewed = provenance_of(subject, subject.trials, {"walk": flagged((5, 9, None, "manualReview"))})
    assert without_reviews(reviewed) == provenance_of(subject, subject.trials)


def test_whatever_differs_but_reviews_is_told(subject):
    """A key that is new or gone as well: a map of markers, an accepted cause."""
    record = provenance_of(subject, subject.trials, {"walk": flagged((0, 3, None, "manualReview"))})
    for name in record:
        told = differences(record, {k: v for k, v in record.items() if k != name})
        back = differences({k: v for k, v in record.items() if k != name}, record)
        edited = differences(record, record | {name: "another"})
        is_review = "review of" in name
        assert [bool(told), bool(back), bool(edited)] == [not is_review] * 3, name
    (subject.folder / "markers.toml").write_text("[markers]")
    mapped = replace(subject, marker_map=subject.folder / "markers.toml")
    assert differences(record, provenance_of(mapped, subject.trials)) == ["markers.toml"]
    assert differences(record, record | {"sha256 of the accepted extension": "1"}) == ["the accepted causes"]
