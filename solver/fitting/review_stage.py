"""What people's reviews change: which forces count, hence the mass, the trajectories and the torques."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from solver.capture.capture import Subject
from solver.common.errors import FitError
from solver.common.progress import Progress
from solver.contact.detection import detect
from solver.contact.force_review import ForceReview
from solver.contact.mask import ERRONEOUS, frame_mask, with_own_file
from solver.contact.needed_segments import seen_legs
from solver.contact.proposals import sure_ranges, within
from solver.contact.wrenches import MissingRange
from solver.dynamics.com_data import com_data
from solver.dynamics.com_mass import MassEstimate
from solver.dynamics.mass import mass_from_forces
from solver.dynamics.person_estimates import Plates, person_height, person_mass, person_sex
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.dynamics_stage import fit_to_forces
from solver.fitting.fit import Fit, Groundwork, TrialFit
from solver.fitting.held_out_stage import with_held_out
from solver.fitting.provenance import provenance_of
from solver.fitting.seen_part import guessed, in_whole, review_of_part, seen_part
from solver.fitting.settings import Settings, as_dict
from solver.fitting.torques_stage import with_dynamics
from solver.kinematics.determined import beyond_people
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.unseen_bodies import (
    guessed_notes,
    unseen_body_notes,
    unseen_frame_notes,
    unseen_mass_notes,
)
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

Reviews = Mapping[str, ForceReview | None]


def apply_reviews(
    subject: Subject,
    groundwork: Groundwork,
    fits: Sequence[TrialFit],
    settings: Settings,
    reviews: Mapping[str, ForceReview],
    *,
    progress: Progress,
    extension: Extension | None = None,
) -> Fit:
    """All that follows from which forces count; the held-out blocks are left due.

    Args:
        subject: whose.
        groundwork: of a solve; where it comes from a previous fit, the search begins there.
        fits: the trials' marker fits, their forces given to feet. Proposals of a previous fit stand as long
            as the mass and the erroneous stretches of its mask do, which they were judged with.
        settings: of every stage.
        reviews: by trial, what people say about the forces.
        progress: told the stage and the fraction done; may raise `Cancelled`.
        extension: what acts beside the recorded forces, as a person accepted it.

    Raises:
        FitError: a review is of another number of frames, or of another foot.
    """
    whole = fits
    said: Reviews = {f.capture.name: review_of_part(reviews.get(f.capture.name), f) for f in whole}
    fits = [seen_part(fit) for fit in whole]
    judged_without = [_erroneous(fit) for fit in fits]
    fits = [_masked(fit, settings, said.get(fit.capture.name)) for fit in fits]
    told = _told_by_forces(groundwork.skeleton, fits, settings)
    plates = Plates(told, groundwork.standing, any(f.contacts and f.contacts.has_plates for f in fits))
    height_m, height_notes = person_height(
        subject,
        groundwork.skeleton,
        any(seen_legs(groundwork.skeleton, f.unseen_coordinates, subject.foot_bodies) for f in fits),
    )
    mass = person_mass(subject, groundwork.skeleton, height_m, plates, settings.com)
    skeleton = with_mass(groundwork.skeleton, mass.kg)
    fits = [
        fit
        if mass.kg == groundwork.mass_kg and _erroneous(fit) == before
        else _judged(fit, skeleton, settings, mass.guessed_within)
        for fit, before in zip(fits, judged_without, strict=True)
    ]
    fits = [_proposed(fit, settings, said) for fit in fits]
    if mass.guessed_within is not None:
        told = _told_by_forces(groundwork.skeleton, fits, settings)  # without frames that miss a force
        if told is not None:
            mass = person_mass(
                subject, groundwork.skeleton, height_m, replace(plates, told=told), settings.com
            )
            skeleton = with_mass(groundwork.skeleton, mass.kg)
            fits = [_proposed(_judged(fit, skeleton, settings), settings, said) for fit in fits]
    fitted_to_forces = fit_to_forces(fits, groundwork, skeleton, settings, progress, extension=extension)
    solved = tuple(
        without_impossible(
            in_whole(
                with_dynamics(
                    _noted(fit, before, groundwork.match, fitted_to_forces.skeleton, settings),
                    fitted_to_forces.skeleton,
                    settings,
                    extension=extension,
                    x=fitted_to_forces.extra,
                    predicted_ground=fitted_to_forces.predicted_ground.get(fit.capture.name),
                ),
                before,
            ),
            fitted_to_forces.skeleton,
        )
        for fit, before in zip(fitted_to_forces.fits, whole, strict=True)
    )
    names = {fit.capture.name for fit in fits}
    wanted = names | {trial.name for trial in groundwork.unread}
    read = [trial for trial in subject.trials if trial.name in wanted]
    return Fit(
        subject=subject,
        skeleton=fitted_to_forces.skeleton,
        trials=solved,
        mass_kg=math.nan if mass.guessed_within == math.inf else fitted_to_forces.skeleton.mass,
        height_m=height_m,
        settings=as_dict(settings),
        provenance=provenance_of(subject, read, reviews, extension),
        notes=(
            *groundwork.notes,
            *mass.notes,
            *fitted_to_forces.notes,
            *height_notes,
            *person_sex(subject, height_m),
            *_extension_notes(extension, names),
        ),
        groundwork=replace(
            groundwork,
            mass_kg=mass.kg,
            phi=fitted_to_forces.phi,
            learnt=fitted_to_forces.learnt,
            learnt_on=fitted_to_forces.learnt_on,
            settled=fitted_to_forces.settled,
        ),
        held_out_due=settings.trajectory.held_out and fitted_to_forces.phi is not None,
    )


def predicting_held_out(
    fit: Fit, settings: Settings, progress: Progress, extension: Extension | None = None
) -> Fit:
    """The fit with its held-out blocks predicted, where they were still due; with the fit's extension."""
    if not fit.held_out_due or fit.groundwork is None or fit.groundwork.mass_kg is None:
        return fit
    began = with_mass(fit.groundwork.skeleton, fit.groundwork.mass_kg)
    seen = [seen_part(trial) for trial in fit.trials]
    parts = with_held_out(seen, fit.groundwork.match, began, settings, progress, extension=extension)
    trials = tuple(
        replace(trial, held_out=in_whole(part, trial).held_out, seconds=part.seconds)
        for trial, part in zip(fit.trials, parts, strict=True)
    )
    judged = [trial.held_out for trial in trials if trial.held_out is not None]
    kinds = judged[0].learnt if judged else fit.groundwork.prediction_kinds
    return replace(
        fit,
        trials=trials,
        held_out_due=False,
        groundwork=replace(fit.groundwork, prediction_kinds=kinds),
    )


def with_same_forces(fit: Fit, reviews: Reviews, settings: Settings) -> Fit | None:
    """The fit with the masks that these reviews give; None where other forces count than in the fit.

    Args:
        fit: with these settings.
        reviews: by trial, what people say about the forces.
        settings: of every stage.
    """
    try:
        trials = tuple(_proposed(trial, settings, reviews) for trial in fit.trials)
    except FitError:
        return None
    same = all(_same_forces(old, new) for old, new in zip(fit.trials, trials, strict=True))
    return replace(fit, trials=trials) if same else None


def _same_forces(one: TrialFit, other: TrialFit) -> bool:
    if one.mask is None or other.mask is None:
        return one.mask is other.mask
    return np.array_equal(one.mask.counts, other.mask.counts) and _erroneous(one) == _erroneous(other)


def _extension_notes(extension: Extension | None, names: set[str]) -> tuple[str, ...]:
    """What the fit assumes beside the recorded forces."""
    if extension is None:
        return ()
    note = f"extended by what a diagnosis found and a person accepted: {extension.sentence}"
    without = sorted(names - set(extension.trials)) if extension.causes else []
    return (note, f"not extended, because that diagnosis did not see them: {', '.join(without)}")[
        : 2 if without else 1
    ]


def _masked(
    fit: TrialFit,
    settings: Settings,
    review: ForceReview | None,
    proposed: Sequence[MissingRange] = (),
) -> TrialFit:
    """The trial with the forces that count."""
    if fit.contacts is None:
        return fit
    try:
        mask = frame_mask(
            fit.contacts,
            _tracked_frames(fit, settings),
            with_own_file(review or ForceReview(), fit.capture),
            proposed,
            outside=fit.capture.outside_ranges,
        )
    except FitError as error:
        raise FitError(f"{fit.capture.name}: {error}") from error
    return replace(fit, mask=mask)


def _judged(
    fit: TrialFit, skeleton: Skeleton, settings: Settings, guessed_within: float | None = None
) -> TrialFit:
    """The trial with what detection proposes of the frames that are to be used, learnt from these alone.

    Forces outside the trial's ranges are no evidence; in an erroneous stretch neither forces nor markers are.
    A mass that nothing weighed is as uncertain to detection as it is: no force is missing for want of it.
    """
    detection = settings.detection
    if guessed_within is not None:
        detection = replace(detection, mass_error=guessed_within)
    if fit.contacts is None or not fit.contacts.has_plates:
        return fit
    sound = np.ones(fit.motion.frames, dtype=bool)
    for start, end in _erroneous(fit):
        sound[start:end] = False
    outside = fit.capture.outside_ranges
    used = sound if outside is None else sound & ~outside
    proposals = detect(
        skeleton,
        fit.motion,
        replace(fit.contacts, observed=fit.contacts.observed & used),
        fit.capture.plates,
        tracked=_tracked_frames(fit, settings) & sound,
        settings=detection,
    )
    return replace(fit, proposals=within(proposals, used))


def _erroneous(fit: TrialFit) -> list[tuple[int, int]]:
    """Stretches that a person said must not be used at all."""
    reasons = fit.mask.reasons if fit.mask else ()
    return [(start, end) for start, end, _, reason in reasons if reason == ERRONEOUS]


def _tracked_frames(fit: TrialFit, settings: Settings) -> Bool[np.ndarray, " frames"]:
    return fit.marker_errors.seen_share >= settings.kinematics.fewest_seen_share


def without_impossible(trial: TrialFit, skeleton: Skeleton) -> TrialFit:
    """The trial without the angles that nobody's joints take, told in a note."""
    motions = (trial.motion, *((trial.dynamics.motion,) if trial.dynamics else ()))
    beyond = np.any([beyond_people(skeleton, each.q, each.rate) for each in motions], axis=0)
    if not beyond.any() or trial.left_open is None:
        return trial
    why = "markers, here or near, have it bend as nobody's does; look for one that is frozen or exchanged"
    notes = (*trial.notes, *guessed_notes(trial.motion, beyond, why))
    return replace(trial, left_open=trial.left_open | beyond, notes=notes)


def _noted(
    fit: TrialFit, whole: TrialFit, match: MarkerMatch, skeleton: Skeleton, settings: Settings
) -> TrialFit:
    """The trial with notes on what rests on no measurement: unseen segments, a motion without forces."""
    observed = match.observed(whole.capture.markers)
    notes = (
        *unseen_frame_notes(whole.motion),
        *unseen_body_notes(match.skeleton(skeleton), observed, whole.motion),
        *guessed_notes(whole.motion, guessed(whole)),
    )
    without_forces = fit.mask is not None and not fit.mask.counts.any()
    if without_forces and fit.why_not_predicted:
        notes += (
            f"no force counts, none predicted, and there are no torques: {fit.why_not_predicted}. Angles are "
            "those of the segments that are seen",
        )
    elif without_forces:
        notes += (
            f"no measured force is used: ground forces and joint torques are predicted from the motion below "
            f"{settings.dynamics.unmeasured_cutoff_Hz:g} Hz and the mass of {skeleton.mass:.1f} kg; no "
            "measurement confirms them, and there is no residual",
            *unseen_mass_notes(match.skeleton(skeleton), observed),
        )
    elif settings.trajectory.enabled and fit.contacts is not None and fit.kinematics_only is None:
        notes += (
            f"forces count on {int(fit.forces_known.sum())} frames; fewer than "
            f"{settings.trajectory.fewest_frames} are too few for F = ma, so the motion follows the markers "
            "alone",
        )
    return replace(fit, notes=(*fit.notes, *notes))


def _told_by_forces(skeleton: Skeleton, fits: Sequence[TrialFit], settings: Settings) -> MassEstimate | None:
    """The mass that plates carried on the frames that count."""
    trials = [com_data(skeleton, f.motion, f.contacts, f.mask) for f in fits if f.contacts and f.mask]
    return mass_from_forces(trials, settings.com)


def _proposed(fit: TrialFit, settings: Settings, reviews: Reviews) -> TrialFit:
    """The trial without the frames of sure proposals, where no person says otherwise."""
    sure = sure_ranges(fit.proposals, settings.detection.confidence)
    return _masked(fit, settings, reviews.get(fit.capture.name), sure)
