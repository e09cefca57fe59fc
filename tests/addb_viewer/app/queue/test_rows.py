import json
from dataclasses import replace

import pytest

from addb_viewer.app.queue.controller import rows_html
from addb_viewer.app.queue.rows import Filter, Row, order, shown, subject_rows
from addb_viewer.jobs.review_store import as_proposal, open_log
from annotations.events import IMPORTED, RejectProposal, SetStatus, Status
from solver.capture.capture import Subject, TrialFiles
from solver.contact.proposals import Proposal
from solver.fitting.results.store import save_fit

SPITEFUL = "<script>alert(1)</script>"


def row(trial, *, force_BW=0.01, moment_BWh=0.001, used=100, source="review", status=Status.UNSEEN, **more):
    figures = {
        "frames": 100,
        "frames_with_force_used": used,
        "mask_source": source,
        "linear_residual": {"rms_BW": force_BW},
        "angular_residual": {"rms_BWh": moment_BWh},
    }
    return Row("S1", trial, status, None, figures, **more)


def test_the_residual_is_told_in_units_of_the_worse_bound():
    assert row("a", force_BW=0.05).residual == 1.0
    assert row("a", moment_BWh=0.02).residual == 2.0
    assert Row("S1", "a").residual is None


def test_worst_first_and_finished_last():
    rows = [
        row("good"),
        row("done", force_BW=0.5, status=Status.FINISHED),
        row("bad", force_BW=0.2),
        Row("S1", "never fitted"),
        row("half left out", used=40),
        row("nobody decided", source="proposals"),
    ]
    names = [r.trial for r in sorted(rows, key=order)]
    assert names == ["never fitted", "bad", "nobody decided", "half left out", "good", "done"]


def test_filters_let_through_what_they_say():
    rows = [row("walk 1"), row("walk 2", status=Status.FINISHED), row("run", status=Status.SECOND_LOOK)]
    assert [r.trial for r in shown(rows, Filter.TO_DO)] == ["walk 1", "run"]
    assert [r.trial for r in shown(rows, Filter.FINISHED)] == ["walk 2"]
    assert [r.trial for r in shown(rows, Filter.SECOND_LOOK)] == ["run"]
    assert [r.trial for r in shown(rows, Filter.ALL, "WALK 2")] == ["walk 2"]


def test_status_and_figures_are_read_from_the_subjects_folder(tmp_path):
    (tmp_path / "seg").mkdir()
    (tmp_path / "seg" / "REVIEWED").touch()
    trials = (
        TrialFiles("a", tmp_path / "a.trc"),
        TrialFiles("b", tmp_path / "b.trc", reviews=(tmp_path / "seg" / "review.json",)),
        TrialFiles("c", tmp_path / "c.trc"),
    )
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "fit.json").write_text(json.dumps({"trials": [{"name": "a", "frames": 5}]}))
    with open_log(tmp_path) as log:
        log.append("a", SetStatus(Status.SECOND_LOOK), "Zoë")
    a, b, c = subject_rows("S1", Subject(tmp_path, trials))
    assert (a.status, a.by, a.figures["frames"]) == (Status.SECOND_LOOK, "Zoë", 5)
    assert (b.status, b.by) == (Status.FINISHED, IMPORTED)
    assert (c.status, c.figures) == (Status.UNSEEN, None)


def test_names_from_files_stay_text():
    rows = [row(SPITEFUL), Row(SPITEFUL, "", error=SPITEFUL), Row(SPITEFUL, "x", by=SPITEFUL)]
    assert "<script>" not in rows_html(rows, ("", ""), several=True, notes=(SPITEFUL,))


def test_a_row_says_who_is_there():
    here = rows_html([row("walk")], ("", ""), several=False, people={("S1", "walk"): ("Bo", SPITEFUL)})
    assert "Bo and &lt;script&gt;alert(1)&lt;/script&gt; are here" in here


def test_open_proposals_put_a_trial_higher_until_they_are_decided(small_fit):
    found = Proposal((0, 2), "thigh", "notOverForcePlate", 0.5, {})
    first, second = small_fit.trials
    subject = replace(small_fit.subject, foot_bodies=("thigh",))
    save_fit(
        replace(small_fit, trials=(replace(first, proposals=(found,)), second)), subject.folder / "results"
    )
    before = subject_rows("S1", subject)[0]
    assert (before.proposed, before.doubtful) == (1, 0.5 * 2 / 4)
    assert before.badness == pytest.approx(replace(before, doubtful=0.0).badness + 0.25)
    assert ">1</td>" in rows_html([before], ("", ""), several=False)
    with open_log(subject.folder) as log:
        log.append("walk", RejectProposal(as_proposal(found, {})), "Zoë")
    assert (subject_rows("S1", subject)[0].proposed, subject_rows("S1", subject)[0].doubtful) == (0, 0.0)
