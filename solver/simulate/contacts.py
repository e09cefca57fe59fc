"""Which foot stands where and when, and what the ground should do to it."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from solver.simulate.simulated_sole import SIDES, Sole

TimeHistory = Callable[[Float[np.ndarray, " times"]], Float[np.ndarray, " times"]]


@dataclass(frozen=True)
class Stance:
    """One foot on the ground from `start` to `end`.

    `load` is the wanted vertical force [N], `along` and `across` the wanted centre of pressure as shares of
    the sole (see `Sole.point`), each over time. Heel and forefoot stay put during their own part of the
    stance.
    """

    foot: int  # 0 right, 1 left
    start: float  # [s]
    end: float  # [s]
    origin_ground: Float[np.ndarray, "3"]  # of the sole's frame [m]
    yaw: float  # of the sole's x axis about +y [rad]
    load: TimeHistory
    along: TimeHistory
    across: TimeHistory
    heel_planted: tuple[float, float]  # [s]
    forefoot_planted: tuple[float, float]  # [s]

    def moved(self, heading: float, by: Float[np.ndarray, "3"]) -> "Stance":
        """The same stance turned about the ground's y axis [rad], then carried along."""
        return replace(
            self, origin_ground=about_vertical(heading) @ self.origin_ground + by, yaw=self.yaw + heading
        )

    def covers(self, times: Float[np.ndarray, " times"]) -> np.ndarray:
        """Whether the foot stands at those times."""
        return (times > self.start) & (times < self.end)

    def to_ground(self, points_sole: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """From the sole's frame to the ground's; a left foot's points are given as a right one's."""
        return self.origin_ground + (points_sole * self._mirror) @ about_vertical(self.yaw).T

    def to_sole(self, points_ground: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """The inverse of `to_ground`."""
        return ((points_ground - self.origin_ground) @ about_vertical(self.yaw)) * self._mirror

    @property
    def _mirror(self) -> Float[np.ndarray, "3"]:
        return np.array([1.0, 1.0, -1.0]) if SIDES[self.foot] == "l" else np.ones(3)


@dataclass(frozen=True)
class ContactPlan:
    """All stances of a trial.

    While both feet stand they push apart with `brace` times the product of their shares of the load. Stances
    lie in a frame that coincides with the ground's at time 0 and moves with the belt.
    """

    stances: tuple[Stance, ...]
    sole: Sole
    brace: float = 0.0  # [N]
    belt_velocity: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))  # [m/s]

    def moved(self, heading: float, by: Float[np.ndarray, "3"]) -> "ContactPlan":
        """The same contacts turned about the ground's y axis [rad], then carried along."""
        return replace(self, stances=tuple(stance.moved(heading, by) for stance in self.stances))

    def loads(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times feet"]:
        """Wanted vertical force on each foot [N]; zero off the ground."""
        loads = np.zeros((len(times), len(SIDES)))
        for stance in self.stances:
            on = stance.covers(times)
            loads[on, stance.foot] = stance.load(times[on])
        return loads

    def centres_of_pressure(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times feet 3"]:
        """Wanted centre of pressure under each foot, ground frame [m]; NaN off the ground."""
        cop = np.full((len(times), len(SIDES), 3), np.nan)
        for stance in self.stances:
            on = stance.covers(times)
            points = np.zeros((int(on.sum()), 3))
            points[:, 0] = self.sole.heel + stance.along(times[on]) * self.sole.length
            points[:, 2] = stance.across(times[on]) * self.sole.half_width
            cop[on, stance.foot] = stance.to_ground(points) + times[on, None] * self.belt_velocity
        return cop

    def shares(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times feet"]:
        """Part of the load on each foot; zero on both in flight."""
        loads = self.loads(times)
        total = loads.sum(axis=1, keepdims=True)
        return np.divide(loads, total, out=np.zeros_like(loads), where=total > 0)

    def flight(self, times: Float[np.ndarray, " times"]) -> np.ndarray:
        """Whether no foot touches the ground."""
        return ~np.any([stance.covers(times) for stance in self.stances], axis=0)


def about_vertical(angle: float) -> Float[np.ndarray, "3 3"]:
    """Rotation about +y [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
