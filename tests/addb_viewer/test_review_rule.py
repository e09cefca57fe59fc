"""One decision on a real recording changes its own frames, and no others: log, solver and mask together."""

import shutil

import numpy as np
import pytest

from addb_viewer.jobs.force_reviews import left_undecided, reviews_for_solve
from addb_viewer.jobs.review_store import as_proposal, open_log
from annotations.events import AcceptProposal, RejectProposal, SetStatus, Status
from annotations.open_proposals import open_proposals
from solver.capture.subject.opened_subject import open_subject
from solver.contact.wrenches import DETECTION, PERSON
from solver.fitting.pipeline import resolve, solve
from tests.conftest import NO_HELD_OUT as SETTINGS

pytestmark = [pytest.mark.real, pytest.mark.slow]  # their fixtures take long

STANCE_S = (1.6, 2.1)  # [s] holds one whole stance of the left foot
FEW_NM = 3.0  # the trajectory fit's own play; the first Enter used to move the knee by some 100 N·m


@pytest.fixture(scope="module")
def jump(real_data, tmp_path_factory):
    """The drop jump, whose first contact is on the box: two findings, both feet."""
    folder = tmp_path_factory.mktemp("jump") / "subject"
    folder.mkdir()
    source = real_data / "opencap_subject4"
    for name in ("MarkerData/DJ1.trc", "MarkerData/static1.trc", "ForceData/DJ1_grf.mot"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(source / name, folder / name)
    shutil.copy(source / "unscaled_generic.osim", folder)
    head, _, _ = (source / "subject.toml").read_text(encoding="utf-8").partition("[trials.STS1]")
    (folder / "subject.toml").write_text(head, encoding="utf-8")
    return solve(open_subject(folder), SETTINGS)


@pytest.fixture(scope="module")
def run(real_data, tmp_path_factory):
    """The run with one foot's plate reading half of the force in one stance, and detection's view of it."""
    folder = tmp_path_factory.mktemp("run") / "subject"
    shutil.copytree(real_data / "run_treadmill_hamner2013_subject04", folder)
    path = folder / "run400" / "grf.mot"
    lines = path.read_text(encoding="utf-8").splitlines()
    start = next(k for k, line in enumerate(lines) if line.split()[:1] == ["time"])
    halved = [k for k, name in enumerate(lines[start].split()) if name.startswith("L_") and "_v" in name]
    for k in range(start + 1, len(lines)):
        cells = lines[k].split()
        if STANCE_S[0] <= float(cells[0]) < STANCE_S[1]:
            for column in halved:
                cells[column] = repr(0.5 * float(cells[column]))
            lines[k] = "\t".join(cells)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return solve(open_subject(folder), SETTINGS)


@pytest.fixture(autouse=True)
def own_files(monkeypatch):
    monkeypatch.setenv("ADDB_VIEWER_STORE", "")


def decide(fit, *events):
    """Solve again after edits that stand in the subject's log; they are taken back at the end."""
    subject, (trial,) = fit.subject, fit.trials
    with open_log(subject.folder) as log:
        for event in events:
            log.append(trial.capture.name, event, "anna")
        reviews, _ = reviews_for_solve(subject, subject.trials)
        for _ in events:
            log.undo(trial.capture.name, "anna")
    return resolve(fit, reviews, SETTINGS)


def findings(fit):
    (trial,) = fit.trials
    return [as_proposal(found, fit.provenance) for found in trial.proposals]


def sure(fit):
    return [p for p in findings(fit) if p.confidence >= SETTINGS.detection.confidence]


def test_accepting_one_of_several_proposals_leaves_all_else_as_it_was(jump):
    (before,) = jump.trials
    first, *others = sure(jump)
    assert others, "the recording has several"
    again = decide(jump, AcceptProposal(first))
    (after,) = again.trials
    np.testing.assert_array_equal(before.mask.counts, after.mask.counts)
    assert after.mask.source == f"{PERSON} + {DETECTION}"
    knees = [k for k, name in enumerate(jump.skeleton.dofs) if "knee_angle" in name]
    moved = np.abs(after.dynamics.joint_torques - before.dynamics.joint_torques)[:, knees]
    assert knees
    assert moved.max() < FEW_NM


def test_rejecting_one_lets_its_own_frames_count_and_no_others(jump):
    (before,) = jump.trials
    first, *_ = sure(jump)
    (after,) = decide(jump, RejectProposal(first)).trials
    changed = before.mask.counts != after.mask.counts
    about = np.zeros_like(changed)
    about[first.start : first.end, before.contacts.foot_bodies.index(first.foot)] = True
    np.testing.assert_array_equal(changed, about)
    assert after.mask.counts[about].all()


def test_after_accepting_all_proposals_nothing_that_detection_left_out_counts(run):
    (before,) = run.trials
    feet, name = before.contacts.foot_bodies, before.capture.name
    assert (~before.mask.counts).any()
    with open_log(run.subject.folder) as log:
        while waiting := open_proposals(findings(run), log.review(name, feet)):
            log.append(name, AcceptProposal(waiting[0]), "anna")
        review, history = log.review(name, feet), log.history(name)
        reviews, _ = reviews_for_solve(run.subject, run.subject.trials)
        for _ in history:
            log.undo(name, "anna")
    (after,) = resolve(run, reviews, SETTINGS).trials
    assert not (after.mask.counts & ~before.mask.counts).any()
    left = left_undecided(review, before.proposals, before.motion.frames, SETTINGS.detection.confidence, {})
    assert all(any(p.start < q.end and q.start < p.end for q in review.accepted) for p in left)


def test_what_was_undecided_when_the_trial_was_finished_stays_left_out_and_nothing_else(jump):
    (before,) = jump.trials
    first, *others = sure(jump)
    accepted = decide(jump, AcceptProposal(first), SetStatus(Status.FINISHED, left_out=tuple(others)))
    (after,) = accepted.trials
    np.testing.assert_array_equal(before.mask.counts, after.mask.counts)
    alone = decide(jump, AcceptProposal(first), SetStatus(Status.FINISHED, left_out=()))
    counted = alone.trials[0].mask.counts & ~before.mask.counts  # as earlier versions finished: people alone
    assert counted.any()


def test_a_finished_trial_is_the_same_whatever_detection_finds_later(jump):
    first, *others = sure(jump)
    review = SetStatus(Status.FINISHED, left_out=(first,))
    (trial,) = decide(jump, review).trials
    feet = trial.contacts.foot_bodies
    expected = np.ones((trial.motion.frames, len(feet)), dtype=bool)
    expected[first.start : first.end, feet.index(first.foot)] = False
    np.testing.assert_array_equal(trial.mask.counts, expected)
    assert others
