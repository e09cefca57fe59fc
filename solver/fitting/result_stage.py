"""From the trials' parts back to whole recordings; notes on what rests on no measurement; the fit."""

import math
from dataclasses import replace

from solver.common.notes import Kind, Note, noted
from solver.dynamics.person_estimates import person_sex
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.edit_stage import all_trials
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.provenance import provenance_of
from solver.fitting.seen_part import guessed, impossible_angles, in_whole
from solver.fitting.settings import Settings, as_dict
from solver.fitting.state import FitState
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.unseen_bodies import (
    guessed_notes,
    unseen_body_notes,
    unseen_frame_notes,
    unseen_mass_notes,
)
from solver.skeleton.skeleton import Skeleton


def note_what_is_predicted(state: FitState, settings: Settings) -> FitState:
    """Every trial with notes on unseen segments and on a motion without forces."""
    skeleton, match = state.fitted_skeleton, state.groundwork.match
    pairs = zip(state.trials, state.whole, strict=True)
    return replace(state, trials=tuple(_noted(fit, whole, match, skeleton, settings) for fit, whole in pairs))


def lay_into_whole(state: FitState) -> FitState:
    """The trials in their recordings' frames again."""
    pairs = zip(state.trials, state.whole, strict=True)
    return replace(state, trials=tuple(in_whole(fit, whole) for fit, whole in pairs))


def leave_out_impossible_angles(state: FitState) -> FitState:
    """The trials without the angles that nobody's joints take."""
    skeleton = state.fitted_skeleton
    return replace(state, trials=tuple(without_impossible(trial, skeleton) for trial in state.trials))


def as_fit(state: FitState, settings: Settings) -> Fit:
    """What the solve gives back; unless it is near a small edit, its held-out blocks are due."""
    subject, groundwork, person, result = state.subject, state.groundwork, state.person, state.result
    assert person is not None
    trials = all_trials(state)
    names = {trial.capture.name for trial in trials}
    wanted = names | {trial.name for trial in groundwork.unread}
    read = [trial for trial in subject.trials if trial.name in wanted]
    return Fit(
        subject=subject,
        skeleton=state.fitted_skeleton,
        trials=trials,
        mass_kg=math.nan if person.mass.guessed_within == math.inf else state.fitted_skeleton.mass,
        height_m=person.height_m,
        settings=as_dict(settings),
        provenance=provenance_of(subject, read, state.reviews, state.extension),
        notes=(
            *groundwork.notes,
            *person.mass.notes,
            *state.notes,
            *person.height_notes,
            *person_sex(subject, person.height_m),
            *_extension_notes(state.extension, names),
        ),
        groundwork=replace(
            groundwork,
            mass_kg=state.detected_mass_kg,
            phi=result.phi if result else None,
            learnt=state.prediction.learnt if state.prediction else groundwork.learnt,
            learnt_on=state.learnt_on,
            settled=state.settled,
        ),
        held_out_due=settings.trajectory.held_out and result is not None and state.edit is None,
    )


def without_impossible(trial: TrialFit, skeleton: Skeleton) -> TrialFit:
    """The trial without the angles that nobody's joints take, told in a note."""
    beyond = impossible_angles(trial, skeleton)
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
        notes += noted(
            Kind.SOLVE,
            f"no force counts, none predicted, and there are no torques: {fit.why_not_predicted}. Angles are "
            "those of the segments that are seen",
        )
    elif without_forces:
        notes += (
            Note(
                Kind.SOLVE,
                f"no measured force is used: ground forces and joint torques are predicted from the motion "
                f"below {settings.dynamics.unmeasured_cutoff_Hz:g} Hz and the mass of {skeleton.mass:.1f} "
                "kg; no measurement confirms them, and there is no residual",
            ),
            *unseen_mass_notes(match.skeleton(skeleton), observed),
        )
    elif settings.trajectory.enabled and fit.contacts is not None and fit.kinematics_only is None:
        notes += noted(
            Kind.OTHER,
            f"forces count on {int(fit.forces_known.sum())} frames; fewer than "
            f"{settings.trajectory.fewest_frames} are too few for F = ma, so the motion follows the markers "
            "alone",
        )
    return replace(fit, notes=(*fit.notes, *notes))


def _extension_notes(extension: Extension | None, names: set[str]) -> tuple[Note, ...]:
    """What the fit assumes beside the recorded forces."""
    if extension is None:
        return ()
    note = Note(Kind.OTHER, f"extended by what a diagnosis found and a person accepted: {extension.sentence}")
    without = sorted(names - set(extension.trials)) if extension.causes else []
    left = f"not extended, because that diagnosis did not see them: {', '.join(without)}"
    return (note, *(noted(Kind.REVIEWS, left) if without else ()))
