"""When feet begin their steps: by the plates where these are known, else by how the feet swing.

A foot begins its step when it is farthest ahead of the pelvis (Zeni et al. 2008,
10.1016/j.gaitpost.2007.07.007), or some time around that: how long after, steps that plates have seen say.
A step whose force is held out thus gets its time from its own markers and from other steps' forces.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.signal import find_peaks

from solver.common.filters import low_pass
from solver.common.frames_at_once import by_frames
from solver.common.runs import runs
from solver.dynamics.force_prediction.heading_frame import HeadingFrame
from solver.dynamics.force_prediction.settings import PredictionSettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

SWING_CUTOFF_HZ = 6.0  # a swing has no more; marker noise moves its farthest point
SHORTEST_CONTACT_S = 0.06  # shorter ones are blips
APART_S = 0.2  # a swing's farthest point and the contact that ends it; farther apart, they are of two
SCATTER_S = 0.06  # of that time between steps of a person; a contact farther off belongs to another plate


@dataclass(frozen=True)
class Footfalls:
    """In the order of time."""

    frames: Float[np.ndarray, " steps"]  # between two frames, where no plate tells
    feet: Int[np.ndarray, " steps"]  # in the order of the contacts' feet


def footfalls(
    skeleton: Skeleton,
    motion: Motion,
    frame: HeadingFrame,
    settings: PredictionSettings,
    *,
    feet: tuple[str, ...],
    in_contact: Bool[np.ndarray, "frames feet"],
    known: Bool[np.ndarray, " frames"],
) -> Footfalls:
    """Of one trial.

    Args:
        skeleton: of the motion.
        motion: of the markers alone.
        frame: of that motion.
        settings: what is a step.
        feet: bodies.
        in_contact: by the plates.
        known: frames on which plates may be looked at; on the others `in_contact` is not.
    """
    kinematics, bodies = ForwardKinematics(skeleton), [skeleton.body_index(name) for name in feet]
    places = by_frames(lambda q: kinematics.poses(q).p_ground_body[:, bodies], motion.q)
    swung, onsets = [], []
    for k in range(len(feet)):
        ahead = frame.points(places[:, k])[:, 0]
        ahead = low_pass(ahead, motion.rate, SWING_CUTOFF_HZ)
        swung.append(find_peaks(ahead, prominence=settings.shortest_stride_m)[0])
        onsets.append(_onsets(in_contact[:, k], known, motion.rate))
    late = [_nearest(o, s) for s, o in zip(swung, onsets, strict=True)]
    matched = np.concatenate([x[np.abs(x) <= APART_S * motion.rate] for x in late])
    usual = float(np.median(matched)) if len(matched) else 0.0
    times = [
        s + np.where(np.abs(x - usual) <= SCATTER_S * motion.rate, x, usual)
        for s, x in zip(swung, late, strict=True)
    ]
    all_times = np.concatenate(times)
    all_feet = np.repeat(np.arange(len(feet)), [len(t) for t in times])
    order = np.argsort(all_times, kind="stable")
    return Footfalls(all_times[order], all_feet[order])


def _onsets(
    contact: Bool[np.ndarray, " frames"], known: Bool[np.ndarray, " frames"], rate: float
) -> Int[np.ndarray, " some"]:
    """Frames on which a plate is first loaded, seen to be unloaded the frame before."""
    seen = [
        start
        for start, end in runs(contact & known)
        if start > 0 and known[start - 1] and end - start >= SHORTEST_CONTACT_S * rate
    ]
    return np.array(seen, dtype=int)


def _nearest(
    onsets: Int[np.ndarray, " some"], swung: Int[np.ndarray, " steps"]
) -> Float[np.ndarray, " steps"]:
    """How much later the nearest onset is [frames]; infinite where there is none."""
    if not len(onsets):
        return np.full(len(swung), np.inf)
    differences = onsets[None, :] - swung[:, None]
    nearest = np.abs(differences).argmin(axis=1)
    return differences[np.arange(len(swung)), nearest].astype(float)
