"""`addb-viewer ablation`: the experiment on a real recording, and what it refuses."""

import json
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from addb_viewer.jobs import solving


@pytest.mark.real
def test_table_json_and_figure(command_line, real_data, tmp_path, monkeypatch):
    monkeypatch.undo()  # the real solver
    target, figure = tmp_path / "figures.json", tmp_path / "knee.svg"
    folder = real_data / "run_treadmill_hamner2013_subject04"
    run = command_line("ablation", folder, "--repetitions", "1", "--json", target, "--figure", figure)
    assert run.exit_code == 0, run.stderr
    assert "run400: 3 right steps" in run.stdout
    figures = json.loads(target.read_text(encoding="utf-8"))
    (condition,) = figures["conditions"]
    mean = {arm: {k: v["mean"] for k, v in f.items()} for arm, f in condition["arms"].items()}
    (start, end), border = figures["right_steps"][0], figures["border_frames"]
    assert border > 0
    assert condition["runs"][0]["hidden"] == [[max(0, start - border), end + border]]
    assert mean["oracle"]["knee_Nm"] == 0.0
    torn = mean["piecewise, before the joint fit"]["hidden_N"]
    assert mean["oracle"]["hidden_N"] < mean["ours"]["hidden_N"] < torn
    rough, smooth = (mean[f"{arm}, before the joint fit"]["residual_N"] for arm in ("piecewise", "ours"))
    assert rough > 5 * smooth
    assert condition["arms"]["ours"]["residual_N"]["std"] is None
    assert len(ElementTree.parse(figure).findall("{*}polyline")) == 5


def test_a_subject_without_steps_is_one_line(command_line, monkeypatch):
    monkeypatch.setattr("addb_viewer.commands.ablation.solve", _no_forces)
    run = command_line("ablation", command_line.subject.folder)
    assert run.exit_code == 1
    assert "no trial with 2 right steps or more" in run.stderr
    assert run.stderr.count("\n") == 1


@pytest.mark.parametrize("options", ["--fraction 1.5", "--repetitions 0", "--json missing/x.json"])
def test_wrong_use_is_status_2(command_line, options):
    assert command_line("ablation", command_line.subject.folder, *options.split()).exit_code == 2


def _no_forces(subject, settings, *, trials, reviews, progress):
    fit = solving.solve(subject, settings, trials=None, reviews=reviews, progress=progress)
    return replace(fit, trials=tuple(t for t in fit.trials if t.contacts is None))
