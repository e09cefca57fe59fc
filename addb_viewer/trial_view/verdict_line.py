"""A trial's first line: what it is good for, what decides, how many frames, what is open, what comes next."""

from dataclasses import dataclass

from addb_viewer.text.amounts import counted
from addb_viewer.text.diagnosis_vocabulary import sureness
from addb_viewer.trial_view.trial_verdict import TrialVerdict
from annotations.events import Status
from solver.fitting.verdict import Reason, Use, Why

USES = {
    Use.TORQUES: "Torques usable",
    Use.ANGLES: "Angles only",
    Use.NOTHING: "Not usable",
    Use.UNKNOWN: "Not fitted",
}
SIGNS = {Use.TORQUES: "✓", Use.ANGLES: "!", Use.NOTHING: "✗", Use.UNKNOWN: "–"}
NEXT = {
    "solve": "solve again",
    "keep": "keep the new solve",
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


@dataclass(frozen=True)
class VerdictLine:
    """Its parts; empty where there is nothing to say."""

    sign: str
    use: str
    why: str
    frames: str
    open: str
    next: str  # the action, as `COMMANDS` call it
    doing: str  # what it does, in words

    @property
    def text(self) -> str:
        """All but the next act, in one line."""
        told = " · ".join(filter(None, (self.use, self.why, self.frames, self.open)))
        return f"{self.sign} {told}"


def verdict_line(trial: TrialVerdict) -> VerdictLine:
    """The parts of the line.

    Args:
        trial: where it stands.
    """
    verdict = trial.verdict
    fitted = verdict.use is not Use.UNKNOWN
    sign = "!" if verdict.use is Use.TORQUES and verdict.reasons else SIGNS[verdict.use]
    doing = NEXT[trial.next] if fitted else "fit"
    return VerdictLine(
        sign,
        USES[verdict.use],
        "" if verdict.decides is None else reason_words(verdict.decides),
        f"{verdict.usable_frames} of {verdict.frames} frames" if verdict.usable_frames else "",
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
    return f"{name} {times_the_limit(reason.share)}"


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
    told += [f"a new solve of {by} waits" for by in trial.waiting]
    told += ["other forces count now"] if trial.changed else []
    if not told and trial.status is Status.FINISHED:
        return "finished"
    return ", ".join(told) or "nothing open"
