"""What a trial's motion shows of body and feet, from which activities are told."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from solver.common.errors import ModelError
from solver.common.filters import low_pass
from solver.common.frames_at_once import by_frames
from solver.contact.sole import soles
from solver.gait.foot_motion import FootMotion, foot_motion
from solver.gait.gait_events import Stance, stances_from_feet
from solver.gait.settings import GaitSettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

AMID = (0.3, 0.6)  # of a stance: the whole sole lies on the surface
SMOOTH_HZ = 6.0  # of the pelvis, whose acceleration is asked for: the usual corner of gait analysis


@dataclass(frozen=True)
class Foothold:
    """Where a foot stands: amid one stance."""

    foot: int
    begins_s: float  # the first frame's time where the foot stands from the beginning
    height_m: float  # of the sole's lowest corner
    way_m: float  # from the trial's beginning, over the surface


@dataclass(frozen=True)
class BodyMotion:
    """One trial on its own frames; lengths in m, ground frame."""

    rate: float  # [Hz]
    times: Float[np.ndarray, " frames"]  # [s]
    leg: float  # hip to floor of the upright person [m]
    pelvis: Float[np.ndarray, "frames 3"]  # the root body's origin, low-passed
    velocity: Float[np.ndarray, "frames 3"]  # its [m/s]
    acceleration: Float[np.ndarray, "frames 3"]  # its [m/s²]
    pace: Float[np.ndarray, " frames"]  # [m/s] over the surface
    belt: Float[np.ndarray, " frames"]  # [m/s] of the surface
    knees: Float[np.ndarray, "frames feet"]  # flexion, 0 when straight [rad]
    ahead: Float[np.ndarray, " frames"]  # how far one heel is before the other, as the pelvis faces
    ankles: Float[np.ndarray, "frames feet 3"]  # centres of the ankle joints
    soles: Float[np.ndarray, "frames feet"]  # height of each sole's lowest corner
    stands: Bool[np.ndarray, "frames feet"]
    stances: tuple[Stance, ...]  # from the feet alone
    load_BW: Float[np.ndarray, " frames"] | None = None  # all plates [body weights]; None: none measured

    @property
    def frames(self) -> int:
        """Of the trial."""
        return len(self.times)

    @cached_property
    def ground(self) -> Float[np.ndarray, " feet"]:
        """How high each sole's lowest corner is while it stands: the height of most of its stances [m]."""
        levels = []
        for foot in range(self.soles.shape[1]):
            standing = self.soles[self.stands[:, foot], foot]
            levels.append(np.median(standing) if len(standing) else np.quantile(self.soles[:, foot], 0.05))
        return np.array(levels)

    @cached_property
    def footholds(self) -> tuple[Foothold, ...]:
        """All of the trial, in order of time."""
        ways = np.concatenate([[0.0], np.cumsum(self.pace)]) / self.rate
        found = []
        for stance in self.stances:
            begin = self.times[0] if stance.contact_s is None else stance.contact_s
            end = self.times[-1] if stance.off_s is None else stance.off_s
            amid = [begin + share * (end - begin) for share in AMID]
            first, last = np.searchsorted(self.times, amid)
            if first < last:
                height = float(np.median(self.soles[first:last, stance.foot]))
                found.append(Foothold(stance.foot, float(begin), height, float(ways[first])))
        return tuple(sorted(found, key=lambda hold: hold.begins_s))


def body_motion(
    skeleton: Skeleton,
    feet: Sequence[str],
    motion: Motion,
    settings: GaitSettings,
    load_BW: Float[np.ndarray, " frames"] | None = None,
) -> BodyMotion:
    """The motion as activities are told from.

    Args:
        skeleton: scaled.
        feet: names of two foot bodies.
        motion: of the markers alone.
        settings: of gait events.
        load_BW: vertical force of all plates [body weights]; NaN where nothing was recorded.

    Raises:
        ModelError: a foot has no sole, or no leg above it.
    """
    corners, p = _places(skeleton, feet, motion)
    moved = foot_motion(corners, p[:, 0], motion.times, settings)
    stances = stances_from_feet(moved)
    chains = [_leg(skeleton, foot) for foot in feet]
    pelvis = low_pass(p[:, chains[0][0]], motion.rate, SMOOTH_HZ)
    velocity = np.gradient(pelvis, 1 / motion.rate, axis=0)
    lowest = np.column_stack([c[..., 1].min(axis=1) for c in corners])
    return BodyMotion(
        rate=motion.rate,
        times=motion.times,
        leg=_leg_length(skeleton, chains[0], p),
        pelvis=pelvis,
        velocity=velocity,
        acceleration=np.gradient(velocity, 1 / motion.rate, axis=0),
        pace=np.interp(motion.times, moved.times, moved.pace),
        belt=np.interp(motion.times, moved.times, np.linalg.norm(moved.surface, axis=1)),
        knees=np.column_stack([_flexion(p, chain) for chain in chains]),
        ahead=_ahead(p, [skeleton.body_index(foot) for foot in feet], [chain[1] for chain in chains]),
        ankles=p[:, [chain[3] for chain in chains]],
        soles=lowest,
        stands=_stands(stances, moved, motion.times, len(feet)),
        stances=stances,
        load_BW=load_BW,
    )


def _places(
    skeleton: Skeleton, feet: Sequence[str], motion: Motion
) -> tuple[list[Float[np.ndarray, "frames corners 3"]], Float[np.ndarray, "frames bodies 3"]]:
    """Corners of each foot's sole, and origins of all bodies [m]."""
    outlines = soles(skeleton, feet)

    def of_frames(q: Float[np.ndarray, "some dofs"]) -> Float[np.ndarray, "some points 3"]:
        R, p = body_poses(skeleton, q)
        return np.concatenate([*(sole.corners_ground(R, p) for sole in outlines), p], axis=1)

    places = by_frames(of_frames, motion.q)
    ends = np.cumsum([sum(len(part.corners_body) for part in sole.parts) for sole in outlines])
    *corners, p = np.split(places, ends, axis=1)
    return corners, p


def _leg(skeleton: Skeleton, foot: str) -> tuple[int, int, int, int]:
    """Root, thigh, shank and the body below the shank, from the root down to a foot."""
    chain = [skeleton.body_index(foot)]
    while skeleton.joints[chain[-1]].parent >= 0:
        chain.append(skeleton.joints[chain[-1]].parent)
    if len(chain) < 4:
        raise ModelError(f"{skeleton.name}: no thigh and shank between the root and {foot}")
    root, thigh, shank, below = chain[::-1][:4]
    return root, thigh, shank, below


def _leg_length(
    skeleton: Skeleton, chain: tuple[int, int, int, int], p: Float[np.ndarray, "frames bodies 3"]
) -> float:
    """Hip to floor, from thigh and shank: 0.530 of the stature and 0.491 (Winter 2009, after Drillis)."""
    _, thigh, shank, below = chain
    lengths = [
        np.median(np.linalg.norm(p[:, a] - p[:, b], axis=1)) for a, b in ((thigh, shank), (shank, below))
    ]
    return float(sum(lengths)) * 0.530 / 0.491


def _ahead(
    p: Float[np.ndarray, "frames bodies 3"], feet: Sequence[int], thighs: Sequence[int]
) -> Float[np.ndarray, " frames"]:
    """Level distance between two heels, less what is along the line between the hips [m]."""
    hips = (p[:, thighs[0]] - p[:, thighs[1]])[:, [0, 2]]
    across = hips / np.maximum(np.linalg.norm(hips, axis=1, keepdims=True), 1e-9)
    between = (p[:, feet[0]] - p[:, feet[1]])[:, [0, 2]]
    return np.abs(between[:, 0] * across[:, 1] - between[:, 1] * across[:, 0])


def _flexion(
    p: Float[np.ndarray, "frames bodies 3"], chain: tuple[int, int, int, int]
) -> Float[np.ndarray, " frames"]:
    """Angle between thigh and shank [rad]."""
    _, thigh, shank, below = chain
    upper, lower = p[:, shank] - p[:, thigh], p[:, below] - p[:, shank]
    cosine = (upper * lower).sum(axis=1) / (np.linalg.norm(upper, axis=1) * np.linalg.norm(lower, axis=1))
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _stands(
    stances: Sequence[Stance], moved: FootMotion, times: Float[np.ndarray, " frames"], feet: int
) -> Bool[np.ndarray, "frames feet"]:
    stands = np.zeros((len(times), feet), dtype=bool)
    for stance in stances:
        start = -np.inf if stance.contact_s is None else stance.contact_s
        end = np.inf if stance.off_s is None else stance.off_s
        stands[(times >= start) & (times < end), stance.foot] = True
    return stands
