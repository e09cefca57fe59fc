"""The force plates' clock against the cameras': late or early, for all plates or one, or of another rate."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from solver.diagnosis.causes.about import OF_EACH_TRIAL, About, Entry, Named, Plates, Reading, Size
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, Nonlinear, Signature
from solver.diagnosis.causes.observed_trial import Scene, Times

# One lies within half an impact of any offset: the evidence of a jump has other peaks beside the right one.
LATER_S = (0.004, 0.008, 0.015, 0.03, 0.045, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.185, 0.21, 0.24)
STARTS_S = (*(-s for s in reversed(LATER_S)), *LATER_S)
FARTHEST_S = 0.3  # that a trigger can be off
OFFSET = Nonlinear("offset_s", STARTS_S, step=0.004, bounds=(-FARTHEST_S, FARTHEST_S))
MOST_TRIALS = 3  # each has an offset that is searched beside the others
LEAST_APART_S = 0.004  # less apart they are one clock
TARGET = "each trial"
RATE_STD = 0.01  # a rate typed in wrongly or rounded; crystals agree to a ten-thousandth
FARTHEST = 0.06  # beyond, it is another rate altogether
NEAREST_REACH = 0.02  # is searched however long the trial
LAST_FRAME_S = 0.3  # how far the trial's end may be displaced in short trials
BASIN_S = 0.06  # two starts whose ends differ by so much run to the same minimum
MOST_STARTS = 30  # on each side of zero


@dataclass(frozen=True)
class Retimed(Candidate):
    """A cause after which the plates are to be read at other times than the frames'."""

    def read_at(self, times: Times, scene: Scene, eta: Eta) -> Times:
        """Times at which the plates recorded what belongs to those of the frames [s]."""
        return times + eta[0]

    def touches(self, scene: Scene) -> bool:
        """Whether it is in this trial."""
        return True

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The recording read at those times less the recording; a spline does not smooth it."""
        if not self.touches(scene):
            return None
        retimed = scene.retime(lambda times: self.read_at(times, scene, eta))
        return Signature.of_fixed(retimed - scene.measured_ground)

    def unrecorded(self, scene: Scene, eta: Eta) -> Bool[np.ndarray, " frames"]:
        """Those that the right clock puts outside the recording."""
        if not self.touches(scene):
            return np.zeros(scene.frames, dtype=bool)
        return scene.unrecorded(lambda times: self.read_at(times, scene, eta))

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One clock for all plates."""
        return [cls("all")] if any(scene.plates for scene in scenes) else []


@dataclass(frozen=True)
class ClockOffset(Retimed):
    """recorded(t) = true(t − offset_s), for every plate: true(t) = recorded(t + offset_s).

    Positive when the forces were recorded late. 1 ms costs about 1 % of body weight in walking.
    """

    about = About(
        id="clock_offset",
        entry=Entry("`all`", "recorded force(t) = true force(t − offset); positive: late", "`offset_s`"),
        title="forces shifted in time against the markers",
        sentence="Forces and markers are shifted in time: the forces come too late or too early.",
        remedy=(
            "Check the trigger line between cameras and plates. Forces 5 to 10 ms too late may be an "
            "amplifier's latency, too early the cameras'; more is a trigger, lost frames, or a filter "
            "that runs one way only."
        ),
        separate_by="a foot stamped on a plate at the beginning and at the end of the recording",
        branch="time/clock",
        is_a_clock=True,
        asked_up_to=40.0,
        sizes=(
            Size("offset_s", 0.005, 0.05, 2.0, "amplifiers and triggers; beyond, found by correlation alone"),
        ),
        readings=(
            Reading(
                "offset_s", "the forces come {amount} {which}", "ms", 1e3, which=("too late", "too early")
            ),
        ),
    )
    nonlinear = (OFFSET,)
    least = 0.002  # [s] amplifiers delay by as much


@dataclass(frozen=True)
class TrialClocks(Retimed):
    """In each trial, recorded(t) = true(t − its own offset), for every plate."""

    trials: tuple[str, ...] = ()  # one η each, in this order

    about = About(
        id="trial_clocks",
        entry=Entry(
            "`each trial`",
            "recorded force(t) = true force(t − offset), in each of two or three trials by another offset",
            "`offset_s TRIAL`",
        ),
        title="forces shifted in time by another amount in each trial",
        sentence=(
            "Forces and markers were started apart: the forces come too late or too early by another time "
            "in each trial."
        ),
        remedy="Start cameras and plates by one trigger line, and look at what sets each trial's beginning.",
        separate_by="a foot stamped on a plate at the beginning of each trial",
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

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """The same in all trials; the search parts them [s]."""
        return tuple((offset,) * len(self.trials) for offset in STARTS_S)

    def steps(self) -> Eta:
        """[s]."""
        return (OFFSET.step,) * len(self.trials)

    def admissible(self, eta: Eta) -> bool:
        """Within what a trigger can be off."""
        return max(map(abs, eta)) <= FARTHEST_S

    def read_at(self, times: Times, scene: Scene, eta: Eta) -> Times:
        """By the trial's own offset."""
        return times + eta[self.trials.index(scene.name)]

    def touches(self, scene: Scene) -> bool:
        """Its trials alone."""
        return scene.name in self.trials

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """offset_s of each trial; positive when its forces were recorded late."""
        return {
            f"offset_s {trial}": Estimate(value, std)
            for trial, value, std in zip(self.trials, fit.eta, fit.eta_std, strict=True)
        }

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """One of them beyond an amplifier's latency, and not one clock for all."""
        offsets = [e.value for e in estimates.values()]
        return max(map(abs, offsets)) > ClockOffset.least and max(offsets) - min(offsets) > LEAST_APART_S

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """All trials together, where there are two or three."""
        trials = tuple(scene.name for scene in scenes if scene.plates)
        return [cls(TARGET, trials)] if 1 < len(trials) <= MOST_TRIALS else []


@dataclass(frozen=True)
class PlateClock(ClockOffset):
    """recorded(t) = true(t − offset_s) for one plate: true(t) = recorded(t + offset_s)."""

    about = About(
        id="plate_clock",
        entry=Entry(
            "`plate_k`", "recorded force(t) = true force(t − offset), of one plate alone", "`offset_s`"
        ),
        title="forces of {target} shifted in time against the other plates",
        sentence="The forces of {target} alone come too late or too early.",
        remedy=(
            "Compare this plate's amplifier and converter with the others': a filter that runs one "
            "way only, a lost sample, another trigger."
        ),
        separate_by="a foot stamped on each plate in turn",
        branch="time/clock of one plate",
        names=Named.PLATES,
        odds_against=4.0,
        sizes=(Size("offset_s", 0.01, 0.05, 0.3, "filters and triggers of one amplifier"),),
        readings=(
            Reading(
                "offset_s", "its forces come {amount} {which}", "ms", 1e3, which=("too late", "too early")
            ),
        ),
        picture=Plates(),
    )
    least = 0.004  # [s] amplifiers of one kind delay alike

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The plate shifted less unshifted; what was recorded at no such time stays as it is."""
        plate = scene.loaded_plate(self.target)
        if plate is None:
            return None
        shifted = plate.at_times(plate.loads.wrench_ground, plate.times + eta[0])
        unrecorded = self.unrecorded(scene, eta)
        shifted[unrecorded] = plate.wrench_ground[unrecorded]
        return Signature.of_fixed(np.nan_to_num(shifted) - plate.wrench_ground)

    def unrecorded(self, scene: Scene, eta: Eta) -> Bool[np.ndarray, " frames"]:
        """Those that the right clock puts outside the recording."""
        plate = scene.loaded_plate(self.target)
        if plate is None:
            return np.zeros(scene.frames, dtype=bool)
        return ~plate.covers(plate.times + eta[0])

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """Each plate, where several bear a load in some trial."""
        several = [[p.target for p in scene.plates if p.loaded.any()] for scene in scenes]
        return [cls(target) for target in dict.fromkeys(t for own in several if len(own) > 1 for t in own)]


@dataclass(frozen=True)
class SampleRate(Retimed):
    """recorded force time = (1 + stretch) × true time, both zero at the trial's start.

    So true(t) = recorded((1 + stretch) t); positive when the forces come later and later.
    """

    about = About(
        id="sample_rate",
        entry=Entry("`all`", "recorded force time = (1 + stretch) × true time", "`stretch`"),
        title="forces with a wrong sampling rate",
        sentence=(
            "The forces were sampled at another rate than the files say: they drift away from the markers."
        ),
        remedy=(
            "Check the rates of plates and cameras in the recording program, and that one clock drives both."
        ),
        separate_by=("a longer recording, with a foot stamped on a plate at its beginning and at its end"),
        branch="time/rate",
        is_a_clock=True,
        odds_against=2.0,
        asked_up_to=10.0,
        readings=(
            Reading("stretch", "their time axis is {amount} too {which}", "%", 1e2, which=("long", "short")),
            Reading(
                "stretch",
                "they come {amount} {which} with every second",
                "ms",
                1e3,
                which=("later", "earlier"),
            ),
        ),
    )
    nonlinear = (Nonlinear("stretch", (), step=0.001, bounds=(-FARTHEST, FARTHEST), prior=(0.0, RATE_STD)),)
    least = 0.002  # clocks of sound equipment, and rounded time columns

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Stretches from which the search begins; the closer together the longer the longest trial."""
        longest_s = max(scene.frames / scene.rate for scene in scenes)
        reach = float(np.clip(LAST_FRAME_S / longest_s, NEAREST_REACH, FARTHEST))
        between = min(BASIN_S / longest_s, 0.01)
        count = min(int(np.ceil(reach / between)), MOST_STARTS)
        return tuple((between * k,) for k in range(-count, count + 1))

    def touches(self, scene: Scene) -> bool:
        """Where there are plates."""
        return bool(scene.plates)

    def read_at(self, times: Times, scene: Scene, eta: Eta) -> Times:
        """At stretched times."""
        return times[0] + (1 + eta[0]) * (times - times[0])
