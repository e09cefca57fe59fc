"""Where a trial stands: its verdict by figures, causes and people, what is open, and the next act."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from addb_viewer.text.amounts import counted
from addb_viewer.text.coordinate_words import torque_bands
from addb_viewer.text.diagnosis_vocabulary import about, names_of, short_title, sureness, tentative_of
from addb_viewer.text.residual_words import corrected_on_reading
from addb_viewer.text.use_words import trials_in_question
from annotations.events import FlagRange, Proposal, Status, Unusable
from annotations.trial_review import TrialReview
from solver.diagnosis.causes.about import CorrectedBy, TimeHistory
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport
from solver.dynamics.thresholds import Thresholds
from solver.fitting.fit_summary import Span, TrialFigures
from solver.fitting.verdict import NOT_FITTED, Reason, Use, Verdict, Why

LEAST_SURE = 0.5  # below it a cause is likelier something else, and limits nothing by itself
CauseKey = tuple[str, str]  # id and target
Reviews = Mapping[str, TrialReview]


USES = {
    Use.TORQUES: "Torques usable",
    Use.ANGLES: "Angles only",
    Use.NOTHING: "Not usable",
    Use.UNKNOWN: "Not fitted",
}
SIGNS = {Use.TORQUES: "✓", Use.ANGLES: "!", Use.NOTHING: "✗", Use.UNKNOWN: "–"}
NEXT = {
    "solve": "solve again",
    "compare": "see the new solve",
    "next": "decide",
    "diagnose": "find the cause",
    "finish": "finish",
}
PLAIN = {
    Why.NO_POSE: "too few markers are seen",
    Why.NO_FORCES: "no forces were measured",
    Why.NO_FRAMES: "no frame has the force of every foot",
    Why.UNEXPLAINED: "something unexplained is wrong",
}
FIGURES = {Why.MARKERS: "marker error", Why.MOMENT: "moment", Why.FORCE: "force", Why.MARKER: "marker"}
LIMITS = {
    Why.MARKERS: f"{1000 * Thresholds.marker_rms_m:.0f} mm",
    Why.MOMENT: f"{100 * Thresholds.angular_BWh:.0f} % BW·h",
    Why.FORCE: f"{100 * Thresholds.linear_BW:.0f} % BW",
    Why.MARKER: f"{1000 * Thresholds.marker_max_m:.0f} mm",
}


@dataclass(frozen=True)
class CauseDecisions:
    """What people decided about causes, by id and target, and which of these a fit has in its model."""

    accepted: frozenset[CauseKey] = frozenset()
    rejected: frozenset[CauseKey] = frozenset()
    in_fit: frozenset[CauseKey] = frozenset()


NO_DECISIONS = CauseDecisions()


@dataclass(frozen=True)
class VerdictLine:
    """Its parts; empty where there is nothing to say."""

    sign: str
    use: str
    band: str  # how far torques may be off, where they are usable
    frames: str
    why: str
    open: str
    next: str  # the action, as `COMMANDS` call it
    doing: str  # what it does, in words

    @property
    def text(self) -> str:
        """All but the next act, in one line."""
        use = ", ".join(filter(None, (self.use, self.band)))
        told = " · ".join(filter(None, (use, self.frames, self.why, self.open)))
        return f"{self.sign} {told}"


@dataclass(frozen=True)
class TrialVerdict:
    """Of one trial, as its first line says it."""

    verdict: Verdict
    status: Status = Status.UNSEEN
    by: str = ""  # who set it; empty: nobody
    note: str = ""  # of who set it
    proposals: int = 0  # that nobody has decided
    disagreements: int = 0  # of two people
    waiting: tuple[str, ...] = ()  # whose new solves wait to be kept or discarded
    changed: bool = False  # other forces count now than in the fit
    diagnosed: bool = False  # by a diagnosis that still holds
    undecided: int = 0  # causes of it that limit the use, and nobody has accepted
    accepted: int = 0  # those that somebody has, and the fit has not in its model
    band: str = ""  # of the knee's torque, else of the largest that has one

    @property
    def is_marked(self) -> bool:
        """Whether a person marked the trial unusable."""
        return any(reason.why is Why.PERSON for reason in self.verdict.reasons)

    @property
    def line(self) -> VerdictLine:
        """The same in words."""
        return _line(self)

    @property
    def next(self) -> str:
        """The action that comes next, as `COMMANDS` call it."""
        if self.verdict.use is Use.UNKNOWN:
            return "solve"
        if self.waiting:
            return "compare"
        if self.proposals or self.disagreements:
            return "next"
        if self.changed:
            return "solve"
        if self.status is Status.FINISHED:
            return "finish"
        if self.undecided and self.verdict.named:
            return "diagnose"
        if self.accepted:
            return "solve"
        asks = any(r.why in (Why.FORCE, Why.MOMENT) for r in self.verdict.reasons)
        return "diagnose" if asks and not self.diagnosed else "finish"


def _line(trial: TrialVerdict) -> VerdictLine:
    verdict = trial.verdict
    fitted = verdict.use is not Use.UNKNOWN
    sign = "!" if verdict.use is Use.TORQUES and verdict.reasons else SIGNS[verdict.use]
    doing = NEXT[trial.next] if fitted else "fit"
    if trial.next == "diagnose" and trial.undecided:
        doing = "decide about the cause"
    return VerdictLine(
        sign,
        USES[verdict.use],
        trial.band if verdict.use is Use.TORQUES else "",
        f"{verdict.usable_frames} of {verdict.frames} frames" if verdict.usable_frames else "",
        "" if verdict.decides is None else reason_words(verdict.decides),
        open_words(trial) if fitted else "",
        trial.next,
        "go on" if trial.next == "finish" and trial.status is Status.FINISHED else doing,
    )


def reason_words(reason: Reason) -> str:
    """What limits the use, or comes nearest to a limit; empty where nothing was fitted."""
    if reason.why is Why.PERSON:
        return f"marked unusable by {reason.of}: {reason.words}"
    if reason.why is Why.CAUSE:
        return f"{reason.words} ({sureness(reason.confidence or 0.0)})"
    if reason.share is None:
        return PLAIN.get(reason.why, "")
    name = " ".join(filter(None, (FIGURES[reason.why], reason.of)))
    return f"{name} {times_the_limit(reason.share)} ({LIMITS[reason.why]})"


def times_the_limit(share: float) -> str:
    """A figure in units of its limit; one that is beyond it never reads as if it were not."""
    if share <= 1.0:
        return f"{min(round(100 * share), 99)} % of the limit"
    digits = 2 if share < 1.1 else 1 if share < 10.0 else 0
    return f"{max(share, 1.01):.{digits}f} × the limit"


def open_words(trial: TrialVerdict) -> str:
    """What waits for a person."""
    told = [
        counted(count, word) + more
        for count, word, more in (
            (trial.proposals, "proposal", " open"),
            (trial.disagreements, "disagreement", ""),
        )
        if count
    ]
    told += [f"new solve of {by}" for by in trial.waiting]
    told += ["other forces count now"] if trial.changed else []
    told += ["an accepted cause is not in the fit yet"] if trial.accepted else []
    if trial.status is Status.SECOND_LOOK:
        told.insert(0, f"second look for {trial.by}{f': {trial.note}' if trial.note else ''}")
    if not told and trial.status is Status.FINISHED:
        return f"finished by {trial.by}"
    return ", ".join(told) or "nothing open"


def trial_verdict(
    figures: TrialFigures | None,
    review: TrialReview | None,
    report: DiagnosisReport | None = None,
    decided: CauseDecisions = NO_DECISIONS,
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
        decided: about its causes.
        proposals: that nobody has decided.
        waiting: whose new solves wait.
        changed: whether other forces count now than in the fit.
    """
    verdict = NOT_FITTED if figures is None else figures.judged()
    asked = report is not None and figures is not None and figures.name in report.trials
    undecided = accepted = 0
    if report is not None and figures is not None and asked:
        causes = dict(_of_causes(report, figures, decided, review))
        verdict = verdict.also(causes.values())
        accepted = len(causes.keys() & decided.accepted)
        undecided = sum(reason.why is Why.CAUSE for reason in causes.values()) - accepted
    if review is not None and review.unusable is not None:
        leaves = Use.ANGLES if review.unusable is Unusable.TORQUES else Use.NOTHING
        by = review.status_author or ""
        verdict = verdict.also([Reason(Why.PERSON, leaves, of=by, words=review.status_note)])
    bands = torque_bands(figures.torque_std_Nm) if figures else {}
    found = TrialVerdict(
        verdict,
        proposals=proposals,
        waiting=waiting,
        changed=changed,
        diagnosed=asked,
        undecided=undecided,
        accepted=accepted,
        band=next((bands.get("knee_angle", first) for first in bands.values()), ""),
    )
    if review is None:
        return found
    said = replace(found, status=review.status, by=review.status_author or "", note=review.status_note)
    return replace(said, disagreements=len(review.conflicts))


def cause_against(report: DiagnosisReport | None, trial: str, proposal: Proposal) -> str:
    """A named cause that makes sound forces look wrong there, in a few words; empty where there is none."""
    if report is None or proposal.reason not in LOOK_WRONG:
        return ""
    for cause in names_of(report):
        sure = max(cause.confidence, cause.in_its_class or 0.0)
        spans = [(start, end) for name, start, end in cause.frames if name == trial]
        there = any(start < proposal.end and proposal.start < end for start, end in spans)
        known = about(cause)
        timed = known.in_markers or known.corrected_by is CorrectedBy.FLAGGED
        if there and sure >= LEAST_SURE and not timed and not corrected_on_reading(cause):
            return short_title(cause)
    return ""


LOOK_WRONG = ("forceDiscrepancy", "torqueDiscrepancy", "copOutsideConvexFootError")


def _of_causes(
    report: DiagnosisReport,
    figures: TrialFigures,
    decided: CauseDecisions,
    review: TrialReview | None,
) -> Iterator[tuple[CauseKey | None, Reason]]:
    """What causes that act on the trial limit, unless corrected, left out or rejected; None: no name."""
    trial, named = figures.name, names_of(report)
    for cause in (*named, *tentative_of(report)):
        sure = max(cause.confidence, cause.in_its_class or 0.0)
        if trial not in {name for name, _, _ in cause.frames} or corrected_on_reading(cause):
            continue
        key = (cause.id, cause.target)
        if key in decided.in_fit | decided.rejected or _is_left_out(report, cause, figures, review):
            continue
        known = about(cause)
        doubted = Use.NOTHING if known.doubts_angles else Use.ANGLES
        near = known.in_markers or cause.is_tentative or sure < LEAST_SURE
        leaves = Use.TORQUES if near else doubted
        single = cause.confidence >= LEAST_SURE
        words = short_title(cause) if single else f"{short_title(cause)}, or a like cause"
        told = cause.confidence if single else sure
        yield key, Reason(Why.CAUSE, leaves, of=" ".join(key), confidence=told, words=words)
    if report.verdict == "unexplained" and trial in trials_in_question(report):
        yield None, Reason(Why.UNEXPLAINED, Use.ANGLES)


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
