"""A fit as a .b3d file."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from solver.capture.formats.b3d.schema import (
    VERSION,
    B3dFile,
    B3dTrial,
    DataQuality,
    Header,
    PassHeader,
    PassModel,
    PassType,
    TrialHeader,
    TrialType,
)
from solver.contact.wrenches import FILE, PERSON
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.export.b3d.model import dofs_in_order, joints_in_order
from solver.export.b3d.pass_frames import ContactForces, pass_frames
from solver.export.b3d.passes import PASS_ORDER, LowPassed, pass_header, passes_of
from solver.export.b3d.reasons import reasons_per_frame
from solver.export.b3d.sensor_frames import corners, marker_names, sensor_frames
from solver.export.b3d.series_on_disk import SeriesOnDisk, on_disk
from solver.export.b3d.writer import write_b3d
from solver.export.places import file_stem, made
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.settings import from_dict
from solver.fitting.summary import all_notes
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.skeleton import Skeleton


def fit_to_b3d(
    fit: Fit,
    filtered: Mapping[str, LowPassed] | None = None,
    *,
    only: str | None = None,
    scratch: Path | None = None,
) -> B3dFile:
    """The fit as a subject: of each trial what markers alone say, that low-passed, and what forces add.

    The last pass of a trial has the motion that its joint torques and residuals belong to. The first is
    computed with the inertias from before the fit, scaled to its mass: fitted ones have seen the forces.

    Args:
        fit: the solved subject; in trials without forces every frame says so.
        filtered: by trial, its low-passed pass; None: filtered here, as the fit's settings say.
        only: name of the one trial that is wanted, with the markers, plates and bodies of all; None: all are.
        scratch: folder on a disk, for what long trials' passes hold; None: memory holds it.

    Raises:
        ModelError: the skeleton's root is not free in all six ways, or OpenSim cannot hold the skeleton.
    """
    bodies = _contact_bodies(fit)
    names = marker_names([trial.capture for trial in fit.trials])
    plates = max((len(trial.capture.plates) for trial in fit.trials), default=0)
    models = {kind: unfitted(fit) if kind is PassType.KINEMATICS else fit.skeleton for kind in PASS_ORDER}
    trials = []
    for trial in fit.trials:
        if only not in (None, trial.capture.name):
            continue
        contact = _contact_forces(trial, bodies)
        passes = passes_of(fit, trial, (filtered or {}).get(trial.capture.name))
        frames = tuple(pass_frames(models[one.type], one.motion, contact, scratch) for one in passes)
        headers = [pass_header(fit, trial, one, own) for one, own in zip(passes, frames, strict=True)]
        sensors = sensor_frames(trial.capture, names, plates, from_dict(fit.settings).conditioning)
        if scratch is not None and isinstance(frames[0].pos, SeriesOnDisk):
            sensors = replace(sensors, marker_obs=on_disk(sensors.marker_obs, scratch))
        trials.append(B3dTrial(_trial_header(trial, headers), sensors, frames))
    made = {about.type for trial in trials for about in trial.header.processing_pass_header}
    types = [kind for kind in PASS_ORDER if kind in made]
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
        height_m=float(np.nan_to_num(fit.height_m)),
        mass_kg=float(np.nan_to_num(fit.mass_kg)),
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
