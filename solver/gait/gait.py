"""The gait of a solved trial: events, cycles, and the power of each joint."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.capture.force_settings import ConditioningSettings
from solver.contact.sole import soles
from solver.errors import ModelError
from solver.fit import TrialFit
from solver.gait.cycles import Cycle, cycles_of
from solver.gait.events import (
    GaitEvent,
    Stance,
    events_of,
    stances_from_feet,
    stances_from_plates,
    stances_of_both,
)
from solver.gait.foot_motion import foot_motion
from solver.gait.settings import GaitSettings
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

FEWEST_FRAMES = 10  # a spline and a filter need as many


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
    with_plates: bool = True,
) -> Gait | None:
    """Events and cycles of a trial; None without feet, or where it is too short.

    The feet's motion is that of the markers alone: a fit to forces has seen the plates.

    Args:
        trial: solved.
        skeleton: fitted.
        settings: thresholds.
        conditioning: of the plates.
        with_plates: take a plate's word before the feet's.
    """
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
    stances = stances_from_feet(moved, settings)
    if with_plates and trial.capture.plates:
        by_force = stances_from_plates(trial.capture.plates, corners, motion.times, settings, conditioning)
        stances = stances_of_both(by_force, stances)
    return Gait(tuple(feet), stances, cycles_of(stances, moved, heels, motion.times, settings))


def joint_power(trial: TrialFit) -> Float[np.ndarray, "frames dofs"] | None:
    """Generalized force times velocity of each coordinate [W]; positive where the joint delivers work.

    The root's are those of the residual. None without dynamics.
    """
    if trial.dynamics is None:
        return None
    return trial.dynamics.joint_torques * trial.dynamics.motion.velocity
