"""Sample rate: the force plates' clock runs faster or slower than the cameras'."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.diagnosis.causes.about import About, Entry
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene

PRIOR_STD = 0.01  # a rate typed in wrongly or rounded; crystals agree to a ten-thousandth
LEAST = 0.002
FARTHEST = 0.06  # beyond, it is another rate altogether
NEAREST_REACH = 0.02  # is searched however long the trial
LAST_FRAME_S = 0.3  # how far the trial's end may be displaced in short trials
BASIN_S = 0.06  # two starts whose ends differ by so much run to the same minimum
MOST_STARTS = 30  # on each side of zero


ABOUT = About(
    id="sample_rate",
    entry=Entry("`all`", "recorded force time = (1 + stretch) × true time", "`stretch`"),
    title="forces with a wrong sampling rate",
    sentence=(
        "The forces were sampled at another rate than the files say: they drift away from the markers."
    ),
    remedy=(
        "Check the rates of plates and cameras in the recording program, and that one clock drives both."
    ),
    told_apart_by=("a longer recording, with a foot stamped on a plate at its beginning and at its end"),
    branch="time/rate",
    odds_against=2.0,
    asked_up_to=10.0,
    readings=(
        Reading("stretch", "their time axis is {amount} too {which}", "%", 1e2, which=("long", "short")),
        Reading(
            "stretch", "they come {amount} {which} with every second", "ms", 1e3, which=("later", "earlier")
        ),
    ),
)


@dataclass(frozen=True)
class SampleRate(Candidate):
    """recorded force time = (1 + stretch) × true time, both zero at the trial's start.

    So true(t) = recorded((1 + stretch) t).
    """

    about = ABOUT

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Stretches from which the search begins; the closer together the longer the longest trial."""
        longest_s = max(scene.frames / scene.rate for scene in scenes)
        reach = float(np.clip(LAST_FRAME_S / longest_s, NEAREST_REACH, FARTHEST))
        between = min(BASIN_S / longest_s, 0.01)
        count = min(int(np.ceil(reach / between)), MOST_STARTS)
        return tuple((between * k,) for k in range(-count, count + 1))

    def prior(self, scenes: Sequence[Scene]) -> tuple[tuple[float, float], ...]:
        """Around the rate that the file says."""
        return ((0.0, PRIOR_STD),)

    def steps(self) -> Eta:
        """Dimensionless."""
        return (0.001,)

    def admissible(self, eta: Eta) -> bool:
        """Within what is not another rate altogether."""
        return abs(eta[0]) <= FARTHEST

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The recording read at stretched times less the recording itself; a spline does not smooth it."""
        if not scene.plates:
            return None
        stretched = scene.retimed(lambda times: times[0] + (1 + eta[0]) * (times - times[0]))
        return Signature(np.zeros((scene.frames, 6, 0)), np.zeros(0), stretched - scene.measured_ground)

    def unrecorded(self, scene: Scene, eta: Eta) -> Bool[np.ndarray, " frames"]:
        """Those that the right clock puts outside the recording."""
        return scene.unrecorded(lambda times: times[0] + (1 + eta[0]) * (times - times[0]))

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "0"],
        covariance: Float[np.ndarray, "0 0"],
    ) -> dict[str, Estimate]:
        """Stretch, dimensionless; positive when the forces come later and later."""
        return {"stretch": Estimate(eta[0], eta_std[0])}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what clocks of sound equipment differ by, and rounded time columns."""
        return abs(estimates["stretch"].value) > LEAST


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One clock for all plates."""
    return [SampleRate("all")] if any(scene.plates for scene in scenes) else []
