"""What a cause is to the diagnosis: a signature in the wrench balance, and parameters.

With a candidate the balance of a trial reads

    required(motion) − measured − fixed(η) − columns(η) x  =  what is left,

forces in newtons and moments about the ground origin in newton metres, frame by frame. x are parameters that
act linearly and have a Gaussian prior; η are the few that do not (a time shift, a frequency), given as starts
for a search. A cause that changes the inertia of the body or its motion is written the same way, with the
change of the required wrench and its sign turned. One cause, one file; what is to
say about it stands there as well (`about`).
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import inf
from typing import ClassVar, Self

import numpy as np
from jaxtyping import Bool, Float

from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.observed_trial import PlateScene, Scene, loaded_plates

Eta = tuple[float, ...]  # values of the parameters that do not act linearly
Turn = tuple[int, ...]  # a turn or mirror of x and z seen from above, its matrix row by row
Paths = Mapping[str, Mapping[Turn, float]]  # by plate: how much better its pressures go with the foot [nats]
NO_PATHS: Paths = {}


@dataclass(frozen=True)
class Estimate:
    """A parameter's value and its standard deviation, in the unit that its name carries."""

    value: float
    std: float


@dataclass(frozen=True)
class Nonlinear:
    """A parameter that does not act linearly: where the search for it begins, and what it may be."""

    name: str
    starts: tuple[float, ...]
    step: float  # the first one of the search
    bounds: tuple[float, float]
    prior: tuple[float, float] | None = None  # mean and standard deviation; None: those of the starts


@dataclass(frozen=True, eq=False)
class Fitted:
    """A cause as a fit has it: values and standard deviations of η, and x with its covariance."""

    eta: Eta
    eta_std: Eta
    x: Float[np.ndarray, " parameters"]
    covariance: Float[np.ndarray, "parameters parameters"]

    def estimate(self, k: int) -> Estimate:
        """The k-th entry of x."""
        return Estimate(float(self.x[k]), float(np.sqrt(self.covariance[k, k])))

    def ratio(self, k: int) -> Estimate:
        """The k-th entry of x over the first: a lever, where these are a moment and a force."""
        first = float(self.x[0])
        divisor = np.copysign(max(abs(first), 1e-6), first)
        value = float(self.x[k]) / divisor
        gradient = np.array([-value, 1.0]) / divisor
        both = self.covariance[np.ix_([0, k], [0, k])]
        return Estimate(float(value), float(np.sqrt(gradient @ both @ gradient)))


@dataclass(frozen=True, eq=False)
class Signature:
    """What a cause adds to the measured wrench of one trial (force, moment about the ground origin)."""

    columns: Float[np.ndarray, "frames 6 parameters"]
    prior_std: Float[np.ndarray, " parameters"]
    fixed: Float[np.ndarray, "frames 6"] | None = None

    @staticmethod
    def of_fixed(fixed: Float[np.ndarray, "frames 6"]) -> "Signature":
        """Of a cause without parameters that act linearly."""
        return Signature(np.zeros((len(fixed), 6, 0)), np.zeros(0), fixed)

    @staticmethod
    def join(pieces: "Iterable[Signature]") -> "Signature | None":
        """Pieces of one signature side by side; None where there are none."""
        some = list(pieces)
        if not some:
            return None
        return Signature(
            np.concatenate([p.columns for p in some], axis=2),
            np.concatenate([p.prior_std for p in some]),
            next((p.fixed for p in some if p.fixed is not None), None),
        )


@dataclass(frozen=True)
class Range:
    """Frames of one trial on which a cause acts; 0-based, `end` excluded."""

    trial: str
    start: int
    end: int


def in_view(ranges: Iterable[Range], scenes: Sequence[Scene]) -> tuple[Range, ...]:
    """Without ends on which no marker was seen; what acts all along is left as it is."""
    seen = {}
    for scene in scenes:
        there = np.flatnonzero(np.isfinite(scene.markers.observed_ground).all(axis=2).any(axis=1))
        seen[scene.name] = (scene.frames, there[0], there[-1] + 1) if len(there) else (scene.frames, 0, 0)
    cut = []
    for one in ranges:
        frames, first, end = seen[one.trial]
        all_along = one.end - one.start >= frames
        cut.append(one if all_along else Range(one.trial, max(one.start, int(first)), min(one.end, int(end))))
    return tuple(one for one in cut if one.start < one.end)


@dataclass(frozen=True)
class Candidate(ABC):
    """One cause at one target, ready to be tried on a subject's trials.

    Trials share x: a plate, a clock, a body's mass are the same in all. A cause that belongs to one trial has
    a signature there alone.
    """

    target: str

    about: ClassVar[About] = About("")
    parameters: ClassVar[tuple[str, ...]] = ()  # names of x
    nonlinear: ClassVar[tuple[Nonlinear, ...]] = ()  # of η
    no_effect: ClassVar[float] = 0.0  # what the parameters are where the cause is not there
    least: ClassVar[float] = 0.0  # size below which nobody would act, in the parameters' unit
    most: ClassVar[float] = inf  # size from which on it is another cause

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> "list[Candidate]":
        """Of a subject's trials; unless it says otherwise one about all plates, where some are loaded."""
        return [cls("all")] if loaded_plates(scenes) else []

    @property
    def id(self) -> str:
        """Of the catalogue."""
        return self.about.id

    @property
    def less_at_first(self) -> float:
        """What less is asked of it as first cause [nats]."""
        return self.about.less_at_first

    @property
    def place_odds(self) -> float:
        """Log prior odds against it at its place, among those of its kind [nats]."""
        return 0.0

    @property
    def seen_elsewhere(self) -> float:
        """Log evidence for or against it from outside the wrench balance [nats]."""
        return 0.0

    def with_evidence(self, paths: Paths) -> Self:
        """The same, knowing what each plate's path of pressure says by itself."""
        return self

    @property
    def key(self) -> tuple[str, str]:
        """Id and target: what a name consists of."""
        return self.id, self.target

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Where the search over η begins; one empty tuple where all acts linearly."""
        return tuple(product(*(one.starts for one in self.nonlinear)))

    def steps(self) -> Eta:
        """First step of the search over each η."""
        return tuple(one.step for one in self.nonlinear)

    def prior(self, scenes: Sequence[Scene]) -> tuple[tuple[float, float], ...]:
        """Mean and standard deviation of each η before the data; those of the starts unless it says."""
        starts = np.array(self.starts(scenes)).T
        own = [one.prior for one in self.nonlinear] or [None] * len(starts)
        return tuple(
            known or (float(each.mean()), float(each.std()) or 1.0)
            for each, known in zip(starts, own, strict=True)
        )

    def admissible(self, eta: Eta) -> bool:
        """Whether η lies within its bounds."""
        pairs = zip(self.nonlinear, eta, strict=False)
        return all(one.bounds[0] <= value <= one.bounds[1] for one, value in pairs)

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """Whether there can be such a cause, whatever its size; the search over η stays among those."""
        return True

    def plate_factors(self) -> dict[str, float]:
        """By plate, how many times the true weight it says that the plate reads, where that is a claim."""
        return {}

    def lifted_N(self, trial: str, estimates: dict[str, Estimate]) -> float:
        """Weight of the person that it says no plate bears, all through a trial [N]."""
        return 0.0

    @abstractmethod
    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """In one trial; None where the cause does not touch it."""

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """The signature, some columns after others: a long trial's would fill the memory where they are many.

        The fixed part comes with one of them.
        """
        whole = self.signature(scene, eta)
        if whole is not None:
            yield whole

    def unrecorded(self, scene: Scene, eta: Eta) -> Bool[np.ndarray, " frames"]:
        """Frames of which nothing is known once the recording is corrected; none unless it says otherwise."""
        return np.zeros(scene.frames, dtype=bool)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """The catalogue's parameters, by name; x and η as they are unless it says otherwise."""
        linear = {name: fit.estimate(k) for k, name in enumerate(self.parameters)}
        pairs = zip(self.nonlinear, fit.eta, fit.eta_std, strict=True)
        return linear | {one.name: Estimate(value, std) for one, value, std in pairs}

    def size(self, estimates: dict[str, Estimate]) -> float:
        """How far the parameters are from no effect: what is held against `least` and `most`."""
        return float(np.linalg.norm([e.value - self.no_effect for e in estimates.values()]))

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Whether the cause is larger than the practical minimum; below it nobody would act."""
        return self.is_possible(estimates) and self.least < self.size(estimates) < self.most

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """Where it acts; all frames of all trials unless it says otherwise."""
        return tuple(Range(s.name, 0, s.frames) for s in scenes)


@dataclass(frozen=True)
class OfOnePlate(Candidate):
    """A cause at one plate, wherever that is loaded."""

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One for each loaded plate."""
        return [cls(target) for target in loaded_plates(scenes)]

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Of the plate; None where nothing loads it."""
        plate = scene.loaded_plate(self.target)
        return None if plate is None else self.of_plate(plate, scene, eta)

    @abstractmethod
    def of_plate(self, plate: PlateScene, scene: Scene, eta: Eta) -> Signature | None:
        """What it adds to the measured wrench of a trial in which the plate is loaded."""


@dataclass(frozen=True)
class InTrials(Candidate):
    """A cause that is there in one trial, or in all: a band is tied for a run and taken off again."""

    trial: str | None = None  # in which it is there; None: in all

    def own(self, scenes: Sequence[Scene]) -> tuple[Scene, ...]:
        """Trials in which it is there."""
        return tuple(s for s in scenes if self.trial in (None, s.name))

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """All frames of its trials."""
        return tuple(Range(s.name, 0, s.frames) for s in self.own(scenes))


def all_and_each(scenes: Sequence[Scene]) -> list[str | None]:
    """Which trials such a cause may be in: all of them, and each alone where there are several."""
    return [None, *(s.name for s in scenes)] if len(scenes) > 1 else [None]


class InPieces(Candidate):
    """A cause of so many parameters that its columns are made some at a time."""

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """All pieces together."""
        return Signature.join(self.pieces(scene, eta))

    @abstractmethod
    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """In one trial; nothing where the cause does not touch it."""


class Corrected(Candidate):
    """A cause that reading the files already undid: the balance lacks it, and it is still to be named."""

    @abstractmethod
    def uncorrected_ground(self, scene: Scene) -> Float[np.ndarray, "frames 6"]:
        """Wrench of all plates together as it would be with the cause left in [N], [N·m]."""
