"""A .b3d file: recordings, and the model, motion, torques and forces of its last pass."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Capture, Markers
from solver.capture.formats.b3d.b3d_fields import (
    VERSION,
    B3dFile,
    B3dTrial,
    DataQuality,
    Header,
    PassFrames,
    PassHeader,
    PassModel,
    PassType,
)
from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.capture.formats.b3d.b3d_trial import read_b3d_trial, trials_in
from solver.capture.plates.force_settings import CONDITIONING
from solver.capture.subject.measured_files import MARK
from solver.common.errors import CaptureError
from solver.export.b3d.from_fit import generalized_residuals
from solver.export.b3d.pass_frames import (
    ContactForces,
    dofs_in_order,
    joints_in_order,
    marker_names,
    pass_frames,
    sensor_frames,
    trial_header,
)
from solver.export.conversion.file_content import BodyForces, Content, Part, Trial
from solver.kinematics.motion import Motion
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.skeleton import Skeleton

UNLOADED_N = 1e-9  # a body without a force has no centre of pressure
OTHERS = {
    "emg_obs": "EMG",
    "acc_obs": "accelerometers",
    "gyro_obs": "gyroscopes",
    "exo_obs": "exoskeleton torques",
}


def read_b3d_file(path: Path) -> Content:
    """All trials of a .b3d file, segments put together.

    Raises:
        CaptureError: the file is damaged.
        ModelError: its model cannot be read.
    """
    b3d = read_b3d(path)
    header = b3d.header
    text = header.passes[-1].model_osim_text if header.passes else None
    skeleton = load_skeleton(path, text) if text else None
    trials, notes = [], []
    for found in trials_in(b3d):
        recorded = read_b3d_trial(path, found.name)
        trial = Trial(found.name, recorded.markers, recorded.plates)
        if skeleton is not None:
            trial, said = _with_motion(trial, skeleton, header, [b3d.trials[k] for k in found.segments])
            notes += [f"{found.name}: {note}" for note in said]
        notes += [f"{found.name}: {note}" for note in recorded.notes]
        trials.append(trial)
    return Content(
        source=path,
        trials=tuple(trials),
        skeleton=skeleton,
        model_text=text,
        mass_kg=header.mass_kg or None,
        height_m=header.height_m or None,
        left_behind=_left_behind(b3d),
        notes=tuple(notes),
    )


def _with_motion(
    trial: Trial, skeleton: Skeleton, header: Header, segments: Sequence[B3dTrial]
) -> tuple[Trial, tuple[str, ...]]:
    """The trial with what its pass of the last model's kind says."""
    kind = header.passes[-1].pass_type
    passes = [_pass_of(segment, kind) for segment in segments]
    if any(one is None for one in passes):
        return trial, (f"it has no {PassType(kind).name.lower()} pass, so its motion is not converted",)
    own = [one for one in passes if one is not None]
    names = dofs_in_order(skeleton)
    if own[0].pos.shape[1] != len(names):
        said = f"{own[0].pos.shape[1]} coordinates are stored, but its model has {len(names)}"
        return trial, (f"{said}, so its motion is not converted",)
    columns = [names.index(name) for name in skeleton.dofs]
    rate, start = 1 / segments[0].header.trial_timestep, float(segments[0].header.original_start_time)
    motion = Motion(skeleton.dofs, _joined([one.pos for one in own])[:, columns], rate, start)
    torques = _joined([one.tau for one in own])
    return replace(
        trial,
        motion=motion,
        torques=torques[:, columns] if torques.shape[1] == len(names) else None,
        contacts=_contacts(header.ground_contact_body, own),
    ), ()


def _pass_of(segment: B3dTrial, kind: int) -> PassFrames | None:
    of_kind = [
        frames
        for about, frames in zip(segment.header.processing_pass_header, segment.passes, strict=True)
        if about.type == kind
    ]
    return of_kind[-1] if of_kind else None


def _contacts(bodies: Sequence[str], passes: Sequence[PassFrames]) -> BodyForces | None:
    """Forces as the pass used them; they press at the height of their stored centres of pressure."""
    if not bodies or any(one.ground_contact_wrench.shape[1] != 6 * len(bodies) for one in passes):
        return None
    stored = _joined([one.ground_contact_wrench for one in passes]).reshape(-1, len(bodies), 6)
    wrench = np.concatenate([stored[..., 3:], stored[..., :3]], axis=2)  # theirs begins with the moment
    force, moment = wrench[..., :3], wrench[..., 3:]
    points = [one.ground_contact_center_of_pressure for one in passes]
    height = np.zeros(wrench.shape[:2])
    if all(one.shape[1] == 3 * len(bodies) for one in points):
        height = _joined(points).reshape(-1, len(bodies), 3)[..., 1]
    loaded = np.abs(force[..., 1]) > UNLOADED_N
    up = np.where(loaded, force[..., 1], np.nan)
    # of r × F = M without its vertical part, at the known height
    x = (moment[..., 2] + height * force[..., 0]) / up
    z = (height * force[..., 2] - moment[..., 0]) / up
    return BodyForces(tuple(bodies), wrench, np.stack([x, np.where(loaded, height, np.nan), z], axis=2))


def _joined(series: Sequence[np.ndarray]) -> Float[np.ndarray, "frames columns"]:
    return np.concatenate([np.array(each, dtype=float) for each in series])


def _left_behind(b3d: B3dFile) -> tuple[str, ...]:
    header = b3d.header
    left = []
    if len(header.passes) > 1:
        left.append(f"all passes but the last of {len(header.passes)}")
    if any(np.any(np.asarray(about.missing_GRF_reason)) for about in header.trial_header):
        left.append("the reasons why frames miss forces")
    for name, words in OTHERS.items():
        if any(np.size(getattr(trial.sensors, name)) for trial in b3d.trials):
            left.append(words)
    return tuple(left)


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
        trials.append(B3dTrial(trial_header(capture, abouts), sensors, passes))
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
    if trial.contacts is None:
        frames = trial.motion.frames
        return ContactForces.on(bodies, (), np.zeros((frames, 0, 6)), np.zeros((frames, 0)))
    contacts = trial.contacts
    return ContactForces.on(bodies, contacts.bodies, contacts.wrench_ground, contacts.cop_ground[..., 1])


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
