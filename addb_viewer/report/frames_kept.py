"""Which frames of a trial count, which do not, and why: for a reader who has not seen the data."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.trial_view.replay import Replay
from annotations.foot_names import foot_words
from annotations.reasons import reason_words
from solver.common.true_runs import runs
from solver.contact.mask import (
    ERRONEOUS,
    NOT_RECORDED,
    OUTSIDE_RANGES,
    TOO_FEW_MARKERS,
    TWO_FEET_ON_ONE_PLATE,
)
from solver.contact.wrenches import DETECTION, FILE, NOBODY, PERSON

TRIAL_ENDS = "ends of the recording"
NO_FORCES = "no forces"

MEANINGS = {
    "measuredGrfZeroWhenAccelerationNonZero": "The plates read zero while the body's motion needs a force.",
    "unmeasuredExternalForceDetected": "Something that no plate measures pushes or holds the person.",
    "torqueDiscrepancy": "The plate's moment does not fit the motion.",
    "forceDiscrepancy": "The plate's force does not fit the motion.",
    "notOverForcePlate": "The foot stands where no plate is.",
    "missingImpact": "An impact of the foot is missing in the force.",
    "missingBlip": "A short contact is missing in the force.",
    "shiftGRF": "The force was moved in time against the markers.",
    "interpolatedClippedGRF": "The force was clipped at the plate's limit, or made up in between.",
    "manualReview": "Flagged by a person, who gave no more exact reason.",
    "footContactDetectedButNoForce": "The foot is on the ground, but no plate carries it.",
    "tooHighMarkerRMS": "The markers fit the skeleton badly.",
    "hasInputOutliers": "The recorded markers jump.",
    NOT_RECORDED: "No force was recorded at that time.",
    "velocitiesStillTooHighAfterFiltering": "The motion stays implausibly fast after filtering.",
    "copOutsideConvexFootError": "The plate's force acts outside every foot.",
    "zeroForceFrame": "The plate reads exactly zero.",
    "extendedToNearestPeakForce": "Beside a flagged stretch, up to the nearest peak of force.",
    TOO_FEW_MARKERS: "Too few markers are seen to know where the body is.",
    TWO_FEET_ON_ONE_PLATE: "One plate cannot be divided between two feet.",
    OUTSIDE_RANGES: "The subject's description says that this part of the trial is not to be used.",
    ERRONEOUS: "A person says that this stretch must not be used at all.",
    TRIAL_ENDS: "The first and last frames: accelerations are not known well enough there.",
    NO_FORCES: "The trial has no usable force recording.",
}

_WORDS = {"manualReview": "flagged by a person"}  # where its key's "other" says less

_DECIDED_BY = {
    PERSON: "the review in this program",
    FILE: "an imported review (a review.json or a table)",
    DETECTION: "automatic detection, which no person has confirmed",
}


@dataclass(frozen=True)
class Cause:
    """Why frames do not count: one foot, or both, and one reason."""

    foot: str | None  # None: whichever foot
    reason: str
    ranges: tuple[tuple[int, int], ...]  # the second number is the first frame after the range

    @property
    def frames(self) -> int:
        """How many frames it takes."""
        return sum(end - start for start, end in self.ranges)

    @property
    def foot_words(self) -> str:
        """As a table names it."""
        return "both feet" if self.foot is None else f"{foot_words(self.foot)} foot"

    @property
    def words(self) -> str:
        """The reason, short."""
        return _WORDS.get(self.reason, reason_words(self.reason))

    @property
    def meaning(self) -> str:
        """The reason in a sentence; empty where it says enough itself."""
        return MEANINGS.get(self.reason, "")


@dataclass(frozen=True)
class Kept:
    """What became of a trial's frames."""

    used: Bool[np.ndarray, " frames"]
    causes: tuple[Cause, ...]  # of the others; they may overlap
    contacts: tuple[int, int] | None  # how often a foot stood on a plate, of how many times on the ground

    @property
    def count(self) -> int:
        """How many frames count."""
        return int(self.used.sum())

    @property
    def frames(self) -> int:
        """How many there are."""
        return len(self.used)

    @property
    def ranges(self) -> tuple[tuple[int, int], ...]:
        """Where they are."""
        return tuple(runs(self.used))


def decided_by(mask_source: str, kept: Kept) -> str:
    """Who decided which frames count, in words.

    Args:
        mask_source: as in the figures of a fit.
        kept: the frames.
    """
    if mask_source == NOBODY:
        if not kept.count:
            return "nobody; there is no usable force recording"
        if kept.count < kept.frames:
            return "nobody; what is left out follows from the recording itself"
        return "nobody, so every recorded force counts"
    return "; elsewhere ".join(_DECIDED_BY.get(source, source) for source in mask_source.split(" + "))


def kept_frames(replay: Replay) -> Kept:
    """Tell the frames of a trial apart; each that does not count has a cause."""
    phases = replay.forces.contacts
    contacts = (sum(p.is_measured for p in phases), len(phases)) if phases else None
    if replay.residual is None:
        nothing = np.zeros(replay.frames, dtype=bool)
        return Kept(nothing, (Cause(None, NO_FORCES, ((0, replay.frames),)),), contacts)
    used = replay.residual.used
    frames: dict[tuple[str | None, str], Bool[np.ndarray, " frames"]] = {}
    for start, end, foot, reason in replay.forces.missing:
        taken = frames.setdefault((foot, reason), np.zeros(replay.frames, dtype=bool))
        taken[start:end] = True
    told = np.any(list(frames.values()), axis=0) if frames else np.zeros(replay.frames, dtype=bool)
    if (~used & ~told).any():
        frames[None, TRIAL_ENDS] = ~used & ~told
    causes = tuple(Cause(foot, reason, tuple(runs(of))) for (foot, reason), of in frames.items())
    return Kept(used, tuple(sorted(causes, key=lambda cause: -cause.frames)), contacts)


def frames_words(start: int, end: int) -> str:
    """Frames as people count them: the last one included."""
    return f"{start}" if end - start == 1 else f"{start}–{end - 1}"


def seconds_words(start: int, end: int, times: Float[np.ndarray, " frames"]) -> str:
    """The same on the recording's clock."""
    first, last = float(times[start]), float(times[end - 1])
    return f"{first:.2f} s" if end - start == 1 else f"{first:.2f}–{last:.2f} s"


def duration_s(ranges: Iterable[tuple[int, int]], rate: float) -> float:
    """How long so many frames last [s]."""
    return sum(end - start for start, end in ranges) / rate


def in_all(kept: Sequence[Kept]) -> tuple[int, int]:
    """Frames that count, and all frames, of several trials."""
    return sum(k.count for k in kept), sum(k.frames for k in kept)
