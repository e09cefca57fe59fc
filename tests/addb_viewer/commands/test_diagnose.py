"""`addb-viewer diagnose`: what it prints, writes and refuses, with a finder made by hand behind it."""

import json
import os
from dataclasses import dataclass, field, replace

import jsonschema
import numpy as np
import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.commands.diagnose import key_findings
from addb_viewer.jobs.diagnosing import kept_of
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.solving import job_for
from solver.common.errors import FitError, ResultsError
from solver.common.notes import Kind, Note, noted
from solver.common.typed_json import schema_of
from solver.diagnosis.cause_decisions import CauseDecisions
from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.checks import Decision
from solver.diagnosis.diagnosis import Gain, Location, Remaining
from solver.diagnosis.diagnosis_report import DiagnosisReport, Rival, cause_of, told_decisions
from solver.fitting.settings import Settings
from solver.simulate.demo_subject import write_demo_subject
from tests.flagged import flagged

OFFSET = {"offset_s": Estimate(0.0123, 0.0004)}
LATE = replace(
    cause_of(ABOUT["clock_offset"], "all", OFFSET, 0.98, [Range("walk", 0, 4)]),
    sentence="The forces run on another clock.",
    remedy="Check the trigger line.",
)
EXPLAINED = DiagnosisReport(
    verdict="explained",
    effects=(LATE,),
    alternatives=(
        Rival("sample_rate", "all", "clock_offset all", "indistinguishable here", "a longer recording"),
    ),
    gain={
        "held_out_linear_residual_N": Gain(41.0, 12.2, (11.0, 13.9)),
        "held_out_angular_residual_Nm": Gain(19.5, 8.1, (7.2, 9.0)),
        "marker_rms_m": Gain(0.0121, 0.0120),
    },
    remaining=Remaining(12.2, 9.8),
    trials=("walk",),
)
CLEAN = DiagnosisReport("clean", (), (), {}, Remaining(9.0, 9.8), ("walk",))
UNEXPLAINED = DiagnosisReport(
    "unexplained",
    (),
    (),
    {},
    Remaining(60.0, 9.8, Location("hand_r", 55.0, (3.0, 40.0, -2.0), "constant (80 % of it)")),
    ("walk", "run"),
    notes=(Note(Kind.OTHER, "half of the markers are missing", trial="run"),),
)


@dataclass
class Finder:
    """In the real one's place: `found` is what it answers or raises, `calls` what it was asked."""

    found: DiagnosisReport | BaseException = EXPLAINED
    calls: list[tuple[object, ...]] = field(default_factory=list)

    def __call__(self, subject, settings, *, trials, reviews, progress):
        self.calls.append((subject, settings, trials, reviews))
        progress("diagnosis", 0.5)
        if isinstance(self.found, BaseException):
            raise self.found
        return self.found


@pytest.fixture
def finder(command_line, monkeypatch):
    """Answers `EXPLAINED` unless told otherwise."""
    finder = Finder()
    monkeypatch.setattr("addb_viewer.jobs.diagnosing.diagnosis_of", finder)
    return finder


@pytest.mark.parametrize("found", [EXPLAINED, CLEAN, UNEXPLAINED], ids=lambda d: d.verdict)
def test_every_verdict_is_status_0_and_is_kept(command_line, finder, found):
    finder.found = found
    folder = command_line.subject.folder
    run = command_line("diagnose", folder)
    assert run.exit_code == 0
    assert run.stderr == ""
    answer = kept(folder / "results")
    assert answer is not None
    figures, made_from = answer
    assert figures.verdict == found.verdict
    assert set(made_from) == {"provenance", "settings", "counts"}
    assert any(name.startswith("sha256") for name in made_from["provenance"])


def test_the_json_is_the_contract(command_line, finder, tmp_path):
    target = tmp_path / "answer.json"
    assert command_line("diagnose", command_line.subject.folder, "--json", target).exit_code == 0
    figures = json.loads(target.read_text(encoding="utf-8"))
    assert {"verdict", "effects", "alternatives", "gain", "remaining"} <= set(figures)
    assert "made_from" not in figures
    jsonschema.validate(figures, schema_of(DiagnosisReport))


(REFUSED,) = told_decisions(
    [
        CauseDecisions(
            "drag",
            "torso",
            False,
            6.5,
            (
                Decision("pays", True, 6.5, 5.0, "it gains 6.5 nats over its odds"),
                Decision("holds up", False, -3.0, 0.0, "on held-out blocks it gains -3.0 nats"),
            ),
        )
    ]
)


def test_it_says_at_which_check_a_cause_fell(command_line, finder, tmp_path):
    finder.found = replace(EXPLAINED, decisions=(REFUSED,))
    target = tmp_path / "answer.json"
    run = command_line("diagnose", command_line.subject.folder, "--why", "drag", "--json", target)
    page = " ".join(run.stdout.split())
    assert "fell at 'holds up'" in page
    assert "pays it gains 6.5 nats over its odds" in page
    assert "holds up, no on held-out blocks it gains -3.0 nats" in page
    (one,) = json.loads(target.read_text(encoding="utf-8"))["decisions"]
    assert (one["id"], one["target"], one["named"]) == ("drag", "torso", False)
    assert one["checks"][1] == {
        "name": "holds up",
        "passed": False,
        "nats": -3.0,
        "limit": 0.0,
        "reason": "on held-out blocks it gains -3.0 nats",
    }


def test_of_the_refused_the_five_best_are_told_and_whatever_somebody_asks_for(command_line, finder, tmp_path):
    many = tuple(replace(REFUSED, target=f"body_{k}", odds_nats=6.0 - k) for k in range(8))
    last = replace(REFUSED, id="plate_gain", target="plate_1", odds_nats=-20.0)
    finder.found = replace(EXPLAINED, decisions=(*many, last))
    target = tmp_path / "answer.json"
    command_line("diagnose", command_line.subject.folder, "--json", target)
    told = json.loads(target.read_text(encoding="utf-8"))["decisions"]
    assert [one["target"] for one in told] == [f"body_{k}" for k in range(5)]
    command_line("diagnose", command_line.subject.folder, "--why", "plate_gain", "--json", target)
    told = json.loads(target.read_text(encoding="utf-8"))["decisions"]
    assert [one["target"] for one in told] == [*(f"body_{k}" for k in range(5)), "plate_1"]


def test_a_cause_that_was_never_tried_and_one_that_there_is_not(command_line, finder):
    folder = command_line.subject.folder
    assert "never proposed" in command_line("diagnose", folder, "--why", "drag").stdout
    run = command_line("diagnose", folder, "--why", "drug")
    assert run.exit_code == 2
    assert "no cause has the id 'drug'" in " ".join(run.stderr.replace("│", " ").split())


def test_trials_settings_and_notes_are_handed_over(command_line, finder, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[kinematics]\niterations = 3\n")
    finder.found = UNEXPLAINED
    folder = command_line.subject.folder
    run = command_line("diagnose", folder, "--trial", "walk", "--settings", file, "--ignore-review", "--full")
    _, settings, trials, reviews = finder.calls[0]
    assert trials == ("walk",)
    assert settings.kinematics.iterations == 3
    assert settings != Settings()
    assert reviews == {}
    assert "half of the markers are missing" in run.stdout
    assert "reviews are ignored" in run.stdout


def test_what_is_printed_fits_a_screen_however_many_causes_there_are(command_line, finder):
    ranges = tuple(("walk (final)", k, k + 1) for k in range(4))
    steps = [replace(LATE, id="off_plate_step", target=f"calcn_{k}", frames=ranges) for k in range(9)]
    finder.found = replace(EXPLAINED, effects=tuple(steps), rates_Hz={"walk (final)": 50.0})
    folder = command_line.subject.folder
    run = command_line("diagnose", folder)
    lines = run.stdout.splitlines()
    assert len(lines) <= 60
    headings = [line.split(":")[0] for line in lines if line and not line.startswith(" ")]
    assert headings[:2] == ["VERDICT", "CAUSE 1 OF 9"]
    assert "5 MORE CAUSES" in headings
    assert "HOW TO READ THIS" not in headings
    said = " ".join(run.stdout.split())
    assert (
        "addb-viewer flag SUBJECT 'walk (final)' 0:1 --foot calcn_0 --reason notOverForcePlate. … and 3 more"
        in said
    )
    assert lines[-1].endswith("--full says more")
    full = command_line("diagnose", folder, "--full").stdout
    assert full.count("CAUSE ") == 9
    assert "HOW TO READ THIS" in full


def test_a_note_is_told_once(command_line, finder, tmp_path):
    ignored = "reviews are ignored: detection alone says which forces count"
    finder.found = replace(CLEAN, notes=noted(Kind.OTHER, ignored))
    target = tmp_path / "answer.json"
    command_line("diagnose", command_line.subject.folder, "--ignore-review", "--json", target)
    notes = [note["text"] for note in json.loads(target.read_text(encoding="utf-8"))["notes"]]
    assert len(notes) == len(set(notes))
    assert len([n for n in notes if "reviews are ignored" in n]) == 1


def test_people_s_flags_reach_the_finder(command_line, finder, monkeypatch):
    flags = {"walk": flagged((1, 3, "calcn_r", "notOverForcePlate"))}
    monkeypatch.setattr("addb_viewer.jobs.solving.reviews_for_solve", lambda *_: (flags, ()))
    command_line("diagnose", command_line.subject.folder)
    assert finder.calls[0][3] == flags
    command_line("diagnose", command_line.subject.folder, "--ignore-review")
    assert finder.calls[1][3] == {}


@pytest.mark.parametrize(
    ("failure", "status", "line"),
    [
        (FitError("lab/S4: no trial has forces; without them nothing can be diagnosed."), 1, "no trial has"),
        (KeyboardInterrupt(), 130, "stopped; nothing was written"),
        (TypeError("odd"), 1, "unexpected TypeError: odd (run with --debug for the traceback)"),
    ],
)
def test_a_failure_is_one_line_and_writes_nothing(command_line, finder, failure, status, line):
    finder.found = failure
    before = sorted(command_line.subject.folder.rglob("*"))
    answer = command_line.subject.folder / "answer.json"
    run = command_line("diagnose", command_line.subject.folder, "--json", answer)
    assert run.exit_code == status
    assert run.stderr.count("\n") == 1
    assert line in run.stderr
    assert run.stdout == ""
    assert sorted(command_line.subject.folder.rglob("*")) == before
    assert not answer.exists()


def test_what_can_be_refused_is_refused_before_the_search(command_line, finder, tmp_path, monkeypatch):
    folder = command_line.subject.folder
    for arguments, status, said in (
        ((tmp_path / "nobody",), 1, "nobody: no such folder"),
        ((folder, "--trial", "walk1"), 1, "no trial 'walk1'; nearest: walk"),
        ((folder, "--json", tmp_path / "missing" / "answer.json"), 2, "no folder"),
        ((folder, "--frames", "3"), 2, "No such option"),
    ):
        run = command_line("diagnose", *arguments)
        assert run.exit_code == status
        assert said in " ".join(run.stderr.replace("│", " ").split())
    monkeypatch.setattr("os.access", lambda _, mode: not mode & os.W_OK)  # root may write anywhere
    run = command_line("diagnose", folder)
    assert run.exit_code == 1
    assert "cannot be written to" in run.stderr
    assert finder.calls == []


def test_a_broken_kept_diagnosis_is_named_with_its_remedy(tmp_path):
    assert kept(tmp_path) is None
    for content in ("{", "[]", "{}"):
        (tmp_path / "diagnosis.json").write_text(content)
        with pytest.raises(ResultsError, match=r"diagnosis\.json: not a diagnosis .*addb-viewer diagnose"):
            kept(tmp_path)


def test_a_recording_without_forces_is_refused_with_one_line(tmp_path):
    """No finder by hand here: what a person meets who forgot the force file."""
    write_demo_subject(tmp_path / "S1", np.random.default_rng(1), trials=("static", "squat"))
    (tmp_path / "S1" / "trials" / "squat" / "grf.mot").unlink()
    run = CliRunner().invoke(app, ["diagnose", str(tmp_path / "S1")])
    assert run.exit_code == 1
    assert run.stderr.count("\n") == 1
    assert "no trial has forces" in run.stderr
    assert not (tmp_path / "S1" / "results" / "diagnosis.json").exists()


def test_of_many_a_kept_diagnosis_holds_until_something_changes(command_line, finder):
    finder.found = EXPLAINED
    folder = command_line.subject.folder
    command_line("diagnose", folder, "--trial", "walk")
    job = job_for(folder, trials=["walk"], without_extension=True)
    figures = kept_of(job)
    assert figures is not None
    assert key_findings(figures.as_json())["verdict"] == "explained"
    assert kept_of(replace(job, settings=settings_with_other_iterations())) is None
    command_line.subject.trials[0].markers.write_text("recorded anew")
    assert kept_of(job_for(folder, trials=["walk"], without_extension=True)) is None


def settings_with_other_iterations():
    kinematics = Settings().kinematics
    return replace(Settings(), kinematics=replace(kinematics, iterations=kinematics.iterations + 1))
