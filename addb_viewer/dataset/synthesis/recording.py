"""Records a movement in a laboratory with its faults, and keeps what really happened."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.dataset.synthesis.laboratories import Laboratory
from solver.capture.capture import Capture, ForcePlate
from solver.capture.formats.trc import write_trc
from solver.simulate.laboratory import (
    MeasurementSettings,
    Plate,
    measure,
    plates_under,
    stances_within,
    standing_plates,
)
from solver.simulate.sole import SIDES
from solver.simulate.subject_folder import write_forces
from solver.simulate.treadmill import belt_under, belts, on_treadmill, read_belts
from solver.simulate.trial import SyntheticTrial

FEET = tuple(f"calcn_{side}" for side in SIDES)
ON_THE_GROUND_N = 20.0
LATE_S = 0.012  # an amplifier's latency and a little more
NOISY = 3.0  # times the usual noise of markers
MANY_GAPS = 8.0  # a marker and minute
PLATE_SIZE_M = {"walk": (0.60, 0.40), "run": (0.90, 0.60), "landing": (0.60, 0.40)}
GAITS = ("walk", "run")


@dataclass(frozen=True)
class RecordedTrial:
    """What the files have of a trial, and what is true of it."""

    name: str
    truth: SyntheticTrial
    capture: Capture
    missed: Bool[np.ndarray, "frames feet"]  # a foot stands there and no plate measures it
    on_belt: bool

    @property
    def rate(self) -> float:
        """Of the cameras [Hz]."""
        return self.capture.markers.rate

    @property
    def activity(self) -> str:
        """In the words of the review."""
        return {"stand": "standing", "landing": "jump"}.get(
            self.truth.scenario.name, self.truth.scenario.name
        )

    @property
    def subclass(self) -> str | None:
        """Likewise."""
        if self.activity in GAITS:
            return "treadmill" if self.on_belt else "overground"
        return {"standing": "double support", "jump": "drop jump"}.get(self.activity)


def recorded(
    name: str,
    movement: SyntheticTrial,
    laboratory: Laboratory,
    faults: Sequence[str],
    rng: np.random.Generator,
    *,
    seconds: float | None = None,
) -> RecordedTrial:
    """Record a movement.

    Args:
        name: of the trial.
        movement: over ground.
        laboratory: in which.
        faults: `off_plate`: a step finds no plate; `late_clock`; `noise`.
        rng: of noise and gaps.
        seconds: that are recorded; None: all.
    """
    if seconds is not None:
        movement = replace(movement, scenario=replace(movement.scenario, duration=seconds))
    equipment = _equipment(laboratory, faults)
    activity = movement.scenario.name
    belt = laboratory.treadmill and activity in GAITS
    static = activity == "static"
    speed = movement.scenario.speed
    if belt and speed is not None:
        movement = on_treadmill(movement, belt_under(movement, speed))
    plates = () if static or belt else _plates(movement, laboratory, "off_plate" in faults)
    capture = measure(movement, plates, laboratory.markers(static=static), equipment, rng)
    forces: tuple[ForcePlate, ...] = capture.plates
    if belt:
        forces = read_belts(movement, belts(), equipment, rng)
    markers = replace(capture.markers, names=laboratory.labels(capture.markers.names))
    missed = _missed(movement, None if belt else plates, markers.rate, markers.frames)
    return RecordedTrial(name, movement, Capture(name, markers, forces), missed, belt)


def write_trial(folder: Path, trial: RecordedTrial) -> None:
    """Write NAME.trc and, where there are plates, NAME.mot."""
    write_trc(folder / f"{trial.name}.trc", trial.capture.markers)
    if trial.capture.plates:
        write_forces(folder / f"{trial.name}.mot", trial.capture.plates)


def truth_of(trial: RecordedTrial) -> dict[str, Float[np.ndarray, "..."]]:
    """Motion and wrenches at the cameras' frames: the arrays of the truth's file.

    `q` [rad, m] with `dofs`; `wrench_ground` of each foot, right first: force [N], moment about the ground
    origin [N·m]; `cop_ground` [m]; `missed`: a foot stands there and no plate measures it.
    """
    times = np.arange(trial.capture.markers.frames) / trial.rate
    reactions = trial.truth.reactions(times)
    return {
        "time_s": times,
        "q": trial.truth.motion.derivative(times, 0),
        "dofs": np.array(trial.truth.motion.dofs),
        "wrench_ground": reactions.wrench_ground,
        "cop_ground": reactions.cop_ground,
        "missed": trial.missed,
    }


def _equipment(laboratory: Laboratory, faults: Sequence[str]) -> MeasurementSettings:
    usual = replace(
        MeasurementSettings(), marker_rate=laboratory.marker_rate, force_rate=laboratory.force_rate
    )
    if "noise" in faults:
        usual = replace(usual, marker_noise_m=NOISY * usual.marker_noise_m, gaps_per_marker_minute=MANY_GAPS)
    return replace(usual, force_delay_s=LATE_S) if "late_clock" in faults else usual


def _plates(movement: SyntheticTrial, laboratory: Laboratory, off_plate: bool) -> tuple[Plate, ...]:
    contacts, activity = movement.contacts, movement.scenario.name
    if activity in ("squat", "stand", "landing"):
        return standing_plates(contacts)
    span = (0.0, movement.scenario.duration)
    steps = range(len(stances_within(contacts, span)))
    middle = len(steps) // 2
    missed = {middle} if off_plate else set()
    if laboratory.plates is not None:
        first = max(0, middle - laboratory.plates // 2)
        missed |= set(steps) - set(range(first, first + laboratory.plates))
    return plates_under(contacts, span, missed=sorted(missed), size=PLATE_SIZE_M[activity])


def _missed(
    movement: SyntheticTrial, plates: Sequence[Plate] | None, rate: float, frames: int
) -> Bool[np.ndarray, "frames feet"]:
    """Frames on which a foot bears load beside all plates; belts measure everything."""
    reactions = movement.reactions(np.arange(frames) / rate)
    loaded = reactions.force_ground[..., 1] > ON_THE_GROUND_N
    if plates is None:
        return np.zeros_like(loaded)
    held = [plate.holds(reactions.cop_ground) for plate in plates]
    return loaded & ~np.any(held, axis=0) if held else loaded
