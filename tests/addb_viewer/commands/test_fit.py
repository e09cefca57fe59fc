"""`addb-viewer fit`: what it prints, writes and refuses."""

import json
import os
import re
import shutil
from dataclasses import replace

import jsonschema
import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.text.summary_table import after_table, print_summary
from solver.common.errors import FitError
from solver.common.notes import Kind, Note
from solver.common.typed_json import from_plain, plain, schema_of
from solver.fitting.fit_summary import FitSummary, LayoutFigures, LayoutsFigures, MissedFigures
from solver.fitting.results.store import load_fit
from solver.fitting.summary import summary
from tests.addb_viewer.fit_figures import of_subject, of_trial


def test_fit_keeps_the_results_and_prints_the_summary(command_line):
    folder = command_line.subject.folder
    run = command_line("fit", folder)
    assert run.exit_code == 0
    assert load_fit(folder / "results", folder).mass_kg == 100.0
    assert "100.0 kg (98.5 kg entered), 2.00 m; 1 bodies, 1 degrees of freedom" in run.stdout
    rows = {line.split()[0]: line.split()[1:] for line in run.stdout.splitlines() if line.split()}
    # used frames, marker RMS and max [cm], force [N], [BW], moment [N·m], [BW·h] and the paper's bound
    assert " ".join(rows["walk"]) == "3 of 4 1.50 ✓ 2.1 ✓ 7.5 0.0077 ✓ 0.8 0.0004 ✓ (✓)"
    assert " ".join(rows["no/forces"]) == "0 of 4 1.50 ✓ 2.1 ✓ – – – –"
    (noted,) = [line for line in run.stdout.splitlines() if line.startswith("also noted (--notes): ")]
    assert noted.endswith("axes, units and plates")
    assert "walk: plate 1 was not tared" not in run.stdout
    assert run.stdout.splitlines()[-2].startswith("no/forces: ! Angles only")
    assert run.stdout.endswith(f"next: addb-viewer open '{folder}'\n")
    assert "note: walk: plate 1 was not tared" in command_line("fit", folder, "--notes").stdout
    assert run.stderr == ""


def test_held_out_forces_of_the_worst_trial_are_told_of_all_layouts(capsys):
    trials = []
    for name, rms in (("walk", 21.3), ("run", 48.2)):
        missed = MissedFigures(rms, 152.2, (12.0, 15.0), None, None)
        layouts = LayoutsFigures(LayoutFigures(6, 13, 147, missed, missed), None)
        trials.append(of_trial(name=name, held_out_layouts=layouts))
    figures = replace(of_subject(), trials=(*trials, of_trial(name="blind")))
    (line,) = [said for said in after_table(figures) if "held-out" in said]
    assert line.startswith("held-out forces (run, worst of 2): predicted to 48.2 N and 48.2 N·m, by ")
    print_summary(figures, notes=True)
    said = capsys.readouterr().out
    for name, rms in (("walk", 21.3), ("run", 48.2)):
        assert f"{name}: held out: 13 blocks in 6 layouts, 147 frames: errors {rms} N" in said
    assert not any("held-out" in said for said in after_table(of_subject(of_trial(name="run"))))


def test_json_is_the_contract(command_line, tmp_path):
    target = tmp_path / "figures.json"
    assert command_line("fit", command_line.subject.folder, "--json", target).exit_code == 0
    figures = json.loads(target.read_text(encoding="utf-8"))
    jsonschema.validate(figures, schema_of(FitSummary))
    assert plain(from_plain(figures, FitSummary)) == figures
    assert [trial["name"] for trial in figures["trials"]] == ["walk", "no/forces"]
    assert figures["trials"][0]["linear_residual"]["rms_N"] == pytest.approx(7.50555, rel=1e-6)
    results = command_line.subject.folder / "results"
    assert figures["files"][0] == str(results / "fit.json")
    assert len(figures["files"]) == sum(path.is_file() for path in results.rglob("*"))


def test_an_unchanged_input_is_not_solved_again(command_line, tmp_path):
    folder = command_line.subject.folder
    first = command_line("fit", folder, "--json", tmp_path / "first.json")
    kept = sorted((folder / "results").rglob("*"))
    second = command_line("fit", folder, "--json", tmp_path / "second.json")
    assert len(command_line.solves) == 1
    assert second.exit_code == 0
    assert re.search(
        r"^unchanged: kept fit of \d{4}-\d\d-\d\d \d\d:\d\d in .*fit\.json; --force", second.stdout, re.M
    )
    assert "written:" in first.stdout
    assert "written:" not in second.stdout
    assert (tmp_path / "second.json").read_text() == (tmp_path / "first.json").read_text()
    assert sorted((folder / "results").rglob("*")) == kept


def test_force_solves_an_unchanged_input_again(command_line):
    folder = command_line.subject.folder
    command_line("fit", folder)
    run = command_line("fit", folder, "--force")
    assert run.exit_code == 0
    assert "unchanged: kept" not in run.stdout
    assert len(command_line.solves) == 2


@pytest.mark.parametrize("change", ["markers", "settings", "trial"])
def test_a_changed_input_is_solved_from_the_beginning(command_line, change):
    folder = command_line.subject.folder
    command_line("fit", folder)
    if change == "markers":
        command_line.subject.trials[0].markers.write_text("others")
    if change == "settings":
        (folder / "settings.toml").write_text("[kinematics]\niterations = 3\n")
    command_line("fit", folder, *(("--trial", "walk") if change == "trial" else ()))
    assert len(command_line.solves) == 2


def test_out_takes_the_results_elsewhere(command_line, tmp_path):
    folder, out = command_line.subject.folder, tmp_path / "deep" / "elsewhere"
    assert command_line("fit", folder, "--out", out).exit_code == 0
    assert load_fit(out, folder).mass_kg == 100.0
    assert not (folder / "results").exists()


def test_trials_can_be_chosen(command_line):
    folder = command_line.subject.folder
    assert command_line("fit", folder, "--trial", "walk").exit_code == 0
    assert command_line.solves == [("walk",)]
    assert len(load_fit(folder / "results", folder).trials) == 1


def test_an_unknown_trial_is_named_with_the_nearest(command_line):
    run = command_line("fit", command_line.subject.folder, "--trial", "walk1")
    assert run.exit_code == 1
    assert run.stderr.count("\n") == 1
    assert "no trial 'walk1'; nearest: walk" in run.stderr
    assert command_line.solves == []


def test_a_slip_in_the_settings_stops_before_the_solve(command_line):
    (command_line.subject.folder / "settings.toml").write_text("[kinematics]\niteration = 3\n")
    run = command_line("fit", command_line.subject.folder)
    assert run.exit_code == 1
    assert "unknown setting 'iteration' in [kinematics]; nearest: iterations" in run.stderr
    assert command_line.solves == []


def test_a_named_settings_file_is_used(command_line, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[kinematics]\niterations = 3\n")
    folder = command_line.subject.folder
    assert command_line("fit", folder, "--settings", file).exit_code == 0
    assert load_fit(folder / "results", folder).settings["kinematics"]["iterations"] == 3


@pytest.mark.parametrize(
    ("failure", "status", "line"),
    [
        (FitError("walk: no marker of the model"), 1, "walk: no marker of the model"),
        (KeyboardInterrupt(), 130, "stopped; nothing was written"),
        (TypeError("odd"), 1, "unexpected TypeError: odd (run with --debug for the traceback)"),
    ],
)
def test_a_failed_solve_is_one_line_and_writes_nothing(command_line, tmp_path, failure, status, line):
    command_line.failure = failure
    before = sorted(command_line.subject.folder.rglob("*"))
    target = tmp_path / "figures.json"
    run = command_line("fit", command_line.subject.folder, "--json", target)
    assert run.exit_code == status
    assert run.stderr == f"addb-viewer: {line}\n"
    assert run.stdout == ""
    assert not target.exists()
    assert sorted(command_line.subject.folder.rglob("*")) == before


def test_a_file_in_the_results_place_is_refused_before_the_solve(command_line):
    results = command_line.subject.folder / "results"
    results.write_text("mine")
    run = command_line("fit", command_line.subject.folder)
    assert run.exit_code == 1
    assert f"{results}: is a file; results need a folder" in run.stderr
    assert command_line.solves == []
    assert results.read_text() == "mine"


def test_a_read_only_place_is_refused_before_the_solve(command_line, monkeypatch):
    monkeypatch.setattr("os.access", lambda _, mode: not mode & os.W_OK)  # root may write anywhere
    run = command_line("fit", command_line.subject.folder)
    assert run.exit_code == 1
    assert "cannot be written to" in run.stderr
    assert command_line.solves == []


def test_a_folder_that_is_not_there(command_line, tmp_path):
    run = command_line("fit", tmp_path / "nobody")
    assert run.exit_code == 1
    assert "nobody: no such folder" in run.stderr
    assert run.stderr.count("\n") == 1


@pytest.mark.parametrize("line", ["fit", "fit . --frames 3", "fly .", "export .", "export . --to abc"])
def test_wrong_use_is_status_2(command_line, line):
    run = command_line(*line.split())
    assert run.exit_code == 2
    assert "Traceback" not in run.stderr


def test_json_into_a_missing_folder_is_refused_before_the_solve(command_line, tmp_path):
    run = command_line("fit", command_line.subject.folder, "--json", tmp_path / "missing" / "figures.json")
    assert run.exit_code == 2
    assert command_line.solves == []


@pytest.mark.real
def test_a_fit_ends_with_the_table_and_at_most_ten_lines(real_data, tmp_path):
    folder = tmp_path / "walk"
    shutil.copytree(real_data / "anomalies" / "UpsideDownData", folder, copy_function=shutil.copyfile)
    run = CliRunner().invoke(app, ["fit", str(folder)])
    assert run.exit_code == 0, run.output
    after = run.stdout.partition("dataset paper's bound).\n")[2].splitlines()
    assert 3 <= len(after) <= 10
    assert max(map(len, after[:-1])) <= 240
    assert any(line.startswith("! trial2: no measured force is used: ") for line in after)
    whole = CliRunner().invoke(app, ["fit", str(folder), "--notes"]).stdout
    notes = json.loads((folder / "results" / "fit.json").read_text(encoding="utf-8"))["notes"]
    assert len(notes) > 10
    assert all(f"note: {note['text']}" in whole for note in notes)


def test_sixty_notes_and_seven_trials_end_in_ten_lines(small_fit, capsys):
    figures = summary(small_fit, files=["results/fit.json"])
    trials = tuple(replace(figures.trials[0], name=f"walk{k}") for k in range(7))
    notes = [
        Note(kind, text, trial=f"walk{k % 7}", values={"marker": f"M{k}", "cm": k + 5})
        for k in range(10)
        for kind, text in (
            (Kind.FORCES_AGAINST_BODY, f"plates read {k + 1}.0 % against the body's mass"),
            (Kind.FAR_MARKERS, f"marker M{k} is up to {k + 5} cm off in frames 0-9"),
            (Kind.MODEL_AGAINST_MARKERS, f"mean pelvis tilt is {k}°, and people walk with -25° to 12°"),
            (Kind.WRONG_LABELS, f"label A{k} lay off its segment in frames 1-2 and is left out there"),
            (Kind.NOT_READ, f"x{k}.trc: the header says 9 frames, the file holds 3; is the file cut off?"),
            (Kind.GUESS, f"{k}: which axis points up is ambiguous"),
        )
    ]
    figures = replace(figures, trials=trials, notes=tuple(notes))
    print_summary(figures, closing=["2 files of the folder not used: a, b", "unchanged: kept fit of"])
    after = capsys.readouterr().out.partition("dataset paper's bound).\n")[2].splitlines()
    assert len(after) <= 10
    assert not any("…" in line for line in after)  # what needs a decision is told to its end
    decisions = [line.removeprefix("! ").partition(" (")[0] for line in after if line.startswith("! ")]
    assert decisions == [
        "not read",
        "forces against the body",
        "a guess",
        "model against markers",
        "markers far from the model",
    ]
    assert any("more to decide" in line for line in after)
