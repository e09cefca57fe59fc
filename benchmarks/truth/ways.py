"""Four ways from a recording to angles and torques, side by side.

- *ours*: the program's fit to markers and forces.
- *marker fit*: the same without the fit to forces; motion and forces through the program's own filter.
- *laboratory*: markers and forces through one Butterworth filter (fourth order, no lag) of 6 Hz in walking,
  squatting and sitting, 15 Hz in running and jumping; inverse kinematics; inverse dynamics.
- *marker fit, N Hz*: the marker fit and the forces through the program's filter at N Hz, for a row of N. The
  page takes the one that is best by the truth, for each figure anew: an opponent that nobody can be.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from solver.capture.plates.conditioning import condition, shared_cutoff
from solver.capture.plates.force_settings import ConditioningSettings
from solver.common.filters import low_pass
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.settings import Settings
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.motion import Motion
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class TimeHistory:
    """One motion on the markers' frames, and what the joints bore."""

    dofs: tuple[str, ...]
    rate: float  # [Hz]
    angle: Float[np.ndarray, "frames dofs"]  # [rad or m]
    speed: Float[np.ndarray, "frames dofs"]
    acceleration: Float[np.ndarray, "frames dofs"]
    torque: Float[np.ndarray, "frames dofs"] | None = None  # [N·m or N]; None: no forces

    def with_torque(self, torque: Float[np.ndarray, "frames dofs"] | None) -> "TimeHistory":
        """The same motion with those torques."""
        return replace(self, torque=torque)


def time_history_of(motion: Motion, torque: Float[np.ndarray, "frames dofs"] | None = None) -> TimeHistory:
    """A motion with its derivatives."""
    return TimeHistory(motion.dofs, motion.rate, motion.q, motion.velocity, motion.acceleration, torque)


def torques_of(
    skeleton: Skeleton,
    motion: Motion,
    wrench_ground: Float[np.ndarray, "frames feet 6"],
    foot_bodies: Sequence[str],
) -> Float[np.ndarray, "frames dofs"]:
    """Inverse dynamics of a motion under the feet's wrenches [N, N·m about the ground origin]."""
    feet = [skeleton.body_index(name) for name in foot_bodies]
    return RigidBodyModel(skeleton).inverse_dynamics(
        motion.q, motion.velocity, motion.acceleration, wrench_ground, feet
    )


OURS, MARKER_FIT, LABORATORY = "ours", "marker fit", "laboratory"
CUTOFFS_HZ = (3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0)
LABORATORY_ORDER = 2  # of the single pass; forwards and backwards the fourth order that laboratories state
LABORATORY_HZ = dict.fromkeys(("walk", "squat", "sit"), 6.0)
LABORATORY_HZ |= dict.fromkeys(("run", "sprint", "landing", "jump"), 15.0)
LONGEST_FILLED_GAP_S = 0.2


@dataclass(frozen=True)
class Ways:
    """All ways of one trial."""

    time_histories: dict[str, TimeHistory]
    raw_marker_fit: TimeHistory  # without any filter
    forces_count: Bool[np.ndarray, " frames"]


def bench_settings(settings: Settings | None = None) -> Settings:
    """Without the held-out blocks, which the bench does not read."""
    chosen = settings or Settings()
    return replace(chosen, trajectory=replace(chosen.trajectory, held_out=False))


def at_cutoff(cutoff_Hz: float) -> str:
    """What the page calls the marker fit at a cut-off."""
    return f"marker fit, {cutoff_Hz:g} Hz"


def all_ways(
    fit: Fit, trial: TrialFit, settings: Settings, activity: str, own_model: Skeleton | None = None
) -> Ways:
    """Every way of one solved trial.

    Args:
        fit: with its groundwork.
        trial: of the fit.
        settings: that the fit was made with.
        activity: decides the laboratory's cut-off.
        own_model: the person's own scaled model, which a laboratory would take as it is; None: the
            laboratory takes ours, as we scaled it.
    """
    work = fit.groundwork
    assert work is not None
    mass = work.mass_kg if work.mass_kg is not None else fit.mass_kg
    skeleton = with_mass(work.skeleton, mass)
    before = (trial.kinematics_only.motion if trial.kinematics_only else trial.motion).filled()
    counts = trial.dynamics.used if trial.dynamics else np.zeros(before.frames, dtype=bool)
    filters = settings.conditioning
    own_filter = replace(filters, cutoff_Hz=shared_cutoff(before.rate, filters))
    time_histories = {
        OURS: time_history_of(trial.dynamics.motion.filled(), trial.dynamics.joint_torques)
        if trial.dynamics
        else time_history_of(trial.motion.filled()),
        MARKER_FIT: _filtered(before, trial, skeleton, own_filter),
    }
    laboratory_skeleton = skeleton if own_model is None else with_mass(work.match.skeleton(own_model), mass)
    cutoff = LABORATORY_HZ[activity]
    markers = low_passed_markers(work.match.observed(trial.capture.markers), before.rate, cutoff)
    q = inverse_kinematics(laboratory_skeleton, markers, before.rate, settings.kinematics)
    motion = Motion(laboratory_skeleton.dofs, q, before.rate, before.start_time).filled()
    laboratory_filter = replace(filters, cutoff_Hz=cutoff, order=LABORATORY_ORDER)
    time_histories[LABORATORY] = time_history_of(
        motion, _torques(motion, trial, laboratory_skeleton, laboratory_filter)
    )
    for hertz in CUTOFFS_HZ:
        if hertz < before.rate / 2:
            time_histories[at_cutoff(hertz)] = _filtered(
                before, trial, skeleton, replace(filters, cutoff_Hz=hertz)
            )
    return Ways(time_histories, time_history_of(before), counts)


def _filtered(
    motion: Motion, trial: TrialFit, skeleton: Skeleton, conditioning: ConditioningSettings
) -> TimeHistory:
    """Motion and forces through one filter."""
    smooth = motion.low_passed(conditioning.cutoff_Hz, conditioning.order)
    return time_history_of(smooth, _torques(smooth, trial, skeleton, conditioning))


def _torques(
    motion: Motion, trial: TrialFit, skeleton: Skeleton, conditioning: ConditioningSettings
) -> Float[np.ndarray, "frames dofs"] | None:
    if trial.contacts is None:
        return None
    wrench = feet_wrenches(trial, conditioning)
    return torques_of(skeleton, motion, wrench, trial.contacts.foot_bodies)


def feet_wrenches(trial: TrialFit, conditioning: ConditioningSettings) -> Float[np.ndarray, "frames feet 6"]:
    """The plates' wrenches through another filter, on the feet that the fit gave them to."""
    assert trial.contacts is not None
    wrench = np.zeros_like(trial.contacts.wrench_ground)
    for k, plate in enumerate(trial.capture.plates):
        read = condition(plate, trial.motion.times, conditioning)
        felt = np.nan_to_num(np.concatenate([read.force_ground, read.moment_ground], axis=1))
        for foot in range(wrench.shape[1]):
            wrench[:, foot] += np.where(trial.contacts.plate[:, k, None] == foot, felt, 0.0)
    return wrench


def low_passed_markers(
    positions: Float[np.ndarray, "frames markers 3"], rate: float, cutoff_Hz: float
) -> Float[np.ndarray, "frames markers 3"]:
    """Markers as a laboratory filters them: short gaps filled with a cubic, long ones left open."""
    smooth = np.full_like(positions, np.nan)
    frames = np.arange(len(positions))
    for m in range(positions.shape[1]):
        seen = np.flatnonzero(np.isfinite(positions[:, m]).all(axis=1))
        if len(seen) < 2:
            continue
        whole = slice(seen[0], seen[-1] + 1)
        filled = CubicSpline(seen, positions[seen, m])(frames[whole])
        near = _within_gap(frames[whole], seen, round(LONGEST_FILLED_GAP_S * rate))
        smooth[whole, m] = np.where(
            near[:, None], low_pass(filled, rate, cutoff_Hz, LABORATORY_ORDER), np.nan
        )
    return smooth


def _within_gap(frames: np.ndarray, seen: np.ndarray, longest: int) -> Bool[np.ndarray, " frames"]:
    """Frames on which a marker was seen, or that lie in a gap that is short enough to fill."""
    after = np.searchsorted(seen, frames)
    gap = seen[after] - seen[np.maximum(after - 1, 0)]
    return (seen[after] == frames) | (gap <= longest)
