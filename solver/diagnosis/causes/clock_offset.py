"""Clock offset: the force plates' clock runs late or early against the cameras'."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.diagnosis.causes.about import About, Entry, Size
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene

LEAST_S = 0.002  # amplifiers delay by as much
# One lies within half an impact of any offset: the evidence of a jump has other peaks beside the right one.
LATER_S = (0.004, 0.008, 0.015, 0.03, 0.045, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.185, 0.21, 0.24)
STARTS_S = (*(-s for s in reversed(LATER_S)), *LATER_S)
FARTHEST_S = 0.3


ABOUT = About(
    id="clock_offset",
    entry=Entry("`all`", "recorded force(t) = true force(t − offset); positive: late", "`offset_s`"),
    title="forces shifted in time against the markers",
    sentence="Forces and markers are shifted in time: the forces come too late or too early.",
    remedy=(
        "Check the trigger line between cameras and plates. Forces 5 to 10 ms too late may be an "
        "amplifier's latency, too early the cameras'; more is a trigger, lost frames, or a filter "
        "that runs one way only."
    ),
    told_apart_by="a foot stamped on a plate at the beginning and at the end of the recording",
    branch="time/clock",
    is_a_clock=True,
    asked_up_to=40.0,
    sizes=(
        Size("offset_s", 0.005, 0.05, 2.0, "amplifiers and triggers; beyond, found by correlation alone"),
    ),
    readings=(
        Reading("offset_s", "the forces come {amount} {which}", "ms", 1e3, which=("too late", "too early")),
    ),
)


@dataclass(frozen=True)
class ClockOffset(Candidate):
    """recorded(t) = true(t − offset_s), for every plate: true(t) = recorded(t + offset_s).

    1 ms costs about 1 % of body weight in walking.
    """

    about = ABOUT

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Offsets from which the search begins [s]."""
        return tuple((offset,) for offset in STARTS_S)

    def steps(self) -> Eta:
        """[s]."""
        return (0.004,)

    def admissible(self, eta: Eta) -> bool:
        """Within what a trigger can be off."""
        return abs(eta[0]) <= FARTHEST_S

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Shifted less unshifted recording; a spline through the samples is not smoothed by being shifted."""
        shifted = scene.retimed(lambda times: times + eta[0])
        return Signature(np.zeros((scene.frames, 6, 0)), np.zeros(0), shifted - scene.measured_ground)

    def unrecorded(self, scene: Scene, eta: Eta) -> Bool[np.ndarray, " frames"]:
        """Those that the right clock puts outside the recording."""
        return scene.unrecorded(lambda times: times + eta[0])

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "0"],
        covariance: Float[np.ndarray, "0 0"],
    ) -> dict[str, Estimate]:
        """offset_s; positive when the forces were recorded late."""
        return {"offset_s": Estimate(eta[0], eta_std[0])}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond an amplifier's latency."""
        return abs(estimates["offset_s"].value) > LEAST_S


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One clock for all plates."""
    return [ClockOffset("all")] if any(scene.plates for scene in scenes) else []
