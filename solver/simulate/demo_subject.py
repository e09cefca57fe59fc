"""The demo subject: someone walks over force plates, misses one of them, squats, and runs."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from solver.simulate.laboratory import (
    MeasurementSettings,
    Plate,
    measure,
    plates_under,
    stances_within,
    standing_plates,
)
from solver.simulate.person import Person, TrueBody, body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.simulate.subject_folder import write_subject

PAIRED_MARKERS = (
    *("FHD", "BHD", "SHO", "UPA", "ELB", "ELM", "FRM", "WRA", "WRB", "FIN", "ASI", "PSI"),
    *("TH1", "TH2", "TH3", "KNE", "TB1", "TB2", "TB3", "ANK", "MED", "HEE", "TOE", "MT5", "MT1"),
)
MARKERS = ("C7", "T10", "CLAV", "STRN", *(side + name for name in PAIRED_MARKERS for side in "RL"))
STATIC_MARKERS = (*MARKERS, "RKNM", "LKNM")


@dataclass(frozen=True)
class LateForces:
    """A hidden cause: the plates' clock runs behind the cameras' in every trial.

    The catalogue's `clock_offset`: recorded force(t) = true force(t − offset_s).
    """

    offset_s: float = 0.012  # [s] a little more than the usual latency of an amplifier


@dataclass(frozen=True)
class DemoTruth:
    """What really happened; kept by the caller, never written beside the recordings."""

    person: Person
    body: TrueBody
    trials: tuple[SyntheticTrial, ...]
    plates: dict[str, tuple[Plate, ...]]
    off_plate: dict[str, tuple[tuple[str, float, float], ...]]  # trial: (foot body, from, until [s])
    cause: LateForces | None = None  # what else is wrong with the laboratory


def write_demo_subject(
    folder: Path,
    rng: np.random.Generator,
    *,
    person: Person | None = None,
    settings: MeasurementSettings | None = None,
    trials: tuple[str, ...] = ("static", "walk", "squat", "run"),
    cause: LateForces | None = None,
) -> DemoTruth:
    """Make the demo subject's folder.

    Args:
        folder: to write into; made if it doesn't exist.
        rng: the same generator state gives the same files.
        person: who; None: a person of 71 kg and 1.74 m.
        settings: of the laboratory.
        trials: which of the four to make.
        cause: what is wrong with the laboratory besides the missed step; None: nothing.

    Returns:
        The truth behind the files.
    """
    who, equipment = person or Person(sex="female"), settings or MeasurementSettings()
    if cause is not None:
        equipment = replace(equipment, force_delay_s=cause.offset_s)
    body_rng, *trial_rngs = rng.spawn(1 + len(SCENARIOS))
    body = body_of(who, body_rng)
    made, captures = [], []
    plates: dict[str, tuple[Plate, ...]] = {}
    off_plate: dict[str, tuple[tuple[str, float, float], ...]] = {}
    for scenario, trial_rng in zip(SCENARIOS, trial_rngs, strict=True):
        if scenario.name not in trials:
            continue
        motion_rng, noise_rng = trial_rng.spawn(2)
        trial = simulate_trial(scenario, body, motion_rng)
        missed = (3,) if scenario.name == "walk" else ()
        plates[scenario.name] = _plates(trial, missed)
        off_plate[scenario.name] = _missed_stances(trial, missed)
        names = STATIC_MARKERS if scenario.name == "static" else MARKERS
        captures.append(measure(trial, plates[scenario.name], names, equipment, noise_rng))
        made.append(trial)
    write_subject(folder, who, captures)
    return DemoTruth(who, body, tuple(made), plates, off_plate, cause)


SCENARIOS = (
    Scenario("static", "stand", duration=1.5),
    Scenario("walk", "walk", duration=4.0),
    Scenario("squat", "squat", duration=5.0),
    Scenario("run", "run", duration=2.0),
)


def _plates(trial: SyntheticTrial, missed: tuple[int, ...]) -> tuple[Plate, ...]:
    contacts, scenario = trial.contacts, trial.scenario
    if scenario.activity == "stand":
        return ()
    if scenario.activity == "squat":
        return standing_plates(contacts)
    size = (0.60, 0.40) if scenario.activity == "walk" else (0.90, 0.60)
    return plates_under(contacts, (0.0, scenario.duration), missed=missed, size=size)


def _missed_stances(trial: SyntheticTrial, missed: tuple[int, ...]) -> tuple[tuple[str, float, float], ...]:
    inside = stances_within(trial.contacts, (0.0, trial.scenario.duration))
    return tuple((f"calcn_{'rl'[inside[k].foot]}", inside[k].start, inside[k].end) for k in missed)
