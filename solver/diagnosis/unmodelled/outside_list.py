"""Whatever is on no list: unknown causes that compete with every name, told as what they touch.

The catalogue is never complete. Each of these stands for everything of a kind that might be wrong, known or
not: columns of the balance with a wide Gaussian prior and nothing else. Their freedom costs them evidence, so
that a right name of few parameters wins, and the nearest of wrong names does not.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.plate_figures import HALF_SIDE_M
from solver.diagnosis.causes.clocks import MOST_TRIALS
from solver.diagnosis.causes.contact_windows import contact_windows
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, InPieces, Range, Signature
from solver.diagnosis.causes.plate_readings import required_of
from solver.diagnosis.causes.scene import PlateScene, Scene, force_at
from solver.diagnosis.causes.time_history import Stretch
from solver.diagnosis.unmodelled.unknown_time_history import force_columns, moment_columns, time_histories_of

SIZES = (0.01, 0.05, 0.2, 0.8)  # of body weight, or of what a plate bears: standard deviations
SIZE_SHARES = (0.4, 0.3, 0.2, 0.1)  # how likely each is before the data
LEVER_M = 0.3  # of an unknown moment about the centre of mass
TIME_HISTORY_KNOTS_S = 0.5  # of what lasts
EVENT_KNOTS_S = 0.06  # of what happens once
LONGEST_EVENT_S = 1.5  # a longer one is a time history
MOST_EVENTS = 3  # of one trial, the strongest
CLOCK_S = 0.1  # of which the sizes are shares: 1 to 80 ms
LEAST_LOADED = 10  # frames on which a plate has to be loaded

BODY, EVENT, PLATE, TIME = "body", "event", "plate", "time"  # what it touches


@dataclass(frozen=True)
class Outside(Candidate):
    """Something that no entry of the catalogue is; its one η is its size."""

    trial: str | None = None  # in which it is; None: in all

    id = "outside_the_list"
    kind = BODY

    @property
    def words(self) -> str:
        """What it touches, where it stands beside a figure."""
        where = f" in {self.trial}" if self.trial else ""
        return {
            PLATE: f"{self.target}{where}",
            TIME: f"the time of {self.target}",
            EVENT: f"a moment{where}",
        }.get(self.kind, f"a force on the body{where}")

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Every size."""
        return tuple((size,) for size in SIZES)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """Root mean square of the force that it adds, where it acts [N]."""
        force = np.concatenate([self._force(s, fit.x) for s in scenes if self.trial in (None, s.name)])
        return {"rms_force_N": Estimate(float(np.sqrt((force**2).sum(axis=1).mean())), 0.0)}

    def _force(self, scene: Scene, x: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "some 3"]:
        force, acts, first = np.zeros((scene.frames, 3)), np.zeros(scene.frames, dtype=bool), 0
        for piece in self.pieces(scene, (SIZES[0],)):
            force += piece.columns[:, :3] @ x[first : first + len(piece.prior_std)]
            acts |= piece.columns.any(axis=(1, 2))
            first += len(piece.prior_std)
        return force[acts]

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Always: it competes, whatever its size."""
        return True

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """All of its trials unless it says otherwise."""
        return tuple(Range(s.name, 0, s.frames) for s in scenes if self.trial in (None, s.name))


@dataclass(frozen=True)
class AnyWrench(Outside, InPieces):
    """A wrench about the centre of mass: steady, or of a time history that changes within half a second."""

    knots_s: float | None = None  # None: steady

    sentence = "Something acts on the body that is on no list."

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Forces at the centre of mass and moments."""
        if scene.name == self.trial:
            steady = np.ones((scene.frames, 1))
            time_histories = steady if self.knots_s is None else time_histories_of(scene, self.knots_s)
            yield from _wrench_of_any(scene, time_histories, eta[0])


@dataclass(frozen=True)
class AnyEvent(Outside, InPieces):
    """A wrench of any time history that lasts a short while."""

    stretch: Stretch | None = None

    kind = EVENT
    sentence = "Something acts for a moment that is on no list."

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Likewise, within its stretch."""
        if self.stretch is not None and scene.name == self.trial:
            yield from _wrench_of_any(scene, self.stretch.humps(EVENT_KNOTS_S), eta[0])

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """Its stretch."""
        assert self.stretch is not None
        return (Range(self.stretch.trial, self.stretch.start, self.stretch.end),)


@dataclass(frozen=True)
class AnyPlateFault(Outside):
    """Whatever is wrong with one plate: while it is loaded a steady wrench, and any linear map of its load.

    The map acts on what the motion demands of the plate, never on what was recorded: that has the noise of
    the balance in it.
    """

    kind = PLATE
    sentence = "Something is wrong with {target} that is on no list."

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """About the plate's centre, then about the ground origin."""
        plate = _plate_of(scene, self.target)
        if plate is None or self.trial not in (None, scene.name) or plate.loaded.sum() < LEAST_LOADED:
            return None
        load = required_of(plate, scene)
        centre = np.broadcast_to(plate.centre_ground, (scene.frames, 3))
        load = (
            load - force_at(load[:, :3], centre) + np.pad(load[:, :3], ((0, 0), (0, 3)))
        )  # about the centre
        on = plate.loaded.astype(float)
        size, weight = eta[0], scene.weight_N
        unit = np.array([1.0, 1.0, 1.0, HALF_SIDE_M, HALF_SIDE_M, HALF_SIDE_M])
        columns, std = [], []
        for i in range(6):
            steady = np.zeros((scene.frames, 6))
            steady[:, i] = on
            columns.append(steady)
            std.append(size * weight * unit[i])
            for j in range(6):
                mapped = np.zeros((scene.frames, 6))
                mapped[:, i] = on * load[:, j]
                columns.append(mapped)
                std.append(size * unit[i] / unit[j])
        about_centre = np.stack(columns, axis=2)
        force = about_centre[:, :3].transpose(0, 2, 1)
        about_origin = force_at(force, np.broadcast_to(plate.centre_ground, force.shape)).transpose(0, 2, 1)
        about_origin[:, 3:] += about_centre[:, 3:]
        return Signature(about_origin, np.array(std))


@dataclass(frozen=True)
class AnyClock(Outside):
    """A trial's plates, or one of them, a little late or early."""

    kind = TIME
    sentence = "The time of {target} is off in a way that is on no list."

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """How fast the recorded wrench changes [N/s, N·m/s]."""
        if scene.name != self.trial:
            return None
        recorded = scene.measured_ground
        if self.target != self.trial:
            plate = _plate_of(scene, self.target.split(" in ")[0])
            if plate is None:
                return None
            recorded = plate.wrench_ground
        return Signature(
            np.gradient(recorded, 1 / scene.rate, axis=0)[:, :, None], np.array([eta[0] * CLOCK_S])
        )


def outside_the_list(scenes: Sequence[Scene]) -> list[Outside]:
    """One family a trial: a steady wrench, one that changes, events; every plate; clocks that differ."""
    found: list[Outside] = []
    several = len(scenes) > 1
    for scene in scenes:
        found.append(AnyWrench("", scene.name))
        found.append(AnyWrench("", scene.name, TIME_HISTORY_KNOTS_S))
        short = [w.stretch for w in contact_windows(scene) if w.stretch.seconds <= LONGEST_EVENT_S]
        found += [AnyEvent("", scene.name, stretch) for stretch in short[:MOST_EVENTS]]
        if len(scenes) > MOST_TRIALS:  # clocks of a few have names
            found.append(AnyClock(scene.name, scene.name))
        loaded = [p.target for p in scene.plates if p.loaded.sum() >= LEAST_LOADED]
        if several and len(loaded) > 1:  # so has a plate's in all of them
            found += [AnyClock(f"{target} in {scene.name}", scene.name) for target in loaded]
        if several:
            found += [AnyPlateFault(target, scene.name) for target in loaded]
    plates = dict.fromkeys(p.target for s in scenes for p in s.plates if p.loaded.sum() >= LEAST_LOADED)
    found += [AnyPlateFault(target) for target in plates]
    return found


def _wrench_of_any(
    scene: Scene, time_histories: Float[np.ndarray, "frames time histories"], size: float
) -> Iterator[Signature]:
    prior_std = np.full(time_histories.shape[1], size * scene.weight_N)
    for axis in range(3):
        yield Signature(force_columns(scene.com_ground, time_histories, axis), prior_std)
    for axis in range(3):
        yield Signature(moment_columns(time_histories, axis, LEVER_M), prior_std)


def _plate_of(scene: Scene, target: str) -> PlateScene | None:
    return next((p for p in scene.plates if p.target == target), None)
