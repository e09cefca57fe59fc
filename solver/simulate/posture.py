"""Standing and squatting with both feet on the ground."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.gravity import GRAVITY
from solver.simulate.contacts import ContactPlan, Stance, TimeHistory
from solver.simulate.feasible_motion import PLACE, Wish
from solver.simulate.simulated_sole import Sole
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class Bend:
    """A posture that is reached again and again, and how."""

    bottom_deg: Mapping[str, float]
    seconds: float  # there and back
    depth: float  # of the posture, on average
    rest_s: float  # before it begins anew
    sinks_by: float | None = 1.0  # power of the depth by which the pelvis sinks; None: it stays


# Joint angles at the bottom of a squat [deg], of our own choosing: thighs short of level, trunk leaning
# forward.
SQUAT = {
    "hip_flexion": 92, "hip_adduction": -8, "knee_angle": 100, "ankle_angle": 30, "pelvis_tilt": -24,
    "lumbar_extension": -16, "arm_flex": 75, "elbow_flex": 10,
}  # fmt: skip
LEAST_SHARE = 0.6 / 0.85  # of the usual depth
STANDING = {
    "hip_flexion": 4,
    "hip_rotation": -8,
    "hip_adduction": -3,
    "knee_angle": 3,
    "arm_add": -10,
    "elbow_flex": 12,
    "pro_sup": 80,
    "ankle_angle": 2,
}
BENT: Mapping[str, Bend] = {  # what somebody may be asked to do, standing
    "squat": Bend(SQUAT, 2.2, 0.85, 0.35),
    "bounce": Bend(SQUAT, 0.75, 0.4, 0.05, sinks_by=2.0),
    "arms": Bend({"arm_flex": 75}, 1.2, 1.0, 0.05, sinks_by=None),
    "bend": Bend(
        {"lumbar_extension": -36, "pelvis_tilt": -24, "hip_flexion": 26}, 1.9, 1.0, 0.1, sinks_by=None
    ),
}
STATIC = {"arm_add": -35, "elbow_flex": 8, "pro_sup": 60}


def standing_contacts(
    sole: Sole,
    mass: float,
    width: float,
    span: tuple[float, float],
    rng: np.random.Generator,
    *,
    shift: float = 0.0,
) -> ContactPlan:
    """Both feet planted throughout, the load swaying slowly from one to the other and to and fro.

    Args:
        sole: of the person.
        mass: [kg].
        width: between the feet's midlines [m].
        span: first and last time [s].
        rng: of the sway.
        shift: of the share of the load, to and fro in two seconds.
    """
    before, after = span[0] - 1.0, span[1] + 1.0
    sideways, forward = _sway(rng, 0.03), _sway(rng, 0.015)
    stances = []
    for foot, side in enumerate((1.0, -1.0)):

        def load(times: np.ndarray, side: float = side) -> np.ndarray:
            return mass * GRAVITY * (0.5 + side * (sideways(times) + shift * np.sin(np.pi * times)))

        stances.append(
            Stance(
                foot=foot,
                start=before,
                end=after,
                origin_ground=np.array([-sole.ankle, 0.0, side * width / 2]),
                yaw=-side * np.radians(8.0),
                load=load,
                along=lambda times: 0.42 + forward(times),
                across=lambda times: np.full(len(times), 0.05),
                heel_planted=(before, after),
                forefoot_planted=(before, after),
            )
        )
    return ContactPlan(tuple(stances), sole)


def bend_depth(bend: Bend, span: tuple[float, float], rng: np.random.Generator) -> TimeHistory:
    """Depth over time, 0 upright to about 1, with a short rest before it begins anew."""
    starts, depths, lengths = [], [], []
    start = 0.5
    while start < span[1]:
        starts.append(start)
        lengths.append(bend.seconds * (1 + 0.06 * rng.standard_normal()))
        depths.append(np.clip(bend.depth + 0.06 * rng.standard_normal(), LEAST_SHARE * bend.depth, 1.0))
        start += lengths[-1] + bend.rest_s

    def time_history(times: np.ndarray) -> np.ndarray:
        depth = np.zeros(len(times))
        for since, deep, length in zip(starts, depths, lengths, strict=True):
            share = np.clip((times - since) / length, 0, 1)
            depth += deep * np.sin(np.pi * share) ** 2
        return depth

    return time_history


def posture_wish(
    skeleton: Skeleton,
    contacts: ContactPlan,
    times: Float[np.ndarray, " times"],
    depth: Float[np.ndarray, " times"] | None,
    bend: Bend = BENT["squat"],
) -> Wish:
    """Upright with the arms held off the body, or bent to a depth.

    Args:
        skeleton: who stands.
        contacts: of both feet.
        times: [s].
        depth: 0 upright, 1 the bottom; None for standing, arms off the body.
        bend: how somebody bends.
    """
    base = {**STANDING, **(STATIC if depth is None else {})}
    bottom = bend.bottom_deg if depth is not None else {}
    deep = depth if depth is not None else np.zeros(len(times))
    q = np.zeros((len(times), len(skeleton.dofs)))
    for i, dof in enumerate(skeleton.dofs):
        stem = dof[:-2] if dof.endswith(("_r", "_l")) else dof
        degrees = base.get(stem, 0.0) + deep * (bottom[stem] - base.get(stem, 0.0) if stem in bottom else 0.0)
        q[:, i] = np.radians(degrees)
    height = skeleton.dofs.index("pelvis_ty")
    thigh = -skeleton.joints[skeleton.body_index("tibia_r")].p_parent_frame[1]
    hip = skeleton.joints[skeleton.body_index("femur_r")].p_parent_frame
    sunk = np.zeros(len(times)) if bend.sinks_by is None else deep**bend.sinks_by
    q[:, height] = skeleton.default_q[height] - 0.002 - sunk * 1.15 * thigh
    q[:, skeleton.dofs.index("pelvis_tx")] = -hip[0] + 0.03 - 0.20 * sunk
    upright = np.array([0.0, skeleton.mass * GRAVITY, 0.0])
    return Wish(
        times=times,
        q=q,
        tolerance=tolerance_of(skeleton),
        contacts=contacts,
        force=np.tile(upright, (len(times), 1)),
        force_tolerance=0.5,
    )


def tolerance_of(skeleton: Skeleton, legs_deg: float = 6.0) -> Float[np.ndarray, " dofs"]:
    """How far the motion may leave the pattern [rad or m]; `legs_deg` is of the pelvis too."""
    upper = ("arm", "elbow", "pro", "wrist", "lumbar")
    turns = np.radians([2.5 if name.startswith(upper) else legs_deg for name in skeleton.dofs])
    return np.where([name in PLACE for name in skeleton.dofs], 0.06, turns)


def _sway(rng: np.random.Generator, size: float) -> TimeHistory:
    """A slow irregular time history: a few sines between 0.1 and 0.6 Hz, of that standard deviation."""
    rates = rng.uniform(0.1, 0.6, 4)
    phases = rng.uniform(0, 2 * np.pi, 4)
    amplitude = size * np.sqrt(2 / 4)
    return lambda times: amplitude * np.sin(2 * np.pi * np.outer(times, rates) + phases).sum(axis=1)
