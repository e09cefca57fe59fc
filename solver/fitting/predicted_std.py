"""How far predicted wrenches may be off, and torques under them: as far as those of held-out steps were.

A trial's own steps are the measure: each was predicted as if its forces had not been seen, and what was
missed holds whatever model and markers get wrong in this trial. Two errors of a step are taken to be
independent, so that few steps give wide bands (Student's t).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import binary_erosion
from scipy.special import stdtrit

from solver.dynamics.cross_validation.held_out import HeldOutLayout
from solver.dynamics.cross_validation.held_out_layouts import STEPS
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.root_wrench import about_point
from solver.dynamics.trajectory.uncertainty import dofs_above
from solver.fitting.fit_result import Fit, TrialFit
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

INDEPENDENT_A_STEP = 2
UPPER_QUANTILE, ITS_STD = 0.975, 1.96  # of 95 % bands
SOLE_BEARER = 0.9  # of the load of all feet without a force: how it divides between two is not known
CHANGE_S = 0.05  # by which the time is off at which one foot takes the load from the other


def with_predicted_std(fit: Fit) -> Fit:
    """The fit with bands of predicted forces and of torques that rest on them, where held-out steps tell."""
    return replace(fit, trials=tuple(_of_trial(t, fit.skeleton, fit.held_out_layouts) for t in fit.trials))


def wrench_errors(layouts: Sequence[HeldOutLayout], trial: str) -> Float[np.ndarray, "6 6"] | None:
    """Covariance of a predicted wrench of all feet: force [N], moment about the root joint's centre [N·m].

    In the ground frame; None where no step of the trial was held out.

    Args:
        layouts: that the fit was judged on.
        trial: its name.
    """
    judged = [layout.trials[trial] for layout in layouts if layout.kind == STEPS and trial in layout.trials]
    told = [blocks for blocks in judged if blocks.products is not None]
    if not told:
        return None
    of_steps = np.concatenate([b.products / b.frames[:, None, None] for b in told if b.products is not None])
    wider = stdtrit(INDEPENDENT_A_STEP * len(of_steps), UPPER_QUANTILE) / ITS_STD
    return np.asarray(wider**2 * of_steps.mean(axis=0))


def _of_trial(trial: TrialFit, skeleton: Skeleton, layouts: Sequence[HeldOutLayout]) -> TrialFit:
    std, dynamics, contacts = trial.std, trial.dynamics, trial.contacts
    if std is None or std.torque_by_motion is None or std.power_by_motion is None:
        return trial
    assert dynamics is not None
    assert contacts is not None
    assert dynamics.wrench_is_predicted is not None
    feet, missing = contacts.foot_bodies, dynamics.wrench_is_predicted
    force = np.where(missing[:, :, None], np.nan, 0.0).repeat(3, axis=2)
    by_wrench = np.zeros_like(std.torque)
    for f, foot in enumerate(feet):
        by_wrench[np.ix_(missing[:, f], dofs_above(skeleton, foot))] = np.nan
    covariance = wrench_errors(layouts, trial.capture.name)
    if covariance is not None:
        bears = _bearing(trial)
        spared = np.any(bears, axis=1, keepdims=True) & ~bears  # another foot bears all
        for f, foot in enumerate(feet):
            by_wrench[np.ix_(spared[:, f], dofs_above(skeleton, foot))] = 0.0
            force[spared[:, f], f] = 0.0
        for f, foot in enumerate(feet):  # the root is above all feet: who bears has the last word
            leg, some = dofs_above(skeleton, foot), np.flatnonzero(bears[:, f])
            force[some, f] = np.sqrt(np.diagonal(covariance)[:3])
            errors = _errors_by_wrench(dynamics, skeleton, foot, some, covariance)
            by_wrench[np.ix_(some, leg)] = np.sqrt((errors**2).sum(axis=0))[:, leg]
    return replace(
        trial,
        std=replace(
            std,
            torque=np.hypot(std.torque_by_motion, by_wrench),
            power=np.hypot(std.power_by_motion, dynamics.motion.velocity * by_wrench),
            predicted_force_ground=force,
        ),
    )


def torque_errors_by_prediction(
    trial: TrialFit, skeleton: Skeleton, layouts: Sequence[HeldOutLayout], frame: int
) -> Float[np.ndarray, "dofs errors"]:
    """Independent errors of one frame's torques by predicted wrenches, a column each, if any rest on one.

    Args:
        trial: with bands.
        skeleton: of the fit.
        layouts: that the fit was judged on.
        frame: of the trial.
    """
    errors: list[Float[np.ndarray, "dofs errors"]] = [np.zeros((len(skeleton.dofs), 0))]
    covariance = wrench_errors(layouts, trial.capture.name)
    if covariance is not None and trial.std is not None and trial.std.torque_by_motion is not None:
        assert trial.contacts is not None
        assert trial.dynamics is not None
        for foot in np.array(trial.contacts.foot_bodies)[_bearing(trial)[frame]]:
            own = _errors_by_wrench(trial.dynamics, skeleton, foot, np.array([frame]), covariance)
            errors.append(np.where(dofs_above(skeleton, foot)[:, None], own[:, 0].T, 0.0))
    return np.hstack(errors)


def _bearing(trial: TrialFit) -> Bool[np.ndarray, "frames feet"]:
    """Feet without a force that carry all, where there is a pose."""
    dynamics = trial.dynamics
    assert dynamics is not None
    assert dynamics.wrench_is_predicted is not None
    assert dynamics.wrench_predicted_ground is not None
    vertical = dynamics.wrench_predicted_ground[:, :, 1]
    alone = _bears_alone(dynamics.wrench_is_predicted, vertical, dynamics.motion.rate)
    return np.logical_and(alone, trial.motion.posed[:, None])


def _errors_by_wrench(
    dynamics: Dynamics,
    skeleton: Skeleton,
    foot: str,
    frames: Int[np.ndarray, " some"],
    covariance: Float[np.ndarray, "6 6"],
) -> Float[np.ndarray, "modes some dofs"]:
    """By what each mode of the wrench's error on a foot changes the torques of these frames."""
    sizes, directions = np.linalg.eigh(covariance)
    q, model, body = dynamics.motion.q[frames], RigidBodyModel(skeleton), [skeleton.body_index(foot)]
    rest = np.zeros_like(q)
    unloaded, errors = model.inverse_dynamics(q, rest, rest), []
    for mode in (directions * np.sqrt(np.maximum(sizes, 0.0))).T:
        ground = about_point(np.tile(mode, (len(frames), 1)), -dynamics.root_ground[frames])
        errors.append(model.inverse_dynamics(q, rest, rest, ground[:, None], body) - unloaded)
    return np.array(errors)


def _bears_alone(
    missing: Bool[np.ndarray, "frames feet"], vertical: Float[np.ndarray, "frames feet"], rate: float
) -> Bool[np.ndarray, "frames feet"]:
    """Feet that carry all of what feet without a force carry, the frames around double support left out."""
    load = np.where(missing, np.maximum(vertical, 0.0), 0.0)
    total = load.sum(axis=1, keepdims=True)
    most = (total > 0) & (load >= SOLE_BEARER * total)
    around = np.ones((2 * round(CHANGE_S * rate) + 1, 1), dtype=bool)
    only = missing & (missing.sum(axis=1) == 1)[:, None]
    return only | (missing & binary_erosion(most, around, border_value=True))
