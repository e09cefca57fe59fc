"""Which forces count: by people's reviews, and by what a body of the person's mass shows to be missing."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from solver.common.errors import FitError
from solver.contact.detected_ranges import sure_ranges, within
from solver.contact.detection import detect
from solver.contact.force_review import ForceReview
from solver.contact.mask import ERRONEOUS, frame_mask, with_own_file
from solver.contact.needed_segments import seen_legs
from solver.contact.wrenches import MissingRange
from solver.dynamics.com_trajectory import com_data
from solver.dynamics.mass import mass_from_forces
from solver.dynamics.person_estimates import Plates, person_height, person_mass
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.seen_part import review_of_part, seen_part
from solver.fitting.settings import Settings
from solver.fitting.state import FitState, Person
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton


def cut_to_seen_part(state: FitState) -> FitState:
    """Trials as the parts that show a person; what is said about forces, in the frames of these."""
    reviews = {
        trial.capture.name: review
        for trial in state.trials
        if (review := review_of_part(state.reviews.get(trial.capture.name), trial)) is not None
    }
    seen = tuple(seen_part(trial) for trial in state.trials)
    return replace(state, trials=seen, whole=state.trials, reviews_of_parts=reviews)


def apply_reviews(state: FitState, settings: Settings) -> FitState:
    """The forces that count as far as people and files say.

    Raises:
        FitError: a review is of another number of frames, or of another foot.
    """
    said = state.reviews_of_parts
    return replace(
        state,
        trials=tuple(_masked(fit, settings, said.get(fit.capture.name)) for fit in state.trials),
        detected_mass_kg=state.groundwork.mass_kg,
        detected_without=tuple(tuple(_erroneous(fit)) for fit in state.trials),
    )


def estimate_person(state: FitState, settings: Settings) -> FitState:
    """Height and mass: entered, or what bodies, plates and tables tell."""
    subject, fits, scaled = state.subject, state.trials, state.groundwork.skeleton
    trials = [com_data(scaled, f.motion, f.contacts, f.mask) for f in fits if f.contacts and f.mask]
    plates = Plates(
        mass_from_forces(trials, settings.com),
        state.groundwork.standing,
        any(f.contacts and f.contacts.has_plates for f in fits),
    )
    legs_are_seen = any(seen_legs(scaled, f.unseen_coordinates, subject.foot_bodies) for f in fits)
    height_m, height_notes = person_height(subject, scaled, legs_are_seen)
    mass = person_mass(subject, scaled, height_m, plates, settings.com)
    person = Person(height_m, height_notes, mass)
    return replace(state, person=person, skeleton=with_mass(scaled, mass.kg))


def is_mass_guessed(state: FitState) -> bool:
    """Whether nothing weighed the person so far."""
    return state.person is not None and state.person.mass.guessed_within is not None


def detect_missing_forces(state: FitState, settings: Settings) -> FitState:
    """The forces that count without frames that surely miss one, where no person says otherwise.

    Proposals of a former fit stand as long as the erroneous stretches of its mask do, which they were judged
    with, and the mass to within what an edit near it may change.
    """
    assert state.person is not None
    mass, said, judged_kg = state.person.mass, state.reviews_of_parts, state.detected_mass_kg
    is_as_before = judged_kg is not None and abs(mass.kg / judged_kg - 1) <= settings.trajectory.edit_gain
    erroneous = tuple(tuple(_erroneous(fit)) for fit in state.trials)
    trials = []
    for fit, now, then in zip(state.trials, erroneous, state.detected_without, strict=True):
        stands = is_as_before and now == then
        judged = fit if stands else propose(fit, state.skeleton, settings, mass.guessed_within)
        trials.append(_proposed(judged, settings, said))
    judged_kg = judged_kg if is_as_before else mass.kg
    return replace(state, trials=tuple(trials), detected_mass_kg=judged_kg, detected_without=erroneous)


def with_same_forces(fit: Fit, reviews: Mapping[str, ForceReview], settings: Settings) -> Fit | None:
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


def _masked(
    fit: TrialFit, settings: Settings, review: ForceReview | None, proposed: Sequence[MissingRange] = ()
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


def propose(
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


def _proposed(fit: TrialFit, settings: Settings, reviews: Mapping[str, ForceReview]) -> TrialFit:
    """The trial without the frames of sure proposals, where no person says otherwise."""
    sure = sure_ranges(fit.proposals, settings.detection.confidence)
    return _masked(fit, settings, reviews.get(fit.capture.name), sure)
