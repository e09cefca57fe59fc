"""A fit as a .b3d file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.capture.atomic import made_folder
from solver.capture.formats.b3d.b3d_fields import (
    REASONS,
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
)
from solver.capture.formats.b3d.b3d_file import write_b3d
from solver.capture.plates.conditioning import shared_cutoff
from solver.capture.plates.force_settings import ConditioningSettings
from solver.contact.mask import (
    ERRONEOUS,
    NOT_RECORDED,
    OUTSIDE_RANGES,
    REVIEWED,
    TOO_FEW_MARKERS,
    TWO_FEET_ON_ONE_PLATE,
)
from solver.contact.wrenches import FILE, PERSON, RECORDING, SOURCES, FrameMask
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.export.b3d.pass_frames import (
    ContactForces,
    SeriesOnDisk,
    dofs_in_order,
    joints_in_order,
    marker_names,
    on_disk,
    pass_frames,
    sensor_frames,
    trial_header,
    unlocked,
)
from solver.export.export_places import file_stem
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.settings import from_dict
from solver.fitting.summary import all_notes
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics, marker_positions
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.skeleton import Skeleton

NEAREST = {
    TOO_FEW_MARKERS: "hasInputOutliers",
    TWO_FEET_ON_ONE_PLATE: "notOverForcePlate",  # no plate to itself
    OUTSIDE_RANGES: REVIEWED,
    ERRONEOUS: REVIEWED,
}  # reasons of our own and the format's nearest one
UNNAMED = "unmeasuredExternalForceDetected"  # the force doesn't count, and nobody said why
# Users take the first as input and the last as labels.
PASS_ORDER = (PassType.KINEMATICS, PassType.LOW_PASS_FILTER, PassType.DYNAMICS)
STD_OF = {"pos": "angle", "vel": "speed", "acc": "acceleration", "tau": "torque"}  # as `TrialStd` calls them


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
    has_std = any(trial.std is not None for trial in fit.trials)
    models = {
        kind: with_unfitted_masses(fit) if kind is PassType.KINEMATICS else fit.skeleton
        for kind in PASS_ORDER
    }
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
        if has_std:
            sensors = replace(sensors, custom_values=_std(trial, fit.skeleton))
        trials.append(B3dTrial(_trial_header(trial, headers), sensors, frames))
    made = {about.type for trial in trials for about in trial.header.processing_pass_header}
    types = [kind for kind in PASS_ORDER if kind in made]
    header = _header(fit, bodies, names, [(kind, models[kind]) for kind in types], trials)
    if has_std:
        lengths = np.array([header.num_dofs] * len(STD_OF) + [3], np.int32)
        std_names = tuple(f"{name}_std" for name in (*STD_OF, "com_pos"))
        header = replace(header, custom_value_name=std_names, custom_value_length=lengths)
    return B3dFile(header, tuple(trials))


def _std(trial: TrialFit, skeleton: Skeleton) -> Float[np.ndarray, "frames n"]:
    """Standard deviations of the last pass' coordinates and centre of mass, NaN where none is known.

    `tau` has none on frames whose force does not count: it lacks that force.
    """
    dofs, frames = dofs_in_order(skeleton), trial.motion.frames
    of_dofs, of_com = np.full((len(STD_OF), frames, len(dofs)), np.nan), np.full((frames, 3), np.nan)
    if trial.std is not None:
        free = [dofs.index(name) for name in skeleton.dofs]
        of_dofs[:, :, free] = [getattr(trial.std, name) for name in STD_OF.values()]
        of_dofs[list(STD_OF).index("tau"), ~trial.forces_known] = np.nan
        of_com[:] = trial.std.com_ground
    return np.hstack([*of_dofs, of_com])


def with_unfitted_masses(fit: Fit) -> Skeleton:
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
        CaptureError: the folder cannot be made, or not written to.
        ModelError: as `fit_to_b3d`.
    """
    path = made_folder(folder) / f"{file_stem(fit.subject.name)}.b3d"
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
    if trial.contacts is None or trial.mask is None:
        frames = trial.motion.frames
        return ContactForces.on(bodies, (), np.zeros((frames, 0, 6)), np.zeros((frames, 0)))
    wrenches = counted_wrenches(trial.contacts.wrench_ground, trial.mask)
    heights = np.where(trial.mask.counts, trial.contacts.cop_ground[..., 1], np.nan)
    return ContactForces.on(bodies, trial.contacts.foot_bodies, wrenches, heights)


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
    header = trial_header(trial.capture, passes)
    annotated = header.has_manual_GRF_annotation if trial.mask is None else trial.mask.decided(PERSON, FILE)
    return replace(
        header,
        missing_GRF_reason=reasons_per_frame(trial.mask, trial.motion.frames),
        has_manual_GRF_annotation=np.any(annotated.reshape(trial.motion.frames, -1), axis=1),
    )


def reason_number(reason: str) -> int:
    """The format's number of a reason; in words that neither it nor we know, a person has spoken."""
    name = NEAREST.get(reason, reason)
    return REASONS.index(name if name in REASONS else REVIEWED)


def reasons_per_frame(mask: FrameMask | None, frames: int) -> Int[np.ndarray, " frames"]:
    """Zero where every foot's force counts, else the number of the reason.

    Args:
        mask: of the trial; None where it has no forces.
        frames: of the trial.
    """
    if mask is None:
        return np.full(frames, reason_number(NOT_RECORDED), np.int32)
    numbers = np.array([*(reason_number(reason[3]) for reason in mask.reasons), REASONS.index(UNNAMED)])
    return np.where(mask.all_feet, 0, numbers[decisive_reasons(mask)]).astype(np.int32)


def decisive_reasons(mask: FrameMask) -> Int[np.ndarray, " frames"]:
    """Which of `mask.reasons` is each frame's, by its place; −1 where there is none.

    A person's reason goes before a file's, that before detection's, and all before what the recording itself
    has no force for. Of several of one source the first holds.

    Args:
        mask: of the trial.
    """
    decisive = np.full(len(mask.counts), -1)
    ranks = np.zeros(len(mask.counts), np.int32)  # place of the source that gave the reason, from 1
    order = (RECORDING, *SOURCES)
    for k, (start, end, _foot, reason) in enumerate(mask.reasons):
        stretch, before = decisive[start:end], ranks[start:end]
        by_person = reason_number(reason) == REASONS.index(REVIEWED)  # of a fit that kept no sources
        rank = 1 + order.index(mask.sources[k]) if mask.sources else 1 + by_person
        taken = rank > before
        stretch[taken], before[taken] = k, rank
    return decisive
