"""Where a trial stands: its verdict by figures, causes and people, what is open, and the next act."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from addb_viewer.text.diagnosis_vocabulary import about, names_of, short_title, tentative_of
from addb_viewer.text.residual_words import corrected_on_reading
from addb_viewer.text.use_words import trials_in_question
from annotations.events import FlagRange, Status, Unusable
from annotations.trial_review import TrialReview
from solver.diagnosis.causes.about import CorrectedBy, TimeHistory
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport
from solver.fitting.fit_summary import Span, TrialFigures
from solver.fitting.verdict import NOT_FITTED, Reason, Use, Verdict, Why

LEAST_SURE = 0.5  # below it a cause is likelier something else, and limits nothing by itself
CauseKey = tuple[str, str]  # id and target
Reviews = Mapping[str, TrialReview]


@dataclass(frozen=True)
class TrialVerdict:
    """Of one trial, as its first line says it."""

    verdict: Verdict
    status: Status = Status.UNSEEN
    proposals: int = 0  # that nobody has decided
    disagreements: int = 0  # of two people
    waiting: tuple[str, ...] = ()  # whose new solves wait to be kept or discarded
    changed: bool = False  # other forces count now than in the fit
    diagnosed: bool = False  # by a diagnosis that still holds

    @property
    def open(self) -> int:
        """How many things wait for a person."""
        return self.proposals + self.disagreements + len(self.waiting) + self.changed

    @property
    def next(self) -> str:
        """The action that comes next, as `COMMANDS` call it."""
        if self.verdict.use is Use.UNKNOWN:
            return "solve"
        if self.waiting:
            return "keep"
        if self.proposals or self.disagreements:
            return "next"
        if self.changed:
            return "solve"
        asks = any(r.why in (Why.FORCE, Why.MOMENT) for r in self.verdict.reasons) and not self.diagnosed
        if self.status is not Status.FINISHED and (asks or self.verdict.named):
            return "diagnose"
        return "finish"


def trial_verdict(
    figures: TrialFigures | None,
    review: TrialReview | None,
    report: DiagnosisReport | None = None,
    taken_in: Collection[CauseKey] = (),
    *,
    proposals: int = 0,
    waiting: tuple[str, ...] = (),
    changed: bool = False,
) -> TrialVerdict:
    """Where a trial stands.

    Args:
        figures: of its fit; None: it is not fitted.
        review: what people decided; None: nothing is known of it.
        report: of a diagnosis that still holds; None: nobody has asked.
        taken_in: causes that the fit has in its model.
        proposals: that nobody has decided.
        waiting: whose new solves wait.
        changed: whether other forces count now than in the fit.
    """
    verdict = NOT_FITTED if figures is None else figures.judged()
    asked = report is not None and figures is not None and figures.name in report.trials
    if report is not None and figures is not None and asked:
        verdict = verdict.also(_of_causes(report, figures, taken_in, review))
    if review is not None and review.unusable is not None:
        leaves = Use.ANGLES if review.unusable is Unusable.TORQUES else Use.NOTHING
        by = review.status_author or ""
        verdict = verdict.also([Reason(Why.PERSON, leaves, of=by, words=review.status_note)])
    return TrialVerdict(
        verdict,
        Status.UNSEEN if review is None else review.status,
        proposals,
        0 if review is None else len(review.conflicts),
        waiting,
        changed,
        asked,
    )


def _of_causes(
    report: DiagnosisReport,
    figures: TrialFigures,
    taken_in: Collection[CauseKey],
    review: TrialReview | None,
) -> Iterator[Reason]:
    """What the causes that act on the trial limit: what is not corrected yet, and not left out either."""
    trial, named = figures.name, names_of(report)
    for cause in (*named, *tentative_of(report)):
        sure = max(cause.confidence, cause.in_its_class or 0.0)
        if trial not in {name for name, _, _ in cause.frames} or corrected_on_reading(cause):
            continue
        if (cause.id, cause.target) in taken_in or _is_left_out(report, cause, figures, review):
            continue
        known, key = about(cause), f"{cause.id} {cause.target}"
        doubted = Use.NOTHING if known.doubts_angles else Use.ANGLES
        near = known.in_markers or cause.is_tentative or sure < LEAST_SURE
        leaves = Use.TORQUES if near else doubted
        yield Reason(Why.CAUSE, leaves, of=key, confidence=cause.confidence, words=short_title(cause))
    if report.verdict == "unexplained" and trial in trials_in_question(report):
        yield Reason(Why.UNEXPLAINED, Use.ANGLES)


def _is_left_out(
    report: DiagnosisReport, cause: Cause, figures: TrialFigures, review: TrialReview | None
) -> bool:
    """Whether most frames of a cause that acts for a while do not count, or people have flagged them."""
    own = [flag for trial, flag in flags_of(report, cause, report.trials) if trial == figures.name]
    if not own:
        return False
    if review is not None and all(_covered(flag, review) for flag in own):
        return True
    counting = sum(_shared(flag, span) for flag in own for span in figures.frames_used_ranges)
    return 2 * counting < sum(flag.end - flag.start for flag in own)


def _shared(flag: FlagRange, span: Span) -> int:
    return max(0, min(flag.end, span[1]) - max(flag.start, span[0]))


def flags_of(figures: DiagnosisReport, effect: Cause, trials: Sequence[str]) -> list[tuple[str, FlagRange]]:
    """By trial, the flags that take a cause's frames out of all fits; none where it acts all the time.

    Args:
        figures: of the diagnosis.
        effect: of `figures`.
        trials: of the subject.
    """
    known = about(effect)
    if known.corrected_by is CorrectedBy.FLAGGED:
        reason = "notOverForcePlate"
        several = effect.target.startswith("plate_") or "+" in effect.target
        foot = None if several else effect.target
    elif known.time_history is TimeHistory.NOW_AND_THEN:
        reason, foot = "unmeasuredExternalForceDetected", None
    else:
        return []
    found = sorted(effect.frames)
    return [(trial, FlagRange(start, end, reason, foot)) for trial, start, end in found if trial in trials]


def is_flagged(flags: Sequence[tuple[str, FlagRange]], reviews: Reviews) -> bool:
    """Whether people have flagged all of these frames, for whatever reason."""
    return all(_covered(flag, reviews[trial]) for trial, flag in flags if trial in reviews)


def _covered(flag: FlagRange, review: TrialReview) -> bool:
    frames = np.arange(flag.start, flag.end)
    out = np.zeros(len(frames), dtype=bool)
    for start, end, foot, _ in review.missing_ranges:
        if foot is None or foot == flag.foot:
            out |= (frames >= start) & (frames < end)
    return bool(out.all())
