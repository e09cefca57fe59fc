"""A synthetic subject: recorded with a laboratory's faults, reviewed, in a folder; and what is true of it."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.dataset.synthesis.movements import Laboratory, MadeUpPerson
from addb_viewer.jobs.review_store import open_log
from annotations.events import Edit, Event, FlagRange, SetActivity, SetStatus, Status
from annotations.label_runs import true_runs
from solver.capture.atomic import write_whole
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
from solver.simulate.simulated_sole import SIDES
from solver.simulate.simulated_trial import SyntheticTrial
from solver.simulate.subject_folder import write_forces
from solver.simulate.treadmill import belt_under, belts, on_treadmill, read_belts

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


REVIEWERS = ("reviewer A", "reviewer B")
BEGAN = datetime(2024, 1, 8, 9, 0, tzinfo=UTC)
REASON = "notOverForcePlate"


def said_of(trial: RecordedTrial, *, labelled: bool) -> list[Event]:
    """A right and finished review: steps beside the plates, and the activity where it is labelled.

    Args:
        trial: as recorded.
        labelled: whether somebody has said what the person does.
    """
    said: list[Event] = [
        FlagRange(start, end, REASON, foot)
        for k, foot in enumerate(FEET)
        for start, end in true_runs(trial.missed[:, k])
    ]
    if labelled:
        said.append(SetActivity(0, trial.capture.markers.frames, trial.activity, trial.subclass))
    return [*said, SetStatus(Status.FINISHED)]


def keep_reviews(folder: Path, said: Sequence[tuple[str, Event]]) -> None:
    """Write a subject's log; a reviewer takes every other trial.

    Args:
        folder: of the subject.
        said: trial and event, in order.
    """
    trials = list(dict.fromkeys(trial for trial, _ in said))
    edits = [
        Edit(
            number,
            trial,
            REVIEWERS[trials.index(trial) % len(REVIEWERS)],
            BEGAN + timedelta(minutes=number),
            event,
        )
        for number, (trial, event) in enumerate(said, start=1)
    ]
    with open_log(folder) as log:
        log.take_over(edits)


@dataclass(frozen=True)
class MadeTrial:
    """A trial, what reviewers say of it, and which trap it is."""

    recorded: RecordedTrial
    said: tuple[Event, ...]
    trap: str | None = None
    labelled: bool = False


@dataclass(frozen=True)
class MadeSubject:
    """A folder of a corpus."""

    laboratory: Laboratory
    person_name: str
    folder: str
    person: MadeUpPerson
    mass_entered_kg: float
    static: RecordedTrial
    trials: tuple[MadeTrial, ...]
    faults: tuple[str, ...] = ()
    trap: str | None = None
    consent: str | None = "public"
    licence: str | None = None  # None: the laboratory's
    feet: tuple[str, ...] = FEET

    @property
    def subject_id(self) -> str:
        """As a release calls it, and where its folder is in the corpus."""
        return f"{self.laboratory.source}/{self.folder}"

    @property
    def person_id(self) -> str:
        """Likewise."""
        return f"{self.laboratory.source}/{self.person_name}"


def write_subject_folder(root: Path, subject: MadeSubject) -> Path:
    """Recordings, description and reviews; nothing in it tells that, or how, it was made.

    Args:
        root: of the corpus.
        subject: to be written.
    """
    folder = root / subject.subject_id
    folder.mkdir(parents=True, exist_ok=True)
    for trial in (subject.static, *(made.recorded for made in subject.trials)):
        write_trial(folder, trial)
    write_whole(folder / "subject.toml", _description(subject))
    keep_reviews(folder, [(made.recorded.name, event) for made in subject.trials for event in made.said])
    return folder


def write_truth(folder: Path, subject: MadeSubject) -> dict[str, Any]:
    """Arrays of each trial as NAME.npz below the truth's folder; what one file of the corpus says of it.

    Args:
        folder: of the truth.
        subject: whose.
    """
    place = folder / subject.subject_id
    place.mkdir(parents=True, exist_ok=True)
    for made in subject.trials:
        arrays: dict[str, Any] = truth_of(made.recorded)
        np.savez_compressed(place / f"{made.recorded.name}.npz", **arrays)
    return {
        "subject_id": subject.subject_id,
        "person_id": subject.person_id,
        "place": subject.subject_id,
        "sex": subject.person.sex,
        "age_years": subject.person.age_years,
        "height_m": subject.person.height_m,
        "mass_kg": subject.person.mass_kg,
        "mass_entered_kg": subject.mass_entered_kg,
        "segment_masses_kg": _masses(subject),
        "faults": list(subject.faults),
        "trap": subject.trap,
        "trials": [_trial_truth(made) for made in subject.trials],
    }


def _masses(subject: MadeSubject) -> dict[str, float]:
    return {body.name: body.mass for body in subject.static.truth.body.skeleton.bodies}


def _trial_truth(made: MadeTrial) -> dict[str, Any]:
    one = made.recorded
    return {
        "name": one.name,
        "activity": one.activity,
        "activity_sub": one.subclass,
        "speed_m_s": one.truth.scenario.speed,
        "labelled": made.labelled,
        "rate_hz": one.rate,
        "frames": one.capture.markers.frames,
        "trap": made.trap,
    }


def _description(subject: MadeSubject) -> str:
    person = {
        "mass_kg": subject.mass_entered_kg,
        "height_m": subject.person.height_m,
        "sex": subject.person.sex,
        "age_years": subject.person.age_years,
        "foot_bodies": list(subject.feet),
        "static": f"{subject.static.name}.trc",
    }
    laboratory = subject.laboratory
    release = {
        "source": laboratory.source,
        "person": subject.person_name,
        "laboratory": laboratory.source.rsplit(" ", 1)[0],
        "licence": laboratory.licence if subject.licence is None else subject.licence or None,
        "consent": subject.consent,
        "citation": f"{laboratory.source}, made up",
    }
    tables: list[tuple[str | None, Mapping[str, object]]] = [(None, person), ("release", release)]
    for made in subject.trials:
        files = {"markers": f"{made.recorded.name}.trc"}
        if made.recorded.capture.plates:
            files["forces"] = f"{made.recorded.name}.mot"
        tables.append((f"trials.{made.recorded.name}", files))
    return "\n".join(_table(name, values) for name, values in tables)


def _table(name: str | None, values: Mapping[str, object]) -> str:
    lines = [] if name is None else [f"[{name}]"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in values.items() if value is not None]
    return "\n".join(lines) + "\n"
