"""The queue's rows: what they hold, their order, which is next, and which are fitted ahead."""

import json
from dataclasses import replace

import pytest

from addb_viewer.app.jobs import fit_all
from addb_viewer.app.queue.queue_controller import rows_html
from addb_viewer.app.queue.queue_rows import Row, next_trial, order, subject_rows, to_review
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.jobs.review_store import as_proposal, open_log
from addb_viewer.jobs.root_folder import open_root
from addb_viewer.trial_view.kept_verdicts import kept_verdicts
from annotations.events import IMPORTED, RejectProposal, SetStatus, Status
from solver.capture.capture import Subject, TrialFiles
from solver.common.typed_json import plain
from solver.contact.detected_ranges import Proposal
from solver.fitting.results.store import has_fit, save_fit
from tests.addb_viewer.app.test_app import write_subject
from tests.addb_viewer.fit_figures import force, moment, of_subject, of_trial
from tests.patience import PATIENCE_S

SPITEFUL = "<script>alert(1)</script>"


def row(trial, *, force_BW=0.01, moment_BWh=0.001, used=100, source="review", status=Status.UNSEEN, **more):
    figures = of_trial(
        frames_with_force_used=used,
        mask_source=source,
        linear_residual=force(7.0, force_BW),
        angular_residual=moment(1.0, moment_BWh),
    )
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


def test_status_and_figures_are_read_from_the_subjects_folder(tmp_path):
    (tmp_path / "seg").mkdir()
    (tmp_path / "seg" / "REVIEWED").touch()
    trials = (
        TrialFiles("a", tmp_path / "a.trc"),
        TrialFiles("b", tmp_path / "b.trc", reviews=(tmp_path / "seg" / "review.json",)),
        TrialFiles("c", tmp_path / "c.trc"),
    )
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "fit.json").write_text(
        json.dumps(plain(of_subject(of_trial(name="a", frames=5))))
    )
    with open_log(tmp_path) as log:
        log.append("a", SetStatus(Status.SECOND_LOOK), "Zoë")
    a, b, c = subject_rows("S1", Subject(tmp_path, trials))
    assert (a.status, a.by, a.figures.frames) == (Status.SECOND_LOOK, "Zoë", 5)
    assert (b.status, b.by) == (Status.FINISHED, IMPORTED)
    assert (c.status, c.figures) == (Status.UNSEEN, None)


def test_a_torn_log_of_causes_takes_no_trial_out_of_the_queue(small_fit):
    results = small_fit.subject.folder / "results"
    save_fit(small_fit, results)
    before = [row.verdict for row in subject_rows("S1", small_fit.subject)]
    (results / "extension_log.jsonl").write_text("{torn\n{}\n")
    assert [row.verdict for row in subject_rows("S1", small_fit.subject)] == before


def test_forces_that_a_file_left_out_of_the_fit_are_no_change_since(small_fit):
    trial, *others = small_fit.trials
    counts = trial.mask.counts.copy()
    counts[:2] = False
    of_file = {"reasons": ((0, 2, None, "manualReview"),), "sources": ("review.json",)}
    mask = replace(trial.mask, counts=counts, **of_file)
    fit = replace(small_fit, trials=(replace(trial, mask=mask), *others))
    save_fit(fit, fit.subject.folder / "results")
    subject = replace(fit.subject, foot_bodies=trial.contacts.foot_bodies)
    assert not any(verdict.changed for verdict in kept_verdicts(subject).values())


def test_read_anew_takes_in_folders_that_have_come(tmp_path):
    write_subject(tmp_path / "S1")
    queue = TrialQueue(OpenSubjects(open_root(tmp_path)))
    assert {row.subject for row in queue.rows()} == {"S1"}
    write_subject(tmp_path / "S2")
    assert {row.subject for row in queue.rows()} == {"S1"}
    assert {row.subject for row in queue.rows(anew=True)} == {"S1", "S2"}
    shared = queue.subjects.subject("S2")
    assert shared.subject.folder == tmp_path.resolve() / "S2"
    shared.close()


def test_names_from_files_stay_text():
    rows = [row(SPITEFUL), Row(SPITEFUL, "", error=SPITEFUL), Row(SPITEFUL, "x", by=SPITEFUL)]
    assert "<script>" not in rows_html(rows, ("", ""), notes=(SPITEFUL,))


def test_a_row_says_who_is_there():
    people = {("S1", "walk"): ("Bo", SPITEFUL)}
    assert "Bo and &lt;script&gt;alert(1)&lt;/script&gt; are here" in rows_html(
        [row("walk")], ("", ""), people=people
    )


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
    assert "1 proposal open" in rows_html([before], ("", ""))
    with open_log(subject.folder) as log:
        log.append("walk", RejectProposal(as_proposal(found, {})), "Zoë")
    assert (subject_rows("S1", subject)[0].proposed, subject_rows("S1", subject)[0].doubtful) == (0, 0.0)


ROWS = [
    Row("S1", "a"),
    Row("S1", "b", Status.FINISHED),
    Row("S1", "c"),
    Row("S2", "a"),
    Row("S3", "", error="broken"),
]


def place(row):
    return None if row is None else (row.subject, row.trial)


def test_it_comes_after_the_present_one_and_then_from_the_top():
    assert place(next_trial(ROWS, ("S1", "a"), ())) == ("S1", "c")
    assert place(next_trial(ROWS, ("S1", "c"), ())) == ("S2", "a")
    assert place(next_trial(ROWS, ("S2", "a"), ())) == ("S1", "a")
    assert place(next_trial(ROWS, None, ())) == ("S1", "a")
    assert place(next_trial(ROWS, ("S9", "gone"), ())) == ("S1", "a")


def test_it_is_none_that_is_finished_or_broken_or_that_somebody_is_on():
    assert place(next_trial(ROWS, ("S1", "a"), {("S1", "c")})) == ("S2", "a")
    assert next_trial(ROWS, ("S1", "a"), {("S1", "c"), ("S2", "a")}) is None
    assert next_trial(ROWS[1:2], None, ()) is None
    assert next_trial([], ("S1", "a"), ()) is None


def test_what_is_still_to_be_reviewed_whoever_is_on_it():
    assert [place(row) for row in to_review(ROWS, ("S1", "a"))] == [("S1", "c"), ("S2", "a")]


def test_one_that_is_fitted_comes_before_one_that_is_not():
    rows = [*ROWS, Row("S4", "a", figures=of_trial()), Row("S4", "b", figures=of_trial())]
    assert place(next_trial(rows, ("S1", "a"), ())) == ("S4", "a")
    assert place(next_trial(rows, ("S1", "a"), {("S4", "a")})) == ("S4", "b")
    assert place(next_trial(rows, ("S1", "a"), {("S4", "a"), ("S4", "b")})) == ("S1", "c")


@pytest.fixture
def queue(tmp_path, monkeypatch):
    monkeypatch.setattr(fit_all, "WORKER", ("tests.addb_viewer.app.stub_fit_worker",))
    monkeypatch.setattr(fit_all, "LOOK_EVERY", 0.05)
    for name in ("anna", "ben", "broken", "carl", "long"):
        write_subject(tmp_path / name)
    queue = TrialQueue(OpenSubjects(open_root(tmp_path)))
    yield queue
    queue.close()


def ended(queue):
    thread = queue.fit_all._thread
    if thread is not None:
        thread.join(PATIENCE_S)
    assert not queue.fit_all.state.running


def test_the_next_two_are_fitted_and_no_more(queue, tmp_path):
    queue.fit_ahead(["ben", "carl", "anna"], "Zoë")
    assert queue.is_being_fitted("carl")
    assert not queue.is_being_fitted("anna")
    ended(queue)
    assert [has_fit(tmp_path / name / "results") for name in ("anna", "ben", "carl")] == [False, True, True]
    queue.fit_ahead(["anna"], "Zoë")
    ended(queue)
    assert has_fit(tmp_path / "anna" / "results")


def test_what_failed_or_was_cancelled_is_not_begun_again_unasked(queue):
    queue.fit_ahead(["broken"], "Zoë")
    ended(queue)
    queue.fit_ahead(["broken", "long"], "Zoë")
    assert not queue.is_being_fitted("broken")
    assert queue.is_being_fitted("long")
    queue.cancel_fits()
    ended(queue)
    queue.fit_ahead(["broken", "long"], "Zoë")
    assert not queue.fit_all.state.running
