"""A trial that the fit fails on costs no other: it is left out, with the reason; the rest is as without."""

import shutil

import numpy as np
import pytest

from addb_viewer import Subject
from solver.capture.subject import opened_subject as subjects
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import FitError
from solver.common.notes import Kind, noted
from solver.diagnosis import diagnose_subject as diagnosis
from solver.fitting import model_stage, torques_stage, tracking_stage
from solver.fitting.failing_trials import together, without_failing
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings, settings_from

MARKERS_ALONE = settings_from({"trajectory": {"enabled": False}}, "settings")
FRAMES = 40


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The beginning of the demo's walk, and the same again under another name."""
    folder = tmp_path_factory.mktemp("demo") / "subject"
    Subject.demo(folder, trials=("walk",))
    for name in ("markers.trc", "grf.mot"):
        file = folder / "trials/walk" / name
        lines = file.read_text().splitlines(keepends=True)
        ends = 6 + FRAMES if name == "markers.trc" else 12 + 10 * FRAMES
        file.write_text("".join(lines[:ends]))
    shutil.copytree(folder / "trials/walk", folder / "trials/again")
    return folder


@pytest.fixture
def subject(recorded, tmp_path):
    return open_subject(shutil.copytree(recorded, tmp_path / "subject"))


def breaks_on(name, what, argument, error):
    """The function, but for what is about the trial of that name."""

    def instead(*given, **named):
        if argument((*given, *named.values())) == name:
            raise error
        return what(*given, **named)

    return instead


@pytest.fixture(scope="module")
def alone(recorded):
    """What the walk's motion is without the other."""
    return solve(open_subject(recorded), MARKERS_ALONE, trials=["walk"]).trials[0].motion.q


def is_left_out(fit, alone, reason):
    assert [trial.capture.name for trial in fit.trials] == ["walk"]
    (left,) = fit.unread
    assert left.name == "again"
    assert reason in left.file.reason
    said = "again: left out, trials/again/markers.trc cannot be used"
    assert any(note.startswith(said) for note in fit.notes)
    np.testing.assert_array_equal(fit.trials[0].motion.q, alone)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stage", "error"),
    [
        ((model_stage, "repair_labels_of"), FitError("no pose")),
        ((tracking_stage, "track_trial"), np.linalg.LinAlgError("Singular matrix")),
        ((tracking_stage, "with_contacts"), IndexError("index 3 is out of bounds")),
    ],
)
def test_one_that_breaks_down_in_a_stage_of_its_own(subject, alone, monkeypatch, stage, error):
    def name_of(given):
        return getattr(given[0], "capture", given[0]).name

    broken = breaks_on("again", getattr(*stage), name_of, error)
    monkeypatch.setattr(*stage, broken)
    is_left_out(solve(subject, MARKERS_ALONE), alone, str(error))


def test_one_that_breaks_down_where_all_are_fitted_together(subject, alone, monkeypatch):
    whole = torques_stage.with_dynamics
    error = np.linalg.LinAlgError("Singular matrix")
    broken = breaks_on("again", whole, lambda given: given[0].capture.name, error)
    monkeypatch.setattr(torques_stage, "with_dynamics", broken)
    fit = solve(subject, MARKERS_ALONE)
    is_left_out(fit, alone, "the fit breaks down on it (LinAlgError: Singular matrix)")


def test_one_whose_reading_breaks_down(subject, alone, monkeypatch):
    broken = breaks_on("again", subjects.read_trial, lambda given: given[0].name, IndexError("3"))
    monkeypatch.setattr(subjects, "read_trial", broken)
    fit = solve(subject, MARKERS_ALONE)
    is_left_out(fit, alone, "reading breaks down (IndexError: 3)")


def test_where_all_fail_the_first_says_why(subject, monkeypatch):
    def fail(capture, *_):
        raise FitError(f"{capture.name} shows nobody")

    monkeypatch.setattr(tracking_stage, "track_trial", fail)
    with pytest.raises(FitError, match="shows nobody"):
        solve(subject, MARKERS_ALONE)


@pytest.mark.parametrize("seen", [2, 0])
def test_markers_too_few_for_a_pose(subject, alone, seen):
    """In the file itself, by what the fit makes of it."""
    markers = subject.trials[0].markers
    assert subject.trials[0].name == "again"
    lines = markers.read_text().splitlines()
    for k, line in enumerate(lines[6:], start=6):
        cells = line.split("\t")
        lines[k] = "\t".join([*cells[: 2 + 3 * seen], *["NaN"] * (len(cells) - 2 - 3 * seen)])
    markers.write_text("\n".join(lines) + "\n")
    fit = solve(subject, MARKERS_ALONE)
    is_left_out(fit, alone, "marker")


def test_a_diagnosis_goes_on_without_one_that_breaks_down(subject, monkeypatch):
    asked = []

    def looked_at(subject, settings, *, trials, reviews, session, progress):
        asked.append(tuple(trials))
        if "again" in trials:
            raise IndexError("index 5 is out of bounds")
        return trials

    looked_at_it = noted(Kind.OTHER, "looked at")
    answer = diagnosis.DiagnosisReport("clean", (), (), {}, None, ("walk",), notes=looked_at_it)
    monkeypatch.setattr(diagnosis, "look_at", looked_at)
    monkeypatch.setattr(diagnosis, "diagnosis_from", lambda found, progress: answer)
    told = diagnosis.diagnose(subject, Settings())
    assert asked == [("again", "walk"), ("again",), ("walk",)]
    assert told.notes[0] == "looked at"
    assert told.notes[1].startswith("again: left out, ")
    assert "IndexError: index 5" in told.notes[1]


@pytest.mark.parametrize("names", [["walk"], ["walk", "again"]])
def test_numbers_that_leave_nothing_to_solve_are_told_in_a_sentence(subject, names):
    def solve_some(files, failed=()):
        return together(files, lambda trial: trial.name, lambda _: np.linalg.cholesky(np.zeros((2, 2))))

    with pytest.raises(FitError, match="walk: its markers or forces leave nothing to solve"):
        without_failing(subject, names, solve_some)
