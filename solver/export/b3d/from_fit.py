"""A fit as a .b3d file."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.b3d.schema import (
    VERSION,
    B3dFile,
    B3dTrial,
    DataQuality,
    Header,
    PassFrames,
    PassHeader,
    PassModel,
    PassType,
    TrialHeader,
    TrialType,
)
from solver.capture.conditioning import shared_cutoff
from solver.capture.force_settings import ConditioningSettings
from solver.contact.wrenches import FILE, PERSON
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.export.b3d.model import dofs_in_order, joints_in_order, unlocked
from solver.export.b3d.pass_frames import ContactForces, pass_frames
from solver.export.b3d.reasons import reasons_per_frame
from solver.export.b3d.sensor_frames import corners, marker_names, sensor_frames
from solver.export.b3d.writer import write_b3d
from solver.export.places import file_stem, made
from solver.fit import Fit, TrialFit
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.settings import from_dict
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.skeleton import Skeleton
from solver.summary import all_notes


@dataclass(frozen=True)
class _Pass:
    """One motion of a trial, and how it came about."""

    type: PassType
    motion: Motion
    errors: MarkerErrors
    low_passed: bool


def fit_to_b3d(fit: Fit) -> B3dFile:
    """The fit as a subject: for each trial what markers alone say and, where it was fitted, what forces add.

    The last pass of a trial has the motion that its joint torques and residuals belong to. The first is
    computed with the inertias from before the fit, scaled to its mass: fitted ones have seen the forces.

    Args:
        fit: the solved subject; in trials without forces every frame says so.

    Raises:
        ModelError: the skeleton's root is not free in all six ways, or OpenSim cannot hold the skeleton.
    """
    bodies = _contact_bodies(fit)
    names = marker_names([trial.capture for trial in fit.trials])
    plates = max((len(trial.capture.plates) for trial in fit.trials), default=0)
    models = {PassType.KINEMATICS: unfitted(fit), PassType.DYNAMICS: fit.skeleton}
    trials = []
    for trial in fit.trials:
        contact = _contact_forces(trial, bodies)
        passes = _passes(trial)
        frames = tuple(pass_frames(models[one.type], one.motion, contact) for one in passes)
        headers = [_pass_header(fit, trial, one, own) for one, own in zip(passes, frames, strict=True)]
        sensors = sensor_frames(trial.capture, names, plates, from_dict(fit.settings).conditioning)
        trials.append(B3dTrial(_trial_header(trial, headers), sensors, frames))
    types = sorted({PassType(about.type) for t in trials for about in t.header.processing_pass_header})
    return B3dFile(
        _header(fit, bodies, names, [(kind, models[kind]) for kind in types], trials), tuple(trials)
    )


def unfitted(fit: Fit) -> Skeleton:
    """The fitted skeleton with the masses and inertias from before forces were fitted, at the same mass."""
    before = fit.skeleton if fit.groundwork is None else fit.groundwork.skeleton
    factor = fit.skeleton.mass / before.mass
    bodies = tuple(
        replace(body, mass=factor * own.mass, com_body=own.com_body, inertia_body=factor * own.inertia_body)
        for body, own in zip(fit.skeleton.bodies, before.bodies, strict=True)
    )
    return replace(fit.skeleton, bodies=bodies)


def export_b3d(fit: Fit, folder: Path) -> list[Path]:
    """Write SUBJECT.b3d.

    Raises:
        FitError, CaptureError: the folder cannot be made, or not written to.
        ModelError: as `fit_to_b3d`.
    """
    path = made(folder) / f"{file_stem(fit.subject.name)}.b3d"
    write_b3d(fit_to_b3d(fit), path)
    return [path]


def _passes(trial: TrialFit) -> list[_Pass]:
    if trial.kinematics_only is not None:
        before = trial.kinematics_only
        return [
            _Pass(PassType.KINEMATICS, before.motion, before.marker_errors, low_passed=False),
            _Pass(PassType.DYNAMICS, trial.motion, trial.marker_errors, low_passed=False),
        ]
    if trial.dynamics is not None:
        return [_Pass(PassType.KINEMATICS, trial.dynamics.motion, trial.marker_errors, low_passed=True)]
    return [_Pass(PassType.KINEMATICS, trial.motion, trial.marker_errors, low_passed=False)]


def _contact_bodies(fit: Fit) -> tuple[str, ...]:
    """Those that forces were given to; the subject's feet where no trial has forces."""
    given = dict.fromkeys(
        body for trial in fit.trials if trial.contacts for body in trial.contacts.foot_bodies
    )
    return tuple(given) or tuple(body for body in fit.subject.foot_bodies if body in fit.skeleton.body_names)


def _contact_forces(trial: TrialFit, bodies: Sequence[str]) -> ContactForces:
    """As the torques were computed with them: a force that doesn't count is zero."""
    frames = trial.motion.frames
    force, moment = np.zeros((2, frames, len(bodies), 3))
    height = np.full((frames, len(bodies)), np.nan)
    if trial.contacts is not None and trial.mask is not None:
        wrenches = counted_wrenches(trial.contacts.wrench_ground, trial.mask)
        heights = np.where(trial.mask.counts, trial.contacts.cop_ground[..., 1], np.nan)
        columns = [bodies.index(body) for body in trial.contacts.foot_bodies]
        force[:, columns], moment[:, columns] = wrenches[..., :3], wrenches[..., 3:]
        height[:, columns] = heights
    return ContactForces(bodies, force, moment, height)


def _header(
    fit: Fit,
    bodies: Sequence[str],
    names: Sequence[str],
    models: Sequence[tuple[PassType, Skeleton]],
    trials: Sequence[B3dTrial],
) -> Header:
    subject = fit.subject
    return Header(
        num_dofs=len(dofs_in_order(fit.skeleton)),
        num_joints=len(joints_in_order(fit.skeleton)),
        num_trials=len(trials),
        passes=tuple(PassModel(kind, skeleton_text(model)) for kind, model in models),
        ground_contact_body=tuple(bodies),
        trial_header=tuple(trial.header for trial in trials),
        version=VERSION,
        notes="\n".join([f"addb-viewer {fit.provenance.get('addb-viewer', '')}".strip(), *all_notes(fit)]),
        biological_sex=subject.sex or "unknown",
        height_m=fit.height_m,
        mass_kg=fit.mass_kg,
        age_years=0 if subject.age_years is None else round(subject.age_years),
        marker_name=tuple(names),
        subject_tag=subject.tags,
        data_quality=DataQuality.EXPERIMENTAL,
    )


def _trial_header(trial: TrialFit, passes: Sequence[PassHeader]) -> TrialHeader:
    markers, frames = trial.capture.markers, trial.motion.frames
    mask = trial.mask
    reviewed = np.zeros((frames, 1), dtype=bool) if mask is None else mask.decided(PERSON, FILE)
    return TrialHeader(
        name=trial.capture.name,
        missing_GRF_reason=reasons_per_frame(trial.mask, frames),
        trial_length=frames,
        trial_timestep=1 / markers.rate,
        processing_pass_header=tuple(passes),
        num_force_plates=len(trial.capture.plates),
        force_plate_corners=corners(trial.capture),
        original_name=trial.capture.name,
        original_end_frame=frames,
        original_start_time=markers.start_time,
        original_end_time=markers.start_time + frames / markers.rate,
        has_manual_GRF_annotation=np.any(reviewed, axis=1),
        trial_type=TrialType.OTHER,  # nobody has said where it was
    )


def _pass_header(fit: Fit, trial: TrialFit, one: _Pass, frames: PassFrames) -> PassHeader:
    dofs = dofs_in_order(fit.skeleton)
    linear, angular = generalized_residuals(fit.skeleton, frames)
    conditioning = _conditioning(fit)
    cutoff = 0.0
    if one.low_passed and conditioning:
        cutoff = shared_cutoff(one.motion.rate, conditioning)
        if trial.forces_foretold:
            cutoff = from_dict(fit.settings).dynamics.unmeasured_cutoff_Hz
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
        lowpass_cutoff_frequency=cutoff,
        lowpass_filter_order=conditioning.order if cutoff and conditioning else 0,
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
    norms = []
    for own in (root.translation_dofs, root.rotation_dofs):
        norm = np.linalg.norm(frames.tau[:, [dofs.index(names[i]) for i in own]], axis=1)
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
