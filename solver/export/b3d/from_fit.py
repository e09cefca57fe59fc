"""A fit as a .b3d file."""

from collections.abc import Mapping, Sequence
from importlib.metadata import version

import numpy as np
from jaxtyping import Bool, Float

from solver.contact.mask import REVIEWED
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.export.b3d.model import dofs_in_order, joints_in_order, unlocked
from solver.export.b3d.pass_frames import ContactForces, pass_frames
from solver.export.b3d.reasons import reasons_per_frame
from solver.export.b3d.schema import (
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
from solver.export.b3d.sensor_frames import corners, marker_names, sensor_frames
from solver.fit import Fit, TrialFit
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.skeleton import Skeleton
from solver.summary import all_notes


def fit_to_b3d(fit: Fit) -> B3dFile:
    """The fit as a subject with one pass a trial, whose motion is the one that the joint torques belong to.

    Args:
        fit: the solved subject; trials without forces have their motion, and every frame says why.

    Raises:
        ModelError: the skeleton's root is not free to move in all six ways, or OpenSim cannot hold the skeleton.
    """
    bodies = _contact_bodies(fit)
    names = marker_names([trial.capture for trial in fit.trials])
    plates = max((len(trial.capture.plates) for trial in fit.trials), default=0)
    trials = []
    for trial in fit.trials:
        contact = _contact_forces(trial, bodies)
        frames = pass_frames(fit.skeleton, _motion(trial), contact)
        sensors = sensor_frames(trial.capture, names, plates)
        trials.append(B3dTrial(_trial_header(trial, frames, fit), sensors, (frames,)))
    return B3dFile(_header(fit, bodies, names, tuple(trial.header for trial in trials)), tuple(trials))


def _header(
    fit: Fit, bodies: Sequence[str], names: Sequence[str], trials: tuple[TrialHeader, ...]
) -> Header:
    subject = fit.subject
    return Header(
        num_dofs=len(dofs_in_order(fit.skeleton)),
        num_joints=len(joints_in_order(fit.skeleton)),
        num_trials=len(trials),
        passes=(PassModel(PassType.KINEMATICS, skeleton_text(fit.skeleton)),),
        ground_contact_body=tuple(bodies),
        trial_header=trials,
        version=VERSION,
        notes="\n".join([f"addb-viewer {version('addb-viewer')}", *all_notes(fit)]),
        biological_sex=subject.sex or "unknown",
        height_m=fit.height_m,
        mass_kg=fit.mass_kg,
        age_years=round(subject.age_years) if subject.age_years is not None else 0,
        marker_name=tuple(names),
        subject_tag=subject.tags,
        data_quality=DataQuality.EXPERIMENTAL,
    )


def _trial_header(trial: TrialFit, frames: PassFrames, fit: Fit) -> TrialHeader:
    markers, count = trial.capture.markers, trial.motion.frames
    reviewed = trial.mask is not None and trial.mask.source in ("review", "review.json")
    return TrialHeader(
        name=trial.capture.name,
        missing_GRF_reason=reasons_per_frame(trial.mask, count),
        trial_length=count,
        trial_timestep=1 / markers.rate,
        processing_pass_header=(_pass_header(trial, frames, fit),),
        num_force_plates=len(trial.capture.plates),
        force_plate_corners=corners(trial.capture),
        original_name=trial.capture.name,
        original_end_frame=count,
        original_start_time=markers.start_time,
        original_end_time=markers.start_time + count / markers.rate,
        has_manual_GRF_annotation=np.full(count, reviewed),
        trial_type=TrialType.OTHER,  # nobody has said where it was
    )


def _pass_header(trial: TrialFit, frames: PassFrames, fit: Fit) -> PassHeader:
    dofs = dofs_in_order(fit.skeleton)
    linear, angular = _generalized_residuals(frames, fit.skeleton)
    conditioning = _stage(fit, "conditioning") if trial.dynamics else {}
    ...
