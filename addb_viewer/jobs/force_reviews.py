"""What people decided about trials' forces, as the solver takes it, and what nobody has decided."""

from collections.abc import Mapping, Sequence

from addb_viewer.jobs.review_store import (
    FILE,
    as_proposal,
    has_log,
    store_url,
    unreadable_notes,
    whole_log,
    with_own_file,
)
from annotations.events import IMPORTED, Edit, Proposal
from annotations.folding import folded
from annotations.trial_review import TrialReview
from solver.capture.capture import Capture, Subject, TrialFiles
from solver.common.notes import Kind, Note, noted
from solver.contact.detected_ranges import Proposal as Found
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.mask import ERRONEOUS
from solver.fitting.settings import settings_for


def force_review(review: TrialReview) -> ForceReview:
    """What a trial's review says about forces, as the solver takes it.

    Args:
        review: its present state.
    """
    said = [
        *((flag.author, ForceLabel(flag.start, flag.end, flag.foot, flag.reason)) for flag in review.flags),
        *((c.author, ForceLabel(c.start, c.end, c.foot, None)) for c in review.cleared),
        *(
            (a.author, ForceLabel(a.start, a.end, None, ERRONEOUS))
            for a in review.activities
            if a.activity == ERRONEOUS
        ),
    ]
    counts = [ForceLabel(start, end, None, None) for start, end in review.file_counts or ()]
    stays_out = review.stays_out
    return ForceReview(
        by_people=tuple(label for author, label in said if author != IMPORTED),
        by_file=(*counts, *(label for author, label in said if author == IMPORTED))
        if review.is_imported
        else None,
        stays_out=None if stays_out is None else tuple((f.start, f.end, f.foot, f.reason) for f in stays_out),
    )


def left_undecided(
    review: TrialReview, found: Sequence[Found], frames: int, confidence: float, provenance: Mapping[str, str]
) -> tuple[Proposal, ...]:
    """What detection leaves out of a trial and neither a person nor a file has decided.

    Args:
        review: of the trial, its review.json included.
        found: what detection proposes.
        frames: of the trial.
        confidence: from which on a proposal is left out (`[detection] confidence`).
        provenance: of the fit that detection looked at.
    """
    judged = review.judged(frames, by_files=True)

    def is_undecided(proposal: Found) -> bool:
        return not judged[slice(*proposal.range), review.lane(proposal.foot)].all()

    ours = [p for p in found if p.confidence >= confidence and (p.foot is None or p.foot in review.feet)]
    return tuple(as_proposal(p, provenance) for p in ours if is_undecided(p))


def undecided(
    subject: Subject, files: TrialFiles, capture: Capture, history: Sequence[Edit]
) -> tuple[Proposal, ...] | None:
    """Likewise, as the kept fit's detection has it; None where the trial has not been fitted.

    Args:
        subject: whose.
        files: of the trial.
        capture: the trial as read from them.
        history: the trial's edits.

    Raises:
        SolverError: the fit, or the subject's settings.toml, cannot be read.
    """
    from solver.fitting.results.kept_trials import kept_trials  # noqa: PLC0415 (slow; few who read reviews ask)
    from solver.fitting.results.store import default_folder  # noqa: PLC0415 (likewise)

    found = kept_trials(default_folder(subject.folder))
    if files.name not in found:
        return None
    review = folded(files.name, with_own_file(files, capture, history), subject.foot_bodies)
    confidence = settings_for(subject.folder).detection.confidence
    return left_undecided(review, found[files.name].proposals, capture.markers.frames, confidence, {})


def reviews_for_solve(
    subject: Subject, trials: Sequence[TrialFiles]
) -> tuple[dict[str, ForceReview], tuple[Note, ...]]:
    """What people decided about trials, as the solver takes it, and what they should know about it.

    Args:
        subject: whose.
        trials: those to be solved.

    Returns:
        What they say by trial, only of trials about whose forces they say something; and notes: where
        reviewers disagree, edits that are not used, and rows that cannot be read.

    Raises:
        ReviewError: the log cannot be read, or is about a foot that the subject does not have.
    """
    if not has_log(subject.folder):
        return {}, ()
    found = whole_log(subject.folder)
    about = {trial.name: found.about(trial.name) for trial in trials}
    reviews = [folded(name, said.edits, subject.foot_bodies, said.unreadable) for name, said in about.items()]
    known = {trial.name for trial in subject.trials}
    gone = sorted({edit.trial for edit in found.edits} - known)
    notes = [
        Note(Kind.REVIEWS, str(conflict)).in_trial(review.trial)
        for review in reviews
        for conflict in review.conflicts
    ]
    wanted = {trial.name for trial in trials} | {""}
    unreadable = [r for r in found.unreadable if r.trial in wanted or r.trial not in known]
    notes += noted(Kind.NOT_READ, *unreadable_notes(unreadable))
    if gone:
        place = FILE if store_url() is None else "the shared database"
        text = f"{place}: has edits of trials that the subject does not have: {', '.join(gone)}"
        notes += noted(Kind.REVIEWS, text)
    if store_url() is not None and (subject.folder / FILE).is_file():
        notes += noted(
            Kind.REVIEWS,
            f"{FILE}: not used, because reviews are kept in a shared database; `share` copies it there",
        )
    said = {review.trial: force_review(review) for review in reviews}
    return {trial: review for trial, review in said.items() if review != ForceReview()}, tuple(notes)
