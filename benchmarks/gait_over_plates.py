"""Puppets walk and run over plates, also over edges of these: when each foot lands and leaves is known."""

import pickle
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.stats import norm, truncnorm

from benchmarks.activities.performed import STEP_LEGS, STEP_S
from benchmarks.activities.puppets import CHILDREN, Plant, Puppet, earlier, puppet, steps
from benchmarks.activities.simulated import ADULTS, FEET
from benchmarks.gait_belts import corners_of
from benchmarks.gait_events import EDGE_S, Told, Verdict, harm, matched
from solver.capture.capture import ForcePlate
from solver.capture.force_settings import CONDITIONING
from solver.gait.events import Stance, events_of, stances_from_feet, stances_from_plates, stances_of_both
from solver.gait.foot_motion import foot_motion
from solver.gait.settings import GAIT, GaitSettings
from solver.gravity import GRAVITY

GROWN_UP, YOUNG = range(300, 306), range(400, 404)  # seeds of persons
PLATE_RATE = 1000.0  # [Hz]
PLATE_M = (0.4, 0.9)  # usual lengths along the walkway; three lie in a row
SEAM_M = 0.005  # between two
UNDER_FOOT_M = (0.03, 0.05)  # RMS of the pressure about its centre, along the foot
BESIDE_M = 0.025  # likewise across
ASIDE_M = (-0.06, 0.08)  # from the middle of a foot to the plates' side: some feet stand there by their edge
NOISE_N = 1.5
SHAKES_N, SHAKES_HZ, SHAKES_S = (3.0, 30.0), (30.0, 60.0), 0.05  # of a plate, when a foot lands anywhere
LEAST_N = 10.0  # for a centre of pressure


@dataclass(frozen=True, eq=False)
class OverPlates:
    """Somebody over three plates, and when the feet really land and leave."""

    person: str
    corners: list[Float[np.ndarray, "frames corners 3"]]
    times: Float[np.ndarray, " frames"]
    plates: tuple[ForcePlate, ...]
    by_feet: tuple[Stance, ...]
    truth: list[Told]

    def told(self, settings: GaitSettings) -> list[Told]:
        """Events from plates and feet."""
        by_force = stances_from_plates(self.plates, self.corners, self.times, settings, CONDITIONING)
        events = events_of(stances_of_both(by_force, self.by_feet))
        return [Told(FEET[e.foot], e.kind.value, e.time_s) for e in events]

    def harm(self, told: Sequence[Told]) -> float:
        """As of recordings."""
        return harm(verdict_on(self.truth, told, float(self.times[-1])))


def verdict_on(truth: Sequence[Told], told: Sequence[Told], end_s: float) -> Verdict:
    """On events of which all are known, but for a recording's ends."""

    def inner(events: Sequence[Told]) -> list[Told]:
        return [event for event in events if EDGE_S < event.time_s < end_s - EDGE_S]

    errors, missed, _ = matched(inner(truth), told)
    taken = matched(truth, told)[2]
    extra = [e for k, e in enumerate(told) if k not in taken and inner([e])]
    return Verdict(errors, missed, [f"{e.foot} {e.kind} at {e.time_s:.2f} s" for e in extra], 0)


def events_of_plants(plants: Sequence[Plant], duration: float) -> list[Told]:
    """When feet land and leave within a trial."""
    return [
        Told(FEET[plant.foot], kind, time)
        for plant in plants
        for kind, time in (("contact", plant.start), ("foot-off", plant.end))
        if 0 < time < duration
    ]


@cache
def over_plates(kept: Path) -> tuple[OverPlates, ...]:
    """Adults and children, each walks twice and runs once.

    Args:
        kept: folder in which they are kept.
    """
    file = kept / "plates.pickle"
    if not file.exists():
        people = [*((seed, ADULTS) for seed in GROWN_UP), *((seed, CHILDREN) for seed in YOUNG)]
        made = [one for seed, among in people for one in _over_plates(seed, puppet(seed, among))]
        file.write_bytes(pickle.dumps(made))
    return tuple(pickle.loads(file.read_bytes()))


def _over_plates(seed: int, who: Puppet) -> Iterator[OverPlates]:
    rng = np.random.default_rng([seed, 2])
    quicker = np.sqrt(who.leg / 0.9)  # as pendulums are
    for runs in (False, False, True):
        step_s = quicker * (rng.uniform(0.34, 0.40) if runs else rng.uniform(*STEP_S))
        step_m = who.leg * (rng.uniform(0.9, 1.2) if runs else rng.uniform(*STEP_LEGS))
        double = float(rng.uniform(-0.4, -0.2)) if runs else 0.24
        lands = float(rng.uniform(-0.1, 0.2)) if runs else 0.25
        plants = earlier(steps([(step_m, 0.0)] * 12, step_s, lands=lands, double=double), 2.5 * step_s)
        duration = 8.5 * step_s
        motion = who.moved(plants, duration, rng)
        corners, p = corners_of(who.skeleton, FEET, motion.q)
        feet = foot_motion(corners, p[:, 0], motion.times, GAIT)
        yield OverPlates(
            f"person {seed}",
            corners,
            motion.times,
            tuple(_plates(who, plants, duration, rng, [float(c[..., 2].mean()) for c in corners])),
            stances_from_feet(feet, GAIT),
            events_of_plants(plants, duration),
        )


def _plates(
    who: Puppet, plants: Sequence[Plant], duration: float, rng: np.random.Generator, z: Sequence[float]
) -> Iterator[ForcePlate]:
    """Three in a row somewhere on the way; one foot may tread on their side, or beside them."""
    times = np.arange(round(duration * PLATE_RATE)) / PLATE_RATE
    inside = [p for p in plants if p.start > 0 and p.end < duration]
    step_s = inside[1].start - inside[0].start
    first = inside[0].x + float(rng.uniform(-0.5, 0.5))
    long, spread = float(rng.uniform(*PLATE_M)), float(rng.uniform(*UNDER_FOOT_M))
    borne_by = {int(rng.integers(2)): float(norm.cdf(rng.uniform(*ASIDE_M) / BESIDE_M))}
    for k in range(3):
        begin = first + k * (long + SEAM_M)
        loads = np.zeros((len(times), 3))  # vertical force, and it times x and z
        for plant in inside:
            lasts = plant.end - plant.start
            share = (times - plant.start) / lasts
            on = (share > 0) & (share < 1)
            centre = plant.x + who.heel[0] + (0.1 + 0.8 * share[on]) * (who.ball[0] + 0.04 - who.heel[0])
            low, high = (begin - centre) / spread, (begin + long - centre) / spread
            borne = (norm.cdf(high) - norm.cdf(low)) * borne_by.get(plant.foot, 1.0)
            force = _load(share[on], lasts < step_s) * who.skeleton.mass * GRAVITY * step_s / lasts * borne
            middle = np.clip(np.nan_to_num(truncnorm.mean(low, high)), low, high)
            loads[on] += force[:, None] * np.column_stack(
                [np.ones_like(centre), centre + spread * middle, np.full_like(centre, z[plant.foot])]
            )
        yield _plate(f"plate {k}", times, loads, plants, rng)


def _load(share: Float[np.ndarray, " times"], runs: bool) -> Float[np.ndarray, " times"]:
    """Over a stance, of mean 1: two humps of a walk, one of a run."""
    waves = np.sin(np.pi * share) + (0.0 if runs else 0.3) * np.sin(3 * np.pi * share)
    return np.asarray(waves / (2 / np.pi * (1.0 if runs else 1.1)))


def _plate(
    name: str,
    times: Float[np.ndarray, " samples"],
    loads: Float[np.ndarray, "samples 3"],
    plants: Sequence[Plant],
    rng: np.random.Generator,
) -> ForcePlate:
    """With noise, and shaken by each foot that lands."""
    read = loads[:, 0] + NOISE_N * rng.standard_normal(len(times))
    for plant in plants:
        since = np.maximum(times - plant.start, 0.0)
        size, hertz = rng.uniform(*SHAKES_N), rng.uniform(*SHAKES_HZ)
        read += (times > plant.start) * size * np.exp(-since / SHAKES_S) * np.sin(2 * np.pi * hertz * since)
    x, z = loads[:, 1:].T / np.maximum(loads[:, 0], 1e-9)
    force, cop = np.zeros((len(times), 3)), np.column_stack([x, np.zeros_like(x), z])
    force[:, 1] = read
    moment = np.cross(cop, force)
    cop[(read < LEAST_N) | (loads[:, 0] <= 0)] = np.nan
    return ForcePlate(name, force, moment, cop, PLATE_RATE)


def told_of_plates(kept: str) -> list[list[tuple[str, str, float]]]:
    """Events of every trial in this process, with the constants as they are here."""
    return [[(e.foot, e.kind, e.time_s) for e in one.told(GAIT)] for one in over_plates(Path(kept))]
