"""People moved by where their feet stand and how high their hips are: legs by the law of cosines.

Nothing of it is shared with what tells activities or events. Walkways lead along +x; feet stay at the width
of the hips, and everything above the hips is stiff.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from benchmarks.activities.simulated import ADULTS, Between, somebody
from solver.common.gravity import GRAVITY
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

RATE = 100.0  # [Hz]
LONG_S = 99.0  # before a trial and after it
DOUBLE_SUPPORT = 0.24  # of a step: stance is 62 % of the stride
SIDES = "rl"
STRETCHED = 0.985  # of thigh and shank: people never quite straighten their knees
NOISE_RAD, NOISE_M = 0.0005, 0.0003  # of angles and place, about what tracked markers leave
KNEE_ROUNDS = 4  # a knee that slides as it bends is met by as many corrections
HEEL_DOWN, HEEL_UP = 0.2, 0.5  # of a stance, between which the foot is flat (Perry & Burnfield 2010)
TIPTOE = -0.7  # [rad] of a foot that stays back
NEAR_S = 0.15  # [s] by which hips are sooner and longer low than the feet ask for
LIFTS_S = 0.4  # [s] in which a foot is lifted that is then held
DOWN_S, UP_S = 0.15, 0.35  # [s] that the heel takes in a long one, at most
CHILDREN = (1.05, 1.40), (14.0, 19.0)  # of about 4 to 10 years, as those of adults
WAITS_S, LEANS_S = 0.6, 0.3  # [s] both feet stand for so long: hips wait, and lean before the next step
Times = Float[np.ndarray, " frames"]


@dataclass(frozen=True)
class Plant:
    """One foot on the ground from `start` to `end`; it lands and leaves turned by so much [rad], toes up."""

    foot: int  # 0 right, 1 left
    start: float  # [s]
    end: float  # [s]
    x: float  # of the ankle over the flat foot [m]
    height: float = 0.0  # of the ground there [m]
    lands: float = 0.25
    leaves: float = -0.6
    slope: float = 0.0  # of the ground
    clearance: float = 0.08  # of the swing after it [m]
    tiptoe: tuple[float, float] | None = None  # from when until when the heel is up meanwhile [s]
    flies: bool = False  # whether the whole person then does: the foot falls as everything does


def steps(
    ways: Sequence[tuple[float, float]],
    step_s: float,
    begin_s: float = 0.0,
    *,
    lands: float = 0.25,
    slope: float = 0.0,
    double: float = DOUBLE_SUPPORT,
    waits_s: Mapping[int, float] | None = None,
) -> list[Plant]:
    """Somebody who stands with both feet at 0, steps so far and so high each time, and closes up.

    Args:
        ways: ahead and up, of each step [m].
        step_s: from contact to contact [s].
        begin_s: when the first foot leaves [s].
        lands: how a foot is turned [rad].
        slope: of the ground.
        double: of a step, in which both feet stand; negative: in which none does.
        waits_s: before which steps somebody halts, and for how long [s].
    """
    places = np.vstack([[0.0, 0.0], [0.0, 0.0], np.cumsum([*ways, (0.0, 0.0)], axis=0)])
    begins, ends = [-LONG_S, -LONG_S], []
    for k in range(len(ways) + 1):
        leaves = begin_s if k == 0 else begins[-1] + double * step_s
        ends.append(leaves + (waits_s or {}).get(k, 0.0))
        begins.append(ends[-1] + (1 - double) * step_s)
    return [
        Plant(k % 2, a, b, float(x), float(y), lands=0.0 if k < 2 else lands, slope=slope)
        for k, (a, b, (x, y)) in enumerate(zip(begins, [*ends, LONG_S, LONG_S], places, strict=True))
    ]


def earlier(plants: Sequence[Plant], seconds: float) -> list[Plant]:
    """The same so much earlier."""
    return [replace(p, start=p.start - seconds, end=p.end - seconds) for p in plants]


@dataclass(frozen=True)
class Hips:
    """Where the hips are: through these points, and with these speeds."""

    times: Sequence[float]
    heights: Sequence[float]  # over the ankles of somebody who stands, of stretched legs
    speeds: Sequence[float]  # [1/s] upward, likewise


@dataclass(frozen=True, eq=False)
class Puppet:
    """Somebody's skeleton, and lengths of it [m]."""

    skeleton: Skeleton
    thigh: float
    shank: float
    hip: Float[np.ndarray, "2"]  # of the pelvis' origin: ahead, up
    ankle: float  # over the sole
    heel: Float[np.ndarray, "2"]  # of the ankle: ahead, up
    ball: Float[np.ndarray, "2"]

    @property
    def stretched(self) -> float:
        """Ankle to hip of somebody who stands."""
        return STRETCHED * (self.thigh + self.shank)

    @property
    def leg(self) -> float:
        """Floor to hip."""
        return self.stretched + self.ankle

    def moved(
        self,
        plants: Sequence[Plant],
        duration: float,
        rng: np.random.Generator,
        hips: Hips | None = None,
        sway_m: float = 0.0,
    ) -> Motion:
        """As the plants say.

        Args:
            plants: of both feet.
            duration: [s].
            rng: of sway and noise.
            hips: None: as high as the feet let them be.
            sway_m: forth and back of somebody who stands.
        """
        times = np.arange(round(duration * RATE) + 1) / RATE
        feet = [self._foot([p for p in plants if p.foot == foot], times) for foot in range(2)]
        x = _between(plants, times) + sway_m * _wave(times, rng)
        reach = np.min(
            [
                ankle[:, 1] + np.sqrt(np.maximum(self.stretched**2 - (x - ankle[:, 0]) ** 2, 0.01))
                for ankle, *_ in feet
            ],
            axis=0,
        )
        if not any(plant.flies for plant in plants):
            near = round(NEAR_S * RATE)
            reach = gaussian_filter1d(minimum_filter1d(reach, 2 * near + 1), near / 2)
        y = reach
        if hips is not None:
            wished = CubicHermiteSpline(hips.times, hips.heights, hips.speeds)
            y = np.minimum(
                self.ankle + self.stretched * wished(np.clip(times, hips.times[0], hips.times[-1])), reach
            )
        return Motion(self.skeleton.dofs, self._angles(np.column_stack([x, y]), feet, rng), RATE)

    def _foot(
        self, plants: Sequence[Plant], times: Times
    ) -> tuple[Float[np.ndarray, "frames 2"], Times, Times]:
        """Of one foot: place of the ankle, how it is turned, and how the toes are bent against it."""
        place, pitch, toes = np.zeros((len(times), 2)), np.zeros(len(times)), np.zeros(len(times))
        for plant in plants:
            on = (times >= plant.start) & (times <= plant.end)
            place[on], pitch[on], toes[on] = self._on_ground(plant, times[on])
        for one, following in pairwise(plants):
            in_air = (times > one.end) & (times < following.start)
            share = (times[in_air] - one.end) / (following.start - one.end)
            begins, ends = (
                self._on_ground(p, np.array([t])) for p, t in ((one, one.end), (following, following.start))
            )
            eased = share if one.flies else _eased(share)
            place[in_air] = begins[0] + eased[:, None] * (ends[0] - begins[0])
            place[in_air, 1] += _lift(one, following.start - one.end, share)
            pitch[in_air], toes[in_air] = (
                b + _eased(share) * (e - b) for b, e in zip(begins[1:], ends[1:], strict=True)
            )
        return place, pitch, toes

    def _on_ground(self, plant: Plant, times: Times) -> tuple[Float[np.ndarray, "frames 2"], Times, Times]:
        lasts = plant.end - plant.start
        down, up = min(HEEL_DOWN * lasts, DOWN_S), min((1 - HEEL_UP) * lasts, UP_S)
        landing, leaving = (times - plant.start) / down, (times - plant.end + up) / up
        turned = plant.lands * (1 - _eased(landing)) + plant.leaves * _eased(leaving)
        if plant.tiptoe:
            up, down = ((times - t) / UP_S for t in plant.tiptoe)
            turned = turned + TIPTOE * (_eased(up) - _eased(down))
        pivot = np.where(turned[:, None] > 0, self.heel, self.ball)
        flat = np.array([plant.x, plant.height + self.ankle])
        return (
            flat + _turned(pivot, plant.slope) - _turned(pivot, plant.slope + turned),
            plant.slope + turned,
            np.maximum(-turned, 0.0),
        )

    def _angles(
        self,
        hip: Float[np.ndarray, "frames 2"],
        feet: Sequence[tuple[Float[np.ndarray, "frames 2"], Times, Times]],
        rng: np.random.Generator,
    ) -> Float[np.ndarray, "frames dofs"]:
        dofs = list(self.skeleton.dofs)
        q = np.zeros((len(hip), len(dofs)))
        q[:, [dofs.index("pelvis_tx"), dofs.index("pelvis_ty")]] = hip - self.hip
        aims = [ankle.copy() for ankle, *_ in feet]
        for _ in range(KNEE_ROUNDS):
            for side, aim, (_, pitch, toes) in zip(SIDES, aims, feet, strict=True):
                thigh, knee = self._bent(aim - hip)
                names = [
                    f"{name}_{side}" for name in ("hip_flexion", "knee_angle", "ankle_angle", "mtp_angle")
                ]
                q[:, [dofs.index(name) for name in names]] = np.column_stack(
                    [thigh, knee, pitch - thigh + knee, toes]
                )
            p = body_poses(self.skeleton, q)[1]
            for k, side in enumerate(SIDES):
                aims[k] += feet[k][0] - p[:, self.skeleton.body_index(f"talus_{side}"), :2]
        places = [dofs.index(f"pelvis_t{axis}") for axis in "xyz"]
        noise = rng.standard_normal(q.shape) * NOISE_RAD
        noise[:, places] *= NOISE_M / NOISE_RAD
        return q + noise

    def _bent(self, ankle_hip: Float[np.ndarray, "frames 2"]) -> tuple[Times, Times]:
        """Angle of the thigh to the front, and of the knee [rad]."""
        longest = 0.9995 * (self.thigh + self.shank)
        far = np.minimum(np.linalg.norm(ankle_hip, axis=1), longest)
        knee = np.pi - np.arccos((self.thigh**2 + self.shank**2 - far**2) / (2 * self.thigh * self.shank))
        beside = np.arccos(np.clip((self.thigh**2 + far**2 - self.shank**2) / (2 * self.thigh * far), -1, 1))
        return np.arctan2(ankle_hip[:, 0], -ankle_hip[:, 1]) + beside, knee


def kinematic_gait(seed: int, among: tuple[Between, Between] = ADULTS) -> Puppet:
    """Somebody.

    Args:
        seed: who.
        among: people of such heights [m] and body mass indices [kg/m²].
    """
    body = somebody(np.random.default_rng(seed), among)
    skeleton, sole = body.skeleton, body.sole
    p = body_poses(skeleton, np.zeros((1, len(skeleton.dofs))))[1][0, :, :2]
    pelvis, femur, tibia, talus, calcn, toes = (
        p[skeleton.body_index(name)]
        for name in ("pelvis", "femur_r", "tibia_r", "talus_r", "calcn_r", "toes_r")
    )
    ankle = float(sole.thickness + talus[1] - calcn[1])
    return Puppet(
        skeleton,
        thigh=float(femur[1] - tibia[1]),
        shank=float(tibia[1] - talus[1]),
        hip=femur - pelvis,
        ankle=ankle,
        heel=np.array([sole.heel - sole.ankle, -ankle]),
        ball=toes - talus,
    )


def _lift(plant: Plant, seconds: float, share: Times) -> Times:
    """Over the straight way from where a foot leaves to where it lands [m]."""
    if plant.flies:
        return GRAVITY * seconds**2 / 2 * share * (1 - share)
    if seconds < 2 * LIFTS_S:
        return 16 * plant.clearance * (share * (1 - share)) ** 2
    return plant.clearance * _eased(share * seconds / LIFTS_S) * _eased((1 - share) * seconds / LIFTS_S)


def _eased(share: Times) -> Times:
    """From 0 to 1 without a jerk at its ends."""
    inside = np.clip(share, 0.0, 1.0)
    return inside**2 * (3 - 2 * inside)


def _turned(point: Float[np.ndarray, "*frames 2"], angle: Times | float) -> Float[np.ndarray, "*frames 2"]:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * point[..., 0] - s * point[..., 1], s * point[..., 0] + c * point[..., 1]], axis=-1)


def _wave(times: Times, rng: np.random.Generator) -> Times:
    """Of about 0.1 to 0.5 Hz, in which people sway, and an RMS of 1."""
    hertz, phases = rng.uniform(0.1, 0.5, 4), rng.uniform(0, 2 * np.pi, 4)
    return np.asarray(np.sin(2 * np.pi * hertz * times[:, None] + phases).sum(axis=1) / np.sqrt(2))


def _between(plants: Sequence[Plant], times: Times) -> Times:
    """Hips go from where they were to the middle of the feet by each landing, and wait while nobody steps."""
    in_order = sorted(plants, key=lambda p: p.start)
    firsts = [next(p for p in in_order if p.foot == foot) for foot in range(2)]
    last = {plant.foot: plant.x for plant in firsts}
    knots = {min(p.start for p in firsts): sum(last.values()) / 2}
    for plant in in_order:
        if plant in firsts:
            continue
        leaves = max(p.end for p in plants if p.foot == plant.foot and p.end <= plant.start)
        if leaves - max(knots) > WAITS_S:
            knots[leaves - LEANS_S] = sum(last.values()) / 2
        last[plant.foot] = plant.x
        knots[plant.start] = sum(last.values()) / 2
    at = [*sorted(knots), max(knots) + 1.0]
    return np.asarray(
        PchipInterpolator(at, [*(knots[t] for t in at[:-1]), knots[at[-2]]])(np.clip(times, at[0], at[-1]))
    )
