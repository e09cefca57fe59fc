"""The gait of a solved trial: events, cycles, and the power of each joint."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.plates.force_settings import ConditioningSettings
from solver.common.errors import ModelError
from solver.common.runs import runs
from solver.contact.sole import soles
from solver.fitting.fit import TrialFit
from solver.fitting.seen_part import seen_part
from solver.gait.cycles import Cycle, cycles_of
from solver.gait.events import (
    GaitEvent,
    Stance,
    events_of,
    stances_as_stated,
    stances_from_feet,
    stances_from_plates,
    stances_of_both,
)
from solver.gait.foot_motion import foot_motion
from solver.gait.settings import GaitSettings
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

FEWEST_FRAMES = 10  # a spline and a filter need as many
BRIDGED_S = 0.1  # a shorter gap is bridged by the motion before and after


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
    stances = _of_seen_feet(stances_from_feet(moved, settings), hidden, motion.times)
    if not feet_alone:
        stances = stances_as_stated(stances, trial.capture.markers.foot_events, feet)
    if trial.capture.plates and not feet_alone:
        by_force = stances_from_plates(trial.capture.plates, corners, motion.times, settings, conditioning)
        stances = stances_of_both(by_force, stances)
    cycles = cycles_of(stances, moved, heels, motion.times, settings)
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
