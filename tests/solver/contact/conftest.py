"""Synthetic feet and plates: two feet that are carried about like blocks, and plates that feel them."""

from dataclasses import dataclass

import numpy as np
import pytest

from solver.capture.plates.conditioning import ConditionedPlate
from solver.contact.assignment import assign
from solver.contact.settings import ContactSettings
from solver.contact.wrenches import ContactWrenches
from solver.skeleton.functions import Linear
from solver.skeleton.skeleton import Axis, Body, Coordinate, Joint, Skeleton

RATE = 100.0  # [Hz]
ANKLE_HEIGHT = 0.085  # [m] above the sole; 0.3 times the foot's length of 0.283 m
BALL = 0.13  # [m] from the ankle to the ball of the foot, so a foot reaches from -0.071 to 0.212 m


@pytest.fixture(scope="session")
def feet() -> Skeleton:
    """Two shanks on the ground, each with a foot (its origin at the ankle) and toes."""
    bodies, joints, coordinates = [], [], []
    for side in ("r", "l"):
        shank = len(bodies)
        name = f"ankle_height_{side}"
        lift = (Axis("translation", np.array([0.0, 1.0, 0.0]), Linear(1.0, 0.0), name),)
        bodies += [_body(f"shank_{side}", 0.4), _body(f"calcn_{side}", 0.05), _body(f"toes_{side}", 0.03)]
        joints += [
            _joint(f"shank_{side}", -1, np.array([0.0, 0.5, 0.0]), lift),
            _joint(f"ankle_{side}", shank, np.array([0.0, -0.42, 0.0])),
            _joint(f"mtp_{side}", shank + 1, np.array([BALL, -0.05, 0.0])),
        ]
        coordinates.append(Coordinate(name, "translation", 0.0, (-5.0, 5.0)))
    return Skeleton("two feet", tuple(bodies), tuple(joints), tuple(coordinates), markers=())


def _body(name: str, com: float) -> Body:
    return Body(name, 1.0, np.array([com, 0.0, 0.0]), np.eye(3))


def _joint(name: str, parent: int, where: np.ndarray, axes: tuple[Axis, ...] = ()) -> Joint:
    return Joint(name, parent, np.eye(3), where, np.eye(3), np.zeros(3), axes)


@dataclass
class Scene:
    """Ankle positions of both feet over time (feet stay level, toes along x), and plates."""

    skeleton: Skeleton
    ankles: np.ndarray  # (frames, 2, 3)

    @property
    def times(self) -> np.ndarray:
        return np.arange(len(self.ankles)) / RATE

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        frames = len(self.ankles)
        p = np.zeros((frames, 6, 3))
        for side in range(2):
            ankle = self.ankles[:, side]
            p[:, 3 * side] = ankle + np.array([0.0, 0.42, 0.0])
            p[:, 3 * side + 1] = ankle
            p[:, 3 * side + 2] = ankle + np.array([BALL, -0.05, 0.0])
        return np.tile(np.eye(3), (frames, 6, 1, 1)), p

    def plate(
        self, name: str, loads: list[tuple[np.ndarray, np.ndarray]], noise: float = 0.0
    ) -> ConditionedPlate:
        """A plate that carries `loads`: vertical forces [N] by frame, each with the points it acts at."""
        rng = np.random.default_rng(1)
        force, moment = np.zeros((len(self.ankles), 3)), np.zeros((len(self.ankles), 3))
        for load, point in loads:
            push = np.column_stack([0.05 * load, load, -0.02 * load])
            force += push
            moment += np.cross(point, push)
        loaded = force[:, 1] > 20
        cop = np.full_like(force, np.nan)
        cop[loaded, 0] = moment[loaded, 2] / force[loaded, 1]
        cop[loaded, 1] = 0.0
        cop[loaded, 2] = -moment[loaded, 0] / force[loaded, 1]
        noisy = force + noise * rng.normal(size=force.shape)
        observed = np.ones(len(force), dtype=bool)
        return ConditionedPlate(name, force, moment, cop, loaded, observed, noisy, moment)

    def assigned(self, *plates: ConditionedPlate, **changed: float) -> ContactWrenches:
        return assign(
            plates,
            *self.poses(),
            skeleton=self.skeleton,
            foot_bodies=("calcn_r", "calcn_l"),
            times=self.times,
            settings=ContactSettings(**changed),
        )


@pytest.fixture
def standing(feet) -> Scene:
    """A second of standing with the feet 20 cm apart."""
    return Scene(feet, np.tile([[0.0, ANKLE_HEIGHT, 0.1], [0.0, ANKLE_HEIGHT, -0.1]], (100, 1, 1)))


@dataclass
class Walk(Scene):
    """Stances of 60 frames, each 15 of them with both feet down; `loads` and `under` follow each foot."""

    loads: np.ndarray  # (frames, 2)
    under: np.ndarray  # (frames, 2, 3) point of the foot that the ground pushes


@pytest.fixture
def walk(feet) -> Walk:
    """Four steps along x at 1.3 m/s: right, left, right, left."""
    return walking(feet, belt=0.0)


@pytest.fixture
def treadmill_walk(feet) -> Walk:
    """The same steps on a belt that runs backwards at 1.3 m/s, so that the body stays in place."""
    return walking(feet, belt=1.3)


def walking(feet: Skeleton, belt: float) -> Walk:
    frames, stance, half = 260, 60, 45
    t = np.arange(frames)
    ankles = np.zeros((frames, 2, 3))
    loads, roll = np.zeros((frames, 2)), np.zeros((frames, 2))
    for side, first in ((0, 5), (1, 5 + half)):
        ankles[:, side, 2] = 0.08 * (1 - 2 * side)
        starts = [first - 2 * half, first, first + 2 * half, first + 4 * half]
        for k, start in enumerate(starts):
            place = 0.585 * (2 * k + side)
            phase = (t - start) / stance
            on = (phase >= 0) & (phase <= 1)
            ankles[on, side] = [place, ANKLE_HEIGHT, ankles[0, side, 2]]
            if k not in (0, 3):
                loads[on, side] = 700 * np.sin(np.pi * phase[on]) ** 0.5
            roll[on, side] = -0.05 + 0.22 * phase[on]
            swing = (t > start + stance) & (t < start + 2 * half)
            s = (t[swing] - start - stance) / (2 * half - stance)
            ankles[swing, side, 0] = place + 1.17 * (s - np.sin(2 * np.pi * s) / (2 * np.pi))
            ankles[swing, side, 1] = ANKLE_HEIGHT + 0.08 * np.sin(np.pi * s)
    ankles[:, :, 0] -= belt * t[:, None] / RATE
    under = ankles + np.stack([roll, np.full_like(roll, -ANKLE_HEIGHT), 0 * roll], axis=2)
    under[..., 1] = 0.0
    return Walk(feet, ankles, loads, under)
