"""Trial clocks: the forces' clock differs from trial to trial."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.diagnosis.causes.about import About, Entry, Size
from solver.diagnosis.causes.clock_offset import FARTHEST_S, LEAST_S, STARTS_S
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.readings import OF_EACH_TRIAL, Reading
from solver.diagnosis.causes.scene import Scene

MOST_TRIALS = 3  # each has an offset that is searched beside the others
LEAST_APART_S = 0.004  # less apart they are one clock
TARGET = "each trial"

ABOUT = About(
    id="trial_clocks",
    entry=Entry(
        "`each trial`",
        "recorded force(t) = true force(t − offset), in each of two or three trials by another offset",
        "`offset_s TRIAL`",
    ),
    title="forces shifted in time by another amount in each trial",
    sentence="Forces and markers were started apart: the forces come too late or too early by another time "
    "in each trial.",
    remedy="Start cameras and plates by one trigger line, and look at what sets each trial's beginning.",
    told_apart_by="a foot stamped on a plate at the beginning of each trial",
    branch="time/clock of each trial",
    is_a_clock=True,
    odds_against=2.0,
    sizes=(Size("offset_s", 0.005, 0.05, 2.0, "amplifiers and triggers"),),
    readings=(
        Reading(
            f"offset_s {OF_EACH_TRIAL}",
            f"in {OF_EACH_TRIAL} the forces come {{amount}} {{which}}",
            "ms",
            1e3,
            which=("too late", "too early"),
        ),
    ),
    targets={TARGET: "each trial"},
)


@dataclass(frozen=True)
class TrialClocks(Candidate):
    """In each trial, recorded(t) = true(t − its own offset), for every plate."""

    trials: tuple[str, ...] = ()  # one η each, in this order

    about = ABOUT

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """The same in all trials; the search parts them [s]."""
        return tuple((offset,) * len(self.trials) for offset in STARTS_S)

    def steps(self) -> Eta:
        """[s]."""
        return (0.004,) * len(self.trials)

    def admissible(self, eta: Eta) -> bool:
        """Within what a trigger can be off."""
        return max(map(abs, eta)) <= FARTHEST_S

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Shifted less unshifted recording."""
        if scene.name not in self.trials:
            return None
        offset = self._of(scene, eta)
        shifted = scene.retimed(lambda times: times + offset)
        return Signature(np.zeros((scene.frames, 6, 0)), np.zeros(0), shifted - scene.measured_ground)

    def unrecorded(self, scene: Scene, eta: Eta) -> Bool[np.ndarray, " frames"]:
        """Those that the right clock puts outside the recording."""
        if scene.name not in self.trials:
            return np.zeros(scene.frames, dtype=bool)
        offset = self._of(scene, eta)
        return scene.unrecorded(lambda times: times + offset)

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "0"],
        covariance: Float[np.ndarray, "0 0"],
    ) -> dict[str, Estimate]:
        """offset_s of each trial; positive when its forces were recorded late."""
        return {
            f"offset_s {trial}": Estimate(value, std)
            for trial, value, std in zip(self.trials, eta, eta_std, strict=True)
        }

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """One of them beyond an amplifier's latency, and not one clock for all."""
        offsets = [e.value for e in estimates.values()]
        return max(map(abs, offsets)) > LEAST_S and max(offsets) - min(offsets) > LEAST_APART_S

    def _of(self, scene: Scene, eta: Eta) -> float:
        return eta[self.trials.index(scene.name)]


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """All trials together, where there are two or three."""
    trials = tuple(scene.name for scene in scenes if scene.plates)
    return [TrialClocks(TARGET, trials)] if 1 < len(trials) <= MOST_TRIALS else []
