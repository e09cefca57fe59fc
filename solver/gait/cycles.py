"""Gait cycles, from contact to the next contact of the same foot, and the figures of each."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from solver.common.frames_at_once import by_frames
from solver.gait.foot_motion import FootMotion
from solver.gait.gait_events import Stance
from solver.gait.settings import FLAT_FROM, FLAT_TO

BELT_WINDOW_S = 0.5  # [s] over which stances are averaged for a belt's speed
WALKING_M_S = 0.2  # [m/s] people who walk at home alone go 0.2 to 0.4 m/s; slower, no cycle counts
LONGEST_CYCLE_S = 2.5  # [s] slow walks of patients reach 2 s; beyond, a step is missing

WEIGHTLESS = 9.0  # windows beyond the nearest value: a weight of 1e-18, below what a number holds


@dataclass(frozen=True)
class Cycle:
    """One stride. Lengths are over the surface: on a treadmill, the belt's travel is in them.

    Definitions: Perry & Burnfield 2010, Gait Analysis; Whittle 2007. Progression is the direction from this
    heel at the first to the same heel at the second contact; a heel is the origin of the foot's body.
    """

    foot: int
    start_s: float  # contact
    off_s: float | None  # foot-off
    end_s: float  # next contact of the same foot
    stride_length_m: float
    step_length_m: (
        float | None
    )  # of this foot: ahead of the other's heel at that one's contact before the end
    step_width_m: float | None  # across, between the same two heels

    @property
    def duration_s(self) -> float:
        """Stride time."""
        return self.end_s - self.start_s

    @property
    def cadence_per_min(self) -> float:
        """Steps a minute, two a stride."""
        return 120.0 / self.duration_s

    @property
    def speed_m_s(self) -> float:
        """Stride length over stride time."""
        return self.stride_length_m / self.duration_s

    @property
    def stance_share(self) -> float | None:
        """From contact to foot-off, of the stride."""
        return None if self.off_s is None else (self.off_s - self.start_s) / self.duration_s


def cycles_of(
    stances: Sequence[Stance],
    motion: FootMotion,
    heels_ground: Sequence[Float[np.ndarray, "frames 3"]],
    times: Float[np.ndarray, " frames"],
) -> tuple[Cycle, ...]:
    """The cycles of all feet while the person walks or runs, in order of their beginnings.

    Args:
        stances: of all feet.
        motion: of the feet, for the surface and the pace.
        heels_ground: origins of the foot bodies [m], at the frames.
        times: of the frames [s].
    """
    surface = _belt(stances, motion)
    travel = np.zeros_like(surface)
    travel[1:] = np.cumsum(np.diff(motion.times)[:, None] * surface[:-1], axis=0)

    def heel(foot: int, time: float) -> Float[np.ndarray, "2"]:
        place = [np.interp(time, times, heels_ground[foot][:, axis]) for axis in (0, 2)]
        return np.array(place) - [np.interp(time, motion.times, travel[:, axis]) for axis in range(2)]

    found = []
    for foot in range(len(heels_ground)):
        own = sorted(
            (s for s in stances if s.foot == foot and s.contact_s is not None),
            key=lambda s: s.contact_s or 0.0,
        )
        for one, following in pairwise(own):
            start, end = one.contact_s, following.contact_s
            assert start is not None
            assert end is not None
            stride = heel(foot, end) - heel(foot, start)
            length = float(np.linalg.norm(stride))
            if end - start > LONGEST_CYCLE_S or length < WALKING_M_S * (end - start):
                continue
            others = [
                (s.contact_s, s.foot)
                for s in stances
                if s.foot != foot and s.contact_s is not None and start < s.contact_s < end
            ]
            step = width = None
            if others and length > 0:
                time, other = max(others)
                ahead = heel(foot, end) - heel(other, time)
                forward = stride / length
                step = float(ahead @ forward)
                width = float(abs(ahead[0] * forward[1] - ahead[1] * forward[0]))
            found.append(Cycle(foot, start, one.off_s, end, length, step, width))
    return tuple(sorted(found, key=lambda cycle: (cycle.start_s, cycle.foot)))


def _belt(stances: Sequence[Stance], motion: FootMotion) -> Float[np.ndarray, "steps 2"]:
    """The surface's velocity from the soles amid their stances [m/s]; zero on a floor.

    Later in a stance a foot rolls over its toes, and a rigid sole's lowest corner is faster than the belt.
    """
    if not motion.surface.any():
        return motion.surface
    first, last = FLAT_FROM, FLAT_TO
    at, found = [], []
    for stance in stances:
        if stance.contact_s is None or stance.off_s is None:
            continue
        lasts = stance.off_s - stance.contact_s
        flat = (motion.times > stance.contact_s + first * lasts) & (
            motion.times < stance.contact_s + last * lasts
        )
        if flat.any():
            at.append(stance.contact_s + (first + last) / 2 * lasts)
            found.append(np.median(motion.sole[flat, stance.foot], axis=0))
    if not found:
        return motion.surface
    places, speeds = np.array(at), np.array(found)
    return by_frames(lambda times: mean_nearby(times, places, speeds, BELT_WINDOW_S), motion.times)


def mean_nearby(
    times: Float[np.ndarray, " steps"],
    at: Float[np.ndarray, " values"],
    values: Float[np.ndarray, "values 2"],
    window_s: float,
) -> Float[np.ndarray, "steps 2"]:
    """Means of what lies near in time; where nothing is near, the nearest.

    Args:
        times: ascending [s].
        at: where the values are [s].
        values: at these times.
        window_s: standard deviation of the weights [s].
    """
    order = np.argsort(at)
    at, values = at[order], values[order]
    nearest = np.abs(times - at[np.searchsorted((at[1:] + at[:-1]) / 2, times)]).max()
    reach = nearest + WEIGHTLESS * window_s
    near = (at >= times[0] - reach) & (at <= times[-1] + reach)
    distance = (times[:, None] - at[near]) / window_s
    weight = np.exp(-(distance**2 - (distance**2).min(axis=1, keepdims=True)) / 2)
    return (weight @ values[near]) / weight.sum(axis=1, keepdims=True)
