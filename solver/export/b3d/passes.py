"""Which passes a trial has, in which order, and what their headers say."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.formats.b3d.schema import PassFrames, PassHeader, PassType
from solver.capture.plates.conditioning import shared_cutoff
from solver.capture.plates.force_settings import ConditioningSettings
from solver.export.b3d.model import dofs_in_order, unlocked
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.settings import from_dict
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics, marker_positions
from solver.skeleton.skeleton import Skeleton

# Users take the first as input and the last as labels.
PASS_ORDER = (PassType.KINEMATICS, PassType.LOW_PASS_FILTER, PassType.DYNAMICS)


@dataclass(frozen=True)
class LowPassed:
    """A trial's motion of the markers after the filter that forces pass, and how far its markers are off."""

    motion: Motion
    errors: MarkerErrors
    cutoff_Hz: float


@dataclass(frozen=True)
class Pass:
    """One motion of a trial, and how it came about."""

    type: PassType
    motion: Motion
    errors: MarkerErrors
    cutoff_Hz: float = 0.0


def passes_of(fit: Fit, trial: TrialFit, filtered: LowPassed | None = None) -> list[Pass]:
    """What markers alone say, that low-passed, and what a fit to forces made of it where there was one.

    Args:
        fit: the solved subject.
        trial: of it.
        filtered: the second pass; None: made here.
    """
    before = trial.kinematics_only
    motion, errors = (before.motion, before.marker_errors) if before else (trial.motion, trial.marker_errors)
    low = filtered or _low_passed(fit, trial, motion, errors)
    passes = [
        Pass(PassType.KINEMATICS, motion, errors),
        Pass(PassType.LOW_PASS_FILTER, low.motion, low.errors, low.cutoff_Hz),
    ]
    return [*passes, Pass(PassType.DYNAMICS, trial.motion, trial.marker_errors)] if before else passes


def _low_passed(fit: Fit, trial: TrialFit, motion: Motion, errors: MarkerErrors) -> LowPassed:
    """The motion that torques belong to where no trajectory was fitted; else through the same filter."""
    settings = from_dict(fit.settings)
    cutoff = shared_cutoff(motion.rate, settings.conditioning)
    if trial.forces_predicted:
        cutoff = settings.dynamics.unmeasured_cutoff_Hz
    if trial.dynamics is not None and trial.kinematics_only is None:
        low = trial.dynamics.motion
    else:
        low = motion.low_passed(cutoff, settings.conditioning.order)
    if fit.groundwork is not None:
        observed = fit.groundwork.match.observed(trial.capture.markers)
        apart = marker_positions(fit.skeleton, low.q) - observed
        errors = MarkerErrors(errors.names, np.linalg.norm(apart, axis=2))
    return LowPassed(low, errors, cutoff if "conditioning" in fit.settings else 0.0)


def pass_header(fit: Fit, trial: TrialFit, one: Pass, frames: PassFrames) -> PassHeader:
    """What the format says of a pass, frame by frame.

    Args:
        fit: the solved subject.
        trial: of it.
        one: of its passes.
        frames: of that pass.
    """
    dofs = dofs_in_order(fit.skeleton)
    linear, angular = generalized_residuals(fit.skeleton, frames)
    conditioning = _conditioning(fit)
    return PassHeader(
        type=one.type,
        dof_positions_observed=_observed(fit.skeleton, one.errors),
        dof_velocities_finite_differenced=np.ones(len(dofs), dtype=bool),
        dof_acceleration_finite_differenced=np.ones(len(dofs), dtype=bool),
        marker_rms=one.errors.rms_per_frame,
        marker_max=one.errors.maximum_per_frame,
        linear_residual=linear,
        angular_residual=angular,
        joints_max_velocity=np.abs(frames.vel).max(axis=1),
        lowpass_cutoff_frequency=one.cutoff_Hz,
        lowpass_filter_order=conditioning.order if one.cutoff_Hz and conditioning else 0,
        force_plate_cutoff=np.full(
            len(trial.capture.plates), conditioning.threshold_N if conditioning else 0.0
        ),
    )


def generalized_residuals(
    skeleton: Skeleton, frames: PassFrames
) -> tuple[Float[np.ndarray, " frames"], Float[np.ndarray, " frames"]]:
    """Norms of the root's generalized forces [N] and torques about its Euler axes [N·m]; 0 at both ends.

    Args:
        skeleton: of the pass.
        frames: of the pass.
    """
    dofs, root, names = dofs_in_order(skeleton), root_joint(unlocked(skeleton)), unlocked(skeleton).dofs
    norms, tau = [], np.asarray(frames.tau)
    for own in (root.translation_dofs, root.rotation_dofs):
        norm = np.linalg.norm(tau[:, [dofs.index(names[i]) for i in own]], axis=1)
        norm[[0, -1]] = 0.0
        norms.append(norm)
    return norms[0], norms[1]


def _observed(skeleton: Skeleton, errors: MarkerErrors) -> Bool[np.ndarray, " dofs"]:
    """Whether a coordinate moves any marker that the trial shows."""
    kinematics = ForwardKinematics(unlocked(skeleton))
    seen = {name for name, d in zip(errors.names, errors.distance.T, strict=True) if np.isfinite(d).any()}
    bodies = [marker.body for marker in skeleton.markers if marker.name in seen]
    moves = kinematics.carries[:, bodies].any(axis=1)
    moving = {kinematics.skeleton.dofs[dof] for dof in kinematics.chain.dof[moves]}
    locked = {c.name for c in skeleton.coordinates if c.locked}
    return np.array([name in moving - locked for name in dofs_in_order(skeleton)])


def _conditioning(fit: Fit) -> ConditioningSettings | None:
    """The filter and thresholds that the fit was made with."""
    return from_dict(fit.settings).conditioning if "conditioning" in fit.settings else None
