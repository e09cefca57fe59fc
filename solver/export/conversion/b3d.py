"""A .b3d file: recordings, and the model, motion, torques and forces of its last pass."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.formats.b3d.reader import read_b3d
from solver.capture.formats.b3d.recording import read_b3d_trial
from solver.capture.formats.b3d.schema import B3dFile, B3dTrial, Header, PassFrames, PassType
from solver.capture.formats.b3d.segments import trials_in
from solver.capture.reading_settings import READING, ReadingSettings
from solver.export.b3d.model import dofs_in_order
from solver.export.conversion.content import BodyForces, Content, Trial
from solver.kinematics.motion import Motion
from solver.skeleton.osim import load_skeleton
from solver.skeleton.skeleton import Skeleton

UNLOADED_N = 1e-9  # a body without a force has no centre of pressure
OTHERS = {
    "emg_obs": "EMG",
    "acc_obs": "accelerometers",
    "gyro_obs": "gyroscopes",
    "exo_obs": "exoskeleton torques",
}


def read_b3d_file(path: Path, settings: ReadingSettings = READING) -> Content:
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
        recorded = read_b3d_trial(path, found.name, settings.edge_zeros)
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
