"""What a subject hands to the solver, and what it keeps; the solve itself is put aside."""

from dataclasses import replace

import pytest

from addb_viewer import Cancelled, ReviewError, SolverError, Subject
from solver.diagnosis.diagnosis import Remaining
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, Figure
from solver.fitting.provenance import provenance_of
from solver.fitting.settings import as_dict

CLOCK = Cause(
    id="clock_offset",
    target="all",
    parameters={"offset_s": Figure(0.012, 0.001), "odd": Figure(0.0, None)},
    confidence=0.97,
    frames=(("walk", 0, 101),),
    sentence="The forces were recorded late.",
    remedy="Check the trigger line.",
)


@pytest.fixture
def solves(monkeypatch, small_fit):
    """What reached the solver, which answers with a fit made by hand."""
    asked = []

    def masked(mask, reviews):
        return mask and replace(mask, counts=mask.counts & (not reviews))

    def solve(subject, settings, *, trials, reviews, progress, extension=None, **_):
        asked.append({"trials": trials, "reviews": dict(reviews), "settings": settings})
        progress("scaling", 0.1)
        progress("trajectories", 0.9)
        chosen = [t for t in subject.trials if trials is None or t.name in trials]
        return replace(
            small_fit,
            subject=subject,
            trials=tuple(
                replace(fit, capture=replace(fit.capture, name=files.name), mask=masked(fit.mask, reviews))
                for fit, files in zip(small_fit.trials, chosen, strict=False)
            ),
            settings=as_dict(settings),
            provenance=provenance_of(subject, chosen, reviews, extension),
        )

    monkeypatch.setattr("addb_viewer.jobs.solving.solve", solve)
    return asked


@pytest.fixture
def diagnoses(monkeypatch):
    asked = []

    def diagnose(subject, settings, *, trials, reviews, progress):
        asked.append(dict(reviews))
        return DiagnosisReport(
            "explained", (CLOCK,), (), {}, Remaining(9.0, 9.8), ("walk",), rates_Hz={"walk": 100.0}
        )

    monkeypatch.setattr("addb_viewer.jobs.diagnosing.diagnosis_of", diagnose)
    return asked


@pytest.fixture
def subject(walk):
    return Subject.from_recordings({"walk": walk}, mass_kg=71.5)


def test_a_fit_is_kept_until_something_changes(subject, solves):
    assert subject.last_fit() is None
    assert subject.fit().new
    assert not subject.fit().new
    assert len(solves) == 1
    assert subject.fit(again=True).new
    assert subject.last_fit().mass_kg == 100.0
    assert (subject.results / "fit.json").is_file()


def test_a_flag_reaches_the_next_fit_and_its_undo_the_one_after(subject, solves):
    subject.fit()
    number = subject.flag("walk", 40, 60, foot="right", reason="not over a plate", note="seen", author="Anna")
    (row,) = subject.flags
    assert row == {
        "trial": "walk",
        "start": 40,
        "end": 60,
        "foot": "calcn_r",
        "reason": "notOverForcePlate",
        "source": "person",
        "author": "Anna",
        "edit": number,
        "note": "seen",
    }
    subject.fit()
    (label,) = solves[-1]["reviews"]["walk"].by_people
    assert (label.start, label.end, label.foot, label.reason) == (40, 60, "calcn_r", "notOverForcePlate")
    subject.clear("walk", 50, 55, author="Anna")
    assert [(row["start"], row["end"]) for row in subject.flags] == [(40, 50), (55, 60)]
    subject.undo("walk", author="Anna")
    subject.undo("walk", author="Anna")
    assert len(subject.flags) == 0
    subject.fit()
    assert solves[-1]["reviews"] == {}


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("walk", 40, 500), "40:500 is not within the trial, 0:101"),
        (("walk", 60, 40), "not within"),
        (("walk", -1, 40), "not within"),
        (("wlk", 0, 1), "no trial 'wlk'; nearest: walk"),
    ],
)
def test_a_flag_elsewhere_is_refused(subject, words, says):
    with pytest.raises((SolverError, ReviewError), match=says):
        subject.flag(*words)
    assert len(subject.flags) == 0


def test_a_foot_or_reason_that_nobody_knows_is_refused(subject):
    with pytest.raises(ReviewError, match="'middle' is not clear"):
        subject.flag("walk", 0, 9, foot="middle")
    with pytest.raises(ReviewError):
        subject.flag("walk", 0, 9, reason="bad luck")
    with pytest.raises(ReviewError, match="nobody has flagged anything"):
        subject.undo("walk")


def test_reviews_can_be_ignored(subject, solves):
    subject.flag("walk", 40, 60)
    Subject.open(subject.folder, ignore_reviews=True).fit()
    assert solves[-1]["reviews"] == {}


def test_progress_is_told_and_can_stop_the_work(subject, solves):
    told = []
    subject.fit(progress=lambda stage, fraction: told.append((stage, fraction)))
    assert told == [("scaling", 0.1), ("trajectories", 0.9)]

    def stop(stage, fraction):
        raise Cancelled("enough")

    before = subject.last_fit().solved.provenance
    subject.flag("walk", 40, 60)
    with pytest.raises(Cancelled):
        subject.fit(progress=stop)
    assert subject.last_fit().solved.provenance == before


def test_settings_come_as_tables_or_as_a_file(subject, solves, tmp_path):
    Subject.open(subject.folder, settings={"detection": {"confidence": 0.8}}).fit()
    assert solves[-1]["settings"].detection.confidence == 0.8
    file = tmp_path / "own.toml"
    file.write_text("[detection]\nconfidence = 0.7\n")
    Subject.open(subject.folder, settings=file).fit()
    assert solves[-1]["settings"].detection.confidence == 0.7
    with pytest.raises(SolverError, match="settings: unknown setting 'confidense'"):
        Subject.open(subject.folder, settings={"detection": {"confidense": 0.8}})


def test_some_trials_only(walk, solves):
    both = Subject.from_recordings({"one": walk, "two": walk})
    assert both.fit(["two"]).trials == ("two",)
    assert solves[-1]["trials"] == ("two",)
    with pytest.raises(SolverError, match="no trial 'three'"):
        both.fit(["three"])


def test_a_diagnosis_is_kept_until_something_changes(subject, diagnoses):
    first = subject.diagnose()
    assert first.new
    assert not subject.diagnose().new
    assert subject.diagnose(again=True).new
    subject.flag("walk", 40, 60)
    assert subject.diagnose().new
    assert len(diagnoses) == 3
    assert first.file == subject.results / "diagnosis.json"


def test_causes_have_names_sizes_and_frames(subject, diagnoses):
    diagnosis = subject.diagnose()
    assert (diagnosis.verdict, diagnosis.trials) == ("explained", ("walk",))
    (cause,) = diagnosis
    assert cause.key == ("clock_offset", "all")
    assert cause.parameters["offset_s"] == (0.012, 0.001)
    assert cause.confidence == 0.97
    assert cause.frames == (("walk", 0, 101),)
    assert cause.remedy == "Check the trigger line."
    assert "VERDICT" in str(diagnosis)
    assert len(diagnosis.in_full()) > len(str(diagnosis))
    assert "explained" in repr(diagnosis)


def test_only_causes_of_the_last_diagnosis_are_accepted(subject, diagnoses):
    with pytest.raises(SolverError, match="no diagnosis is kept here"):
        subject.accept()
    (cause,) = subject.diagnose()
    with pytest.raises(SolverError, match=r"It names: clock_offset \(all\)"):
        subject.accept([replace(cause, target="plate_1")])


def test_a_rejection_is_kept(subject, diagnoses):
    with pytest.raises(SolverError, match="nothing to reject"):
        subject.reject()
    subject.diagnose()
    subject.reject(author="Anna")
    assert "Anna" in (subject.results / "extension_log.jsonl").read_text(encoding="utf-8")


def test_no_folder_is_no_subject(tmp_path):
    with pytest.raises(SolverError, match="no such folder"):
        Subject.open(tmp_path / "nobody")
