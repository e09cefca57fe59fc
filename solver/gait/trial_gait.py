"""The gait of a solved trial: events, cycles, and the power of each joint.

Average speed of a stretch of walking or running, over a floor and over a belt.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.plates.force_settings import ConditioningSettings
from solver.common.errors import ModelError
from solver.common.true_runs import runs
from solver.contact.sole import soles
from solver.fitting.fit_result import TrialFit
from solver.fitting.seen_part import seen_part
from solver.gait.cycles import Cycle, cycles_of
from solver.gait.foot_motion import foot_motion
from solver.gait.gait_events import (
    GaitEvent,
    Stance,
    events_of,
    stances_as_stated,
    stances_from_feet,
    stances_from_plates,
    stances_of_both,
)
from solver.gait.settings import FLAT_FROM, FLAT_TO, GaitSettings
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

FEWEST_SPEED_FRAMES = 3  # amid a stance: fewer tell no speed

FEWEST_FRAMES = 10  # a spline and a filter need as many
BRIDGED_S = 0.1  # a shorter gap is bridged by the motion before and after


def overground_speed(com_velocity: Float[np.ndarray, "frames 3"]) -> float | None:
    """Mean over all frames of |v| of the centre of mass, in three dimensions [m/s]; None without a frame.

    Args:
        com_velocity: of the motion of the markers alone [m/s].
    """
    return float(np.linalg.norm(com_velocity, axis=1).mean()) if len(com_velocity) else None


def treadmill_speed(
    points_ground: Float[np.ndarray, "frames feet points 3"],
    in_contact: Bool[np.ndarray, "frames feet"],
    rate: float,
) -> float | None:
    """Mean over stances, of both legs, of how fast a flat foot is carried by the belt [m/s].

    The dataset paper takes the ankle over the whole of each contact. Early and late in it the foot turns
    about heel or toes, and the ankle, a hand's breadth above them, goes forward over the belt: speeds come
    out low. So only the part counts in which the foot is flat, and there whichever of heel and toes is
    carried farther: a foot that turns moves one of them over the belt, never the one it turns about.
    Stances that are cut by the first or the last frame do not count; None where there is no other.

    Args:
        points_ground: low points of each foot, as heel and ball [m].
        in_contact: which foot is on the ground.
        rate: [Hz].
    """
    found = []
    for foot in range(in_contact.shape[1]):
        for start, end in runs(in_contact[:, foot]):
            if start == 0 or end == len(in_contact):
                continue
            first = start + int(np.ceil(FLAT_FROM * (end - start)))
            last = start + int(np.floor(FLAT_TO * (end - start)))
            if last - first + 1 >= FEWEST_SPEED_FRAMES:
                ways = np.linalg.norm(points_ground[last, foot] - points_ground[first, foot], axis=1)
                found.append(float(ways.max()) * rate / (last - first))
    return float(np.mean(found)) if found else None


@dataclass(frozen=True)
class Gait:
    """What a trial shows of gait."""

    feet: tuple[str, ...]
    stances: tuple[Stance, ...]
    cycles: tuple[Cycle, ...]

    @property
    def events(self) -> tuple[GaitEvent, ...]:
        """Contacts and foot-offs, in order of time."""
        return events_of(self.stances)


def gait_of(
    trial: TrialFit,
    skeleton: Skeleton,
    settings: GaitSettings,
    conditioning: ConditioningSettings,
    *,
    feet_alone: bool = False,
) -> Gait | None:
    """Events and cycles of a trial; None without feet, or where it is too short.

    The feet's motion is that of the markers alone: a fit to forces has seen the plates.

    Args:
        trial: solved.
        skeleton: fitted.
        settings: thresholds.
        conditioning: of the plates.
        feet_alone: take neither a plate's word before the feet's, nor the recording's file's.
    """
    trial = seen_part(trial)
    motion = trial.kinematics_only.motion if trial.kinematics_only else trial.motion
    if trial.contacts is None or motion.frames < FEWEST_FRAMES:
        return None
    R, p = body_poses(skeleton, motion.q)
    feet = trial.contacts.foot_bodies
    try:
        corners = [sole.corners_ground(R, p) for sole in soles(skeleton, feet)]
    except ModelError:
        return None  # a body that forces act on, and no foot with toes
    heels = [p[:, skeleton.body_index(foot)] for foot in feet]
    moved = foot_motion(corners, p[:, 0], motion.times, settings)
    hidden = _out_of_sight(trial, skeleton, feet)
    stances = _of_seen_feet(stances_from_feet(moved), hidden, motion.times)
    if not feet_alone:
        stances = stances_as_stated(stances, trial.capture.markers.foot_events, feet)
    if trial.capture.plates and not feet_alone:
        by_force = stances_from_plates(trial.capture.plates, corners, motion.times, settings, conditioning)
        stances = stances_of_both(by_force, stances)
    cycles = cycles_of(stances, moved, heels, motion.times)
    seen = (c for c in cycles if not hidden[_within(motion.times, c.start_s, c.end_s), c.foot].any())
    return Gait(tuple(feet), stances, tuple(seen))


def _out_of_sight(
    trial: TrialFit, skeleton: Skeleton, feet: Sequence[str]
) -> Bool[np.ndarray, "frames feet"]:
    """Where the cameras lost a foot for longer than its motion can be bridged."""
    seen = ~np.isnan(trial.marker_errors.distance)
    body_of = {marker.name: marker.body for marker in skeleton.markers}
    parents = [joint.parent for joint in skeleton.joints]
    hidden = np.zeros((len(seen), len(feet)), dtype=bool)
    for k, foot in enumerate(feet):
        sole = skeleton.body_index(foot)
        bodies = {sole, *(i for i, parent in enumerate(parents) if parent == sole)}
        own = [i for i, name in enumerate(trial.marker_errors.names) if body_of.get(name) in bodies]
        for start, end in runs(~seen[:, own].any(axis=1)) if own else ():
            hidden[start:end, k] = end - start > BRIDGED_S * trial.motion.rate
    return hidden


def _of_seen_feet(
    stances: Sequence[Stance], hidden: Bool[np.ndarray, "frames feet"], times: Float[np.ndarray, " frames"]
) -> tuple[Stance, ...]:
    """Stances without the ends at which the foot was out of sight; without those wholly out of sight."""

    def is_hidden(time: float | None, foot: int) -> bool:
        return time is not None and bool(hidden[np.abs(times - time).argmin(), foot])

    found = []
    for one in stances:
        start = times[0] if one.contact_s is None else one.contact_s
        end = times[-1] if one.off_s is None else one.off_s
        if not hidden[_within(times, start, end), one.foot].all():
            contact = None if is_hidden(one.contact_s, one.foot) else one.contact_s
            off = None if is_hidden(one.off_s, one.foot) else one.off_s
            found.append(replace(one, contact_s=contact, off_s=off))
    return tuple(found)


def _within(times: Float[np.ndarray, " frames"], start: float, end: float) -> Bool[np.ndarray, " frames"]:
    return (times >= start) & (times <= end)


def joint_power(trial: TrialFit) -> Float[np.ndarray, "frames dofs"] | None:
    """Generalized force times velocity of each coordinate [W]; positive where the joint delivers work.

    The root's are those of the residual. None without dynamics.
    """
    if trial.dynamics is None:
        return None
    return trial.dynamics.joint_torques * trial.dynamics.motion.velocity
