"""What the detection says: ranges of frames whose force is missing or wrong, and why."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool

from solver.common.true_runs import runs
from solver.contact.wrenches import MissingRange

# The B3D format's words.
ZERO_WHILE_ACCELERATING = "measuredGrfZeroWhenAccelerationNonZero"
UNMEASURED_EXTERNAL_FORCE = "unmeasuredExternalForceDetected"
FORCE_DISCREPANCY = "forceDiscrepancy"
NOT_OVER_FORCE_PLATE = "notOverForcePlate"
MISSING_BLIP = "missingBlip"
CLIPPED = "interpolatedClippedGRF"
CONTACT_BUT_NO_FORCE = "footContactDetectedButNoForce"
OUTLIERS = "hasInputOutliers"
NO_PLATE_DATA = "hasNoForcePlateData"
COP_OUTSIDE_FOOT = "copOutsideConvexFootError"


@dataclass(frozen=True)
class Proposal:
    """Frames on which the force on a foot is not to be used."""

    range: tuple[int, int]  # from the first number up to, not including, the second
    foot: str | None  # its body; None: all feet
    reason: str  # in the B3D format's words
    confidence: float  # 0 to 1
    evidence: dict[str, float] = field(default_factory=dict)  # names carry the units: missing_N, slip_m_s

    def widened(self, by: int, frames: int) -> "Proposal":
        """With so many frames more at both ends, within the trial."""
        return replace(self, range=(max(0, self.range[0] - by), min(frames, self.range[1] + by)))


def missing_force(
    proposals: Sequence[Proposal], foot_bodies: Sequence[str], frames: int, confidence: float = 0.0
) -> Bool[np.ndarray, "frames feet"]:
    """Per frame and foot: True where a proposal at least this sure says that force is missing."""
    missing = np.zeros((frames, len(foot_bodies)), dtype=bool)
    for proposal in proposals:
        if proposal.confidence >= confidence:
            feet = slice(None) if proposal.foot is None else list(foot_bodies).index(proposal.foot)
            missing[slice(*proposal.range), feet] = True
    return missing


def sure_ranges(proposals: Sequence[Proposal], confidence: float) -> tuple[MissingRange, ...]:
    """What is left out of a fit as long as nobody has decided: proposals at least this sure."""
    return tuple((*p.range, p.foot, p.reason) for p in proposals if p.confidence >= confidence)


def within(proposals: Sequence[Proposal], used: Bool[np.ndarray, " frames"]) -> tuple[Proposal, ...]:
    """The proposals cut down to frames that are used; one that reaches over others falls into pieces."""
    return tuple(
        replace(proposal, range=(proposal.range[0] + start, proposal.range[0] + end))
        for proposal in proposals
        for start, end in runs(used[slice(*proposal.range)])
    )
