"""`addb-viewer detect`: what it prints and writes."""

import json
from dataclasses import replace

import pytest

from solver.contact.detected_ranges import Proposal

SURE = Proposal((1, 3), "thigh", "notOverForcePlate", 0.9, {"missing_N": 612.34, "measured_N": 1e-17})
UNSURE = Proposal((3, 4), None, "forceDiscrepancy", 0.3, {"missing_share": 0.25})


@pytest.fixture
def judged(command_line, monkeypatch):
    """The command line, whose solve also proposes something for the trial with forces."""
    from addb_viewer.jobs import solving

    solve = solving.solve

    def proposing(*arguments, **named):
        fit = solve(*arguments, **named)
        trials = (replace(t, proposals=(SURE, UNSURE)) if t.contacts else t for t in fit.trials)
        return replace(fit, trials=tuple(trials))

    monkeypatch.setattr(solving, "solve", proposing)
    return command_line


def test_json_is_the_contract(judged, tmp_path):
    target = tmp_path / "found.json"
    assert judged("detect", judged.subject.folder, "--json", target).exit_code == 0
    walk, other = json.loads(target.read_text(encoding="utf-8"))["trials"]
    assert walk == {
        "name": "walk",
        "frames": 4,
        "missing": [
            {
                "range": [1, 3],
                "foot": "thigh",
                "reason": "notOverForcePlate",
                "confidence": 0.9,
                "evidence": {"missing_N": 612.34, "measured_N": 1e-17},
            },
            {
                "range": [3, 4],
                "foot": None,
                "reason": "forceDiscrepancy",
                "confidence": 0.3,
                "evidence": {"missing_share": 0.25},
            },
        ],
        "mask": [False, True, True, False],  # what is unsure is told, and not masked
    }
    assert [(m["range"], m["reason"]) for m in other["missing"]] == [([0, 4], "hasNoForcePlateData")]
    assert other["mask"] == [True] * 4


def test_what_it_prints(judged):
    run = judged("detect", judged.subject.folder, "--trial", "walk")
    assert run.exit_code == 0
    assert "walk: force is missing on 2 of 4 frames" in run.stdout
    rows = [" ".join(line.split()) for line in run.stdout.splitlines()]
    assert "1:3 thigh notOverForcePlate 90 % 612 N missing, 0 N measured" in rows
    assert "3:4 all forceDiscrepancy 30 % 25 % of the force missing" in rows
    assert "no/forces" not in run.stdout


def test_nothing_is_kept(judged):
    folder = judged.subject.folder
    before = sorted(folder.rglob("*"))
    assert judged("detect", folder).exit_code == 0
    assert sorted(folder.rglob("*")) == before


def test_a_current_fit_is_not_made_again(judged):
    folder = judged.subject.folder
    assert judged("fit", folder).exit_code == 0
    run = judged("detect", folder)
    assert len(judged.solves) == 1
    assert "notOverForcePlate" in run.stdout


def test_a_folder_that_isnt_there_to_write_into(judged):
    run = judged("detect", judged.subject.folder, "--json", judged.subject.folder / "none" / "found.json")
    assert run.exit_code == 2
    assert judged.solves == []
