"""Every kind of fault, with the sizes it is drawn at and the recordings that can show it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.faults.editor import clocks, harmless, markers, people, plates
from benchmarks.faults.editor.fault import Edit

WALKS = ("walk", "run")
MOVING = ("walk", "run", "jump", "squat")
ANY = ("walk", "run", "jump", "squat", "stand")
CLEAN = "clean"


@dataclass(frozen=True)
class Kind:
    """One kind of fault."""

    name: str
    draw: Callable[[np.random.Generator], Edit]
    cases: int  # of a draw
    activities: Sequence[str] = ANY
    trials: int | None = None  # that a recording must have; None: one or more


def _either(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def _two_lags(rng: np.random.Generator) -> Edit:
    first = rng.uniform(0.005, 0.03)
    return clocks.late([first, first + rng.uniform(0.006, 0.03)])


KINDS = (
    Kind("tared_under_load", lambda r: plates.tared_under_load(r.uniform(300, 1000), _either(r, 0, 0.1)), 4),
    Kind(
        "zero_level",
        lambda r: plates.zero_level((_either(r, 5, 30), _either(r, 60, 200), _either(r, 5, 30))),
        3,
    ),
    Kind("turned_half", lambda r: plates.turned(180.0), 3, MOVING),
    Kind("turned_quarter", lambda r: plates.turned(float(r.choice([-90.0, 90.0]))), 3, MOVING),
    Kind("mirrored", lambda r: plates.mirrored(int(r.choice([0, 2]))), 3, MOVING),
    Kind("shifted", lambda r: plates.shifted(r.uniform(0.12, 0.25), r.uniform(0, 360)), 4),
    Kind("pounds", lambda r: plates.pounds(), 3),
    Kind("half_gain", lambda r: plates.gain(0.5), 3),
    Kind("quarter_gain", lambda r: plates.gain(0.25), 2),
    Kind("sign", lambda r: plates.sign(), 3),
    Kind("exchanged_plates", lambda r: plates.exchanged(), 2, ("walk", "squat", "stand")),
    Kind("late", lambda r: clocks.late([r.uniform(0.015, 0.15)]), 4, MOVING, 1),
    Kind("two_lags", _two_lags, 2, MOVING, 2),
    Kind("one_plate_late", lambda r: clocks.one_plate_late(r.uniform(0.015, 0.06)), 2, WALKS),
    Kind("drift", lambda r: clocks.drifting(_either(r, 0.012, 0.04)), 2, WALKS, 1),
    Kind("filtered", lambda r: clocks.smoothed(r.uniform(4.0, 6.0)), 3, WALKS),
    Kind("lost_step", lambda r: plates.lost_step(), 4, WALKS),
    Kind(
        "object_on_plate",
        lambda r: plates.standing_object(r.uniform(6, 10), _either(r, 0.15, 0.25)),
        3,
        ANY,
    ),
    Kind("other_mass", lambda r: people.somebody_elses_mass(float(r.choice([0.8, 1.25]))), 3),
    Kind("support", lambda r: people.supported(r.uniform(0.1, 0.3)), 2, ("walk", "stand")),
    Kind("marker_slip", lambda r: markers.slipped(r.uniform(0.025, 0.045)), 3),
    Kind("exchanged_labels", lambda r: markers.labels_exchanged(r.uniform(0.3, 0.6)), 3),
    Kind("cloth", lambda r: markers.carried_by_cloth(r.uniform(0.02, 0.035)), 3),
)
HARMLESS = (
    lambda r: harmless.as_it_is(),
    lambda r: harmless.axes_turned(float(r.uniform(0, 360)), *r.uniform(-2, 2, 2)),
    lambda r: harmless.part(float(r.uniform(0.0, 0.15)), float(r.uniform(0.85, 1.0))),
    lambda r: harmless.fewer_force_samples(),
)
