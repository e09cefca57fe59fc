"""The whole solve as one readable function: subject folder in, fit out."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from solver.capture.capture import Capture, Subject, TrialFiles
from solver.capture.conditioning import condition
from solver.capture.trial import read_static, read_trial
from solver.clock import Clock
from solver.contact.assignment import assign
from solver.contact.detection import detect
from solver.contact.mask import frame_mask
from solver.contact.wrenches import ContactWrenches, FrameMask, MissingRange
from solver.dynamics.com_data import com_data
from solver.dynamics.com_mass import disagreement
from solver.dynamics.mass import mass_from_forces
from solver.dynamics_stage import obeying_forces, with_dynamics
from solver.errors import FitError
from solver.fit import Fit, TrialFit
from solver.kinematics.calibration import calibrate, choose_frames
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.marker_errors import marker_errors
from solver.kinematics.marker_matching import MarkerMatch, match_markers
from solver.kinematics.motion import Motion
from solver.kinematics.scale_prior import stature
from solver.kinematics.unseen_bodies import unseen_body_notes
from solver.progress import Progress, part, silent
from solver.provenance import provenance_of
from solver.settings import Settings, as_dict
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses, marker_positions
from solver.skeleton.osim import load_skeleton
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

SCALED, TRACKED = 0.2, 0.4  # shares of the work that are done after scaling and after inverse kinematics


def solve(
    subject: Subject,
    settings: Settings,
    *,
    trials: Sequence[str] | None = None,
    reviews: Mapping[str, Sequence[MissingRange]] | None = None,
    progress: Progress = silent,
) -> Fit:
    """Scale the model to the subject, fit every trial's motion, and compute its dynamics.

    Args:
        subject: as `open_subject` found it.
        settings: of every stage.
        trials: names of the trials to solve; None for all.
        reviews: by trial, where people say that forces are missing; a trial that they reviewed and found
            whole has an empty one, a trial that is not named is left to its review.json.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        SolverError: a file, the model or the data cannot be used; the message says which and what to do.
    """
    clock = Clock()
    chosen = _chosen(subject, trials)
    with clock("load"):
        generic = _generic(subject)
        captures = [_read(files, progress) for files in chosen]
        static = read_static(subject.static) if subject.static else None
    match = match_markers(generic, [c.markers for c in ([*captures, static] if static else captures)])
    with clock("scaling"):
        frames = choose_frames(
            [match.observed(c.markers) for c in captures],
            match.observed(static.markers) if static else None,
            settings.kinematics,
        )
        calibration = calibrate(
            match.skeleton(generic),
            frames,
            settings.kinematics,
            height_m=subject.height_m,
            mass_kg=subject.mass_kg,
            progress=part(progress, 0.0, SCALED),
        )
    skeleton = calibration.skeleton
    share = (TRACKED - SCALED) / len(captures)
    fits = []
    for i, capture in enumerate(captures):
        start = SCALED + i * share
        fits.append(_tracked(capture, match, skeleton, settings, part(progress, start, start + share)))
    reviews = reviews or {}
    fits = [_with_forces(f, skeleton, subject, settings, reviews.get(f.capture.name)) for f in fits]
    mass_kg, mass_notes = _mass(subject, skeleton, fits, settings)
    skeleton = with_mass(skeleton, mass_kg)
    fits = [_judged(f, skeleton, settings, reviews.get(f.capture.name)) for f in fits]
    skeleton, fits, fit_notes = obeying_forces(fits, match, skeleton, settings, part(progress, TRACKED, 1.0))
    solved = [with_dynamics(_noted(fit, match, skeleton, settings), skeleton, settings) for fit in fits]
    height_m, height_notes = _height(subject, skeleton)
    shared = {stage: seconds / len(solved) for stage, seconds in clock.seconds.items()}
    return Fit(
        subject=subject,
        skeleton=skeleton,
        trials=tuple(replace(fit, seconds=shared | fit.seconds) for fit in solved),
        mass_kg=skeleton.mass,
        height_m=height_m,
        settings=as_dict(settings),
        provenance=provenance_of(subject, chosen, reviews),
        notes=(*match.notes, *calibration.notes, *mass_notes, *fit_notes, *height_notes),
    )


def _chosen(subject: Subject, names: Sequence[str] | None) -> list[TrialFiles]:
    known = {t.name: t for t in subject.trials}
    for name in names or ():
        if name not in known:
            raise FitError(f"{subject.folder}: no trial '{name}'; trials: {', '.join(known)}.")
    return [known[name] for name in dict.fromkeys(names)] if names else list(subject.trials)


def _read(files: TrialFiles, progress: Progress) -> Capture:
    progress(f"reading {files.name}", 0.0)
    return read_trial(files)


def _generic(subject: Subject) -> Skeleton:
    if subject.model is not None:
        return load_skeleton(subject.model)
    return default_skeleton(
        **{k: v for k, v in (("mass_kg", subject.mass_kg), ("height_m", subject.height_m)) if v is not None},
        sex=subject.sex,
    )


def _tracked(
    capture: Capture, match: MarkerMatch, skeleton: Skeleton, settings: Settings, progress: Progress
) -> TrialFit:
    """Inverse kinematics of one trial."""
    clock = Clock()
    measured = match.observed(capture.markers)
    with clock("kinematics"):
        q = inverse_kinematics(skeleton, measured, capture.markers.rate, settings.kinematics, progress)
    model_markers = marker_positions(skeleton, q)
    errors, notes = marker_errors(match.model, model_markers, measured, settings.kinematics)
    return TrialFit(
        capture=capture,
        motion=Motion(skeleton.dofs, q, capture.markers.rate, capture.markers.start_time),
        marker_errors=errors,
        model_markers_ground=model_markers,
        seconds=clock.seconds,
        notes=notes,
    )


def _noted(fit: TrialFit, match: MarkerMatch, skeleton: Skeleton, settings: Settings) -> TrialFit:
    """The trial with notes on what rests on no measurement: unseen segments, a motion without forces."""
    markers = fit.capture.markers
    notes = unseen_body_notes(match.skeleton(skeleton), match.observed(markers), markers.rate)
    if settings.trajectory.enabled and fit.contacts is not None and fit.kinematics_only is None:
        notes += (
            f"forces count on {int(fit.forces_known.sum())} frames, and fewer than "
            f"{settings.trajectory.fewest_frames} say nothing about F = ma: the motion follows the markers "
            "alone",
        )
    return replace(fit, notes=(*fit.notes, *notes))


def _with_forces(
    fit: TrialFit,
    skeleton: Skeleton,
    subject: Subject,
    settings: Settings,
    review: Sequence[MissingRange] | None,
) -> TrialFit:
    """The trial's forces given to feet, and which of them count."""
    if not fit.capture.plates:
        return fit
    times = fit.motion.times
    conditioned = [condition(plate, times, settings.conditioning) for plate in fit.capture.plates]
    R, p = body_poses(skeleton, fit.motion.q)
    contacts = assign(
        conditioned,
        R,
        p,
        skeleton=skeleton,
        foot_bodies=subject.foot_bodies,
        times=times,
        settings=settings.contact,
    )
    return replace(fit, contacts=contacts, mask=_mask(fit, contacts, settings, review))


def _judged(
    fit: TrialFit, skeleton: Skeleton, settings: Settings, review: Sequence[MissingRange] | None
) -> TrialFit:
    """The trial with what detection proposes; where nobody reviewed it, the mask obeys the sure ones."""
    if fit.contacts is None:
        return fit
    proposals = detect(
        skeleton,
        fit.motion,
        fit.contacts,
        fit.capture.plates,
        tracked=_tracked_frames(fit, settings),
        settings=settings.detection,
    )
    sure = [(*p.range, p.foot, p.reason) for p in proposals if p.confidence >= settings.detection.confidence]
    return replace(fit, proposals=proposals, mask=_mask(fit, fit.contacts, settings, review, sure))


def _tracked_frames(fit: TrialFit, settings: Settings) -> Bool[np.ndarray, " frames"]:
    return fit.marker_errors.seen_share >= settings.kinematics.fewest_seen_share


def _mask(
    fit: TrialFit,
    contacts: ContactWrenches,
    settings: Settings,
    review: Sequence[MissingRange] | None,
    proposed: Sequence[MissingRange] | None = None,
) -> FrameMask:
    try:
        return frame_mask(
            contacts, _tracked_frames(fit, settings), fit.capture.imported_missing_force, review, proposed
        )
    except FitError as error:
        raise FitError(f"{fit.capture.name}: {error}") from error


def _mass(
    subject: Subject, skeleton: Skeleton, fits: Sequence[TrialFit], settings: Settings
) -> tuple[float, tuple[str, ...]]:
    """The entered mass, else what the forces tell; with a warning where the two disagree."""
    estimate = mass_from_forces(
        [com_data(skeleton, f.motion, f.contacts, f.mask) for f in fits if f.contacts and f.mask],
        settings.com,
    )
    if subject.mass_kg is not None:
        warning = estimate and disagreement(estimate, subject.mass_kg, settings.com)
        return subject.mass_kg, (warning,) if warning else ()
    if estimate is None:
        note = f"mass not given and no forces to tell it; the model's own {skeleton.mass:.1f} kg is used"
        return skeleton.mass, (note,)
    note = f"mass not given; {estimate.mass_kg:.1f} ± {estimate.std_kg:.1f} kg estimated from the forces"
    return estimate.mass_kg, (note,)


def _height(subject: Subject, skeleton: Skeleton) -> tuple[float, tuple[str, ...]]:
    if subject.height_m is not None:
        return subject.height_m, ()
    height = stature(skeleton)
    if height is None:
        return float("nan"), ("height not given, and the model has no leg that would tell it",)
    return height, (f"height not given; {height:.2f} m from the scaled model's legs",)
