"""Recordings, and motions where there are some, as a .b3d file."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from solver.capture.capture import Capture, Markers
from solver.capture.formats.b3d.schema import (
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
from solver.capture.plates.force_settings import CONDITIONING
from solver.capture.subject.measured_files import MARK
from solver.common.errors import CaptureError
from solver.export.b3d.model import dofs_in_order, joints_in_order
from solver.export.b3d.pass_frames import ContactForces, pass_frames
from solver.export.b3d.passes import generalized_residuals
from solver.export.b3d.sensor_frames import corners, marker_names, sensor_frames
from solver.export.b3d.writer import write_b3d
from solver.export.conversion.content import Content, Part, Trial
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.skeleton import Skeleton


def write_b3d_file(content: Content, path: Path) -> tuple[str, ...]:
    """Write all trials; those with a motion get one pass, whose torques follow from motion and forces.

    Raises:
        CaptureError: the file cannot be written, or a trial has neither markers nor a motion.
        ModelError: the root of the model is not free to move.
    """
    captures = [_capture(trial, path) for trial in content.trials]
    names = marker_names(captures)
    plates = max((len(capture.plates) for capture in captures), default=0)
    bodies = _bodies(content.trials)
    kind = PassType.DYNAMICS if bodies else PassType.KINEMATICS
    trials, notes = [], []
    for trial, capture in zip(content.trials, captures, strict=True):
        passes: tuple[PassFrames, ...] = ()
        abouts: tuple[PassHeader, ...] = ()
        if trial.motion is not None and content.skeleton is not None:
            if trial.motion.frames == capture.markers.frames:
                passes = (pass_frames(content.skeleton, trial.motion, _contact_forces(trial, bodies)),)
                abouts = (_pass_header(content.skeleton, passes[0], kind),)
            else:
                notes.append(f"{path.name}: {trial.name}: motion and markers have other frames; markers only")
        sensors = sensor_frames(capture, names, plates, CONDITIONING)
        trials.append(B3dTrial(_trial_header(capture, abouts), sensors, passes))
    write_b3d(B3dFile(_header(content, names, bodies, kind, trials), tuple(trials)), path)
    return (*notes, *_changed(content, captures, path))


def _capture(trial: Trial, path: Path) -> Capture:
    """The trial's recording; without markers, as many frames as the motion has."""
    if trial.markers is not None:
        return Capture(trial.name, trial.markers, trial.plates)
    if trial.motion is None:
        raise CaptureError(
            f"{path}: trial {trial.name} has neither markers nor a motion. Choose another ending."
        )
    nothing = np.zeros((trial.motion.frames, 0, 3))
    return Capture(trial.name, Markers((), nothing, trial.motion.rate, trial.motion.start_time), trial.plates)


def _bodies(trials: Sequence[Trial]) -> tuple[str, ...]:
    """Those that forces act on in any trial."""
    return tuple(dict.fromkeys(body for trial in trials if trial.contacts for body in trial.contacts.bodies))


def _contact_forces(trial: Trial, bodies: Sequence[str]) -> ContactForces:
    assert trial.motion is not None
    frames = trial.motion.frames
    force, moment = np.zeros((2, frames, len(bodies), 3))
    height = np.full((frames, len(bodies)), np.nan)
    if trial.contacts is not None:
        own = [bodies.index(body) for body in trial.contacts.bodies]
        force[:, own], moment[:, own] = np.split(trial.contacts.wrench_ground, 2, axis=2)
        height[:, own] = trial.contacts.cop_ground[..., 1]
    return ContactForces(bodies, force, moment, height)


def _header(
    content: Content, names: Sequence[str], bodies: Sequence[str], kind: PassType, trials: Sequence[B3dTrial]
) -> Header:
    skeleton = content.skeleton if any(trial.passes for trial in trials) else None
    return Header(
        num_dofs=len(dofs_in_order(skeleton)) if skeleton else 0,
        num_joints=len(joints_in_order(skeleton)) if skeleton else 0,
        num_trials=len(trials),
        passes=(PassModel(kind, skeleton_text(skeleton)),) if skeleton else (),
        ground_contact_body=tuple(bodies) if skeleton else (),
        trial_header=tuple(trial.header for trial in trials),
        version=VERSION,
        notes=f"{MARK}, converted from {content.source.name}",
        biological_sex="unknown",
        height_m=content.height_m or 0.0,
        mass_kg=content.mass_kg or 0.0,
        marker_name=tuple(names),
        data_quality=DataQuality.EXPERIMENTAL,
    )


def _trial_header(capture: Capture, passes: tuple[PassHeader, ...]) -> TrialHeader:
    markers = capture.markers
    return TrialHeader(
        name=capture.name,
        missing_GRF_reason=np.zeros(markers.frames, dtype=int),
        trial_length=markers.frames,
        trial_timestep=1 / markers.rate,
        processing_pass_header=passes,
        num_force_plates=len(capture.plates),
        force_plate_corners=corners(capture),
        original_name=capture.name,
        original_end_frame=markers.frames,
        original_start_time=markers.start_time,
        original_end_time=markers.start_time + markers.frames / markers.rate,
        has_manual_GRF_annotation=np.zeros(markers.frames, dtype=bool),
        trial_type=TrialType.OTHER,
    )


def _pass_header(skeleton: Skeleton, frames: PassFrames, kind: PassType) -> PassHeader:
    """What follows from the frames; how far markers are off is not known here."""
    linear, angular = generalized_residuals(skeleton, frames)
    every = np.ones(frames.pos.shape[1], dtype=bool)
    unknown = np.full(len(frames.pos), np.nan)
    return PassHeader(
        type=kind,
        dof_positions_observed=every,
        dof_velocities_finite_differenced=every,
        dof_acceleration_finite_differenced=every,
        marker_rms=unknown,
        marker_max=unknown,
        linear_residual=linear,
        angular_residual=angular,
        joints_max_velocity=np.abs(frames.vel).max(axis=1),
    )


def _changed(content: Content, captures: Sequence[Capture], path: Path) -> tuple[str, ...]:
    """What the file holds otherwise than it was read."""
    notes = []
    faster = [f"{c.name} ({p.name})" for c in captures for p in c.plates if p.rate > 1.001 * c.markers.rate]
    if faster:
        notes.append(f"{path.name}: holds plates at the markers' frames only; resampled: {', '.join(faster)}")
    if Part.TORQUES in content.parts():
        notes.append(f"{path.name}: joint torques are computed anew from the motion and the forces on bodies")
    if Part.CONTACTS in content.parts():
        notes.append(f"{path.name}: no frame is marked as missing forces, since it is not known which do")
    return tuple(notes)
