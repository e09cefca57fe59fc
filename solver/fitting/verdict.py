"""What a trial is good for, and what decides."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import final


class Use(StrEnum):
    """What a trial is good for; the least first."""

    UNKNOWN = "unknown"  # it is not fitted
    NOTHING = "nothing"
    ANGLES = "angles"
    TORQUES = "torques"  # and angles


class Why(StrEnum):
    """What speaks about a trial's use; what decides before the others first."""

    NO_FIT = "no fit"
    PERSON = "person"  # somebody marked the trial unusable
    NO_POSE = "no pose"  # on no frame enough markers are seen
    NO_FORCES = "no forces"  # no plate was recorded
    NO_FRAMES = "no frames"  # on none the force of every foot counts
    CAUSE = "cause"  # the diagnosis names it
    MARKERS = "marker error"  # RMS over all markers and frames
    MOMENT = "residual moment"
    FORCE = "residual force"
    UNEXPLAINED = "unexplained"  # the diagnosis knows no cause
    MARKER = "largest marker error"


FIGURES = (Why.MARKERS, Why.MOMENT, Why.FORCE, Why.MARKER)


@final
@dataclass(frozen=True)
class Reason:
    """One thing that limits a trial's use, or a figure that is within its limit."""

    why: Why
    leaves: Use  # what the trial is good for in spite of it
    share: float | None = None  # of the limit
    of: str = ""  # the marker; id and target of the cause; the person
    confidence: float | None = None  # of a cause
    words: str = ""  # of a cause in short; the person's own


@final
@dataclass(frozen=True)
class Verdict:
    """Of one trial."""

    use: Use
    reasons: tuple[Reason, ...]  # all that limits its use, what decides first; empty: all is within
    nearest: Reason | None  # the figure that is nearest to its limit, or farthest beyond it
    frames: int
    counting_frames: int  # on which the force of every foot counts
    posed_frames: int  # on which the pose is known

    @property
    def usable_frames(self) -> int:
        """Of what the trial is good for."""
        return {Use.TORQUES: self.counting_frames, Use.ANGLES: self.posed_frames}.get(self.use, 0)

    @property
    def decides(self) -> Reason | None:
        """What limits the use most; where nothing does, the figure that is nearest to its limit."""
        return self.reasons[0] if self.reasons else self.nearest

    @property
    def within(self) -> bool:
        """Whether nothing limits the use, not even near one marker."""
        return not self.reasons

    @property
    def named(self) -> bool:
        """Whether a cause decides."""
        return bool(self.reasons) and self.reasons[0].why is Why.CAUSE

    def also(self, reasons: Iterable[Reason]) -> "Verdict":
        """The verdict where these limit the use as well."""
        told = sorted((*self.reasons, *reasons), key=_first)
        return replace(self, use=told[0].leaves if told else Use.TORQUES, reasons=tuple(told))


NOT_FITTED = Verdict(Use.UNKNOWN, (Reason(Why.NO_FIT, Use.UNKNOWN),), None, 0, 0, 0)


def _first(reason: Reason) -> tuple[int, int, float]:
    """What leaves least; then what is no figure; then what is farthest beyond its limit."""
    figure = reason.why in FIGURES
    place = list(Why).index(Why.MARKERS if figure else reason.why)
    return list(Use).index(reason.leaves), place, -(reason.share or 0.0)
