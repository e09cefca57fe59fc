"""Motions from markers alone, and forces given to feet."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Capture, Subject
from solver.capture.plates.conditioning import condition
from solver.common.cpu_timer import CpuTimer
from solver.common.errors import ModelError
from solver.common.memory_release import release_memory
from solver.common.notes import Kind, Note
from solver.common.progress import Progress, part
from solver.contact.assignment import assign
from solver.contact.needed_segments import seen_legs, unseen_coordinates, why_not_predicted
from solver.contact.sole import independent_feet, soles
from solver.contact.wrenches import without_measured_forces
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.fitting.failing_trials import about
from solver.fitting.fit_result import Groundwork, TrialFit
from solver.fitting.model_stage import made_for
from solver.fitting.seen_part import impossible_angles, in_whole, seen_part
from solver.fitting.settings import Settings
from solver.fitting.state import FitState
from solver.kinematics.calibration import choose_frames
from solver.kinematics.determined import left_open
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.marker_errors import marker_errors, turned_head
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.kinematics.upright_pelvis import posture_notes
from solver.skeleton.forward import body_poses, marker_positions
from solver.skeleton.skeleton import Skeleton


def leave_out_turning_head(state: FitState) -> FitState:
    """Without markers of a head that turns, where the model has no neck: they would turn its trunk."""
    work = state.groundwork
    shown = [work.match.observed(capture.markers) for capture in state.recordings.shown]
    head, turn_rad = turned_head(state.skeleton, shown)
    if not head:
        return state
    labels = [work.match.measured[work.match.model.index(name)][0] for name in head]
    why = Note(
        Kind.MODEL_AGAINST_MARKERS,
        f"the model has no neck, and the head turned by up to {np.degrees(turn_rad):.0f}° against the trunk: "
        f"{', '.join(labels)} are left out of the fit and of its marker errors",
    )
    match = work.match.without(head, why)
    body = match.skeleton(state.skeleton)
    work = replace(work, skeleton=body, match=match, notes=(*work.notes, why))
    return replace(state, groundwork=work, skeleton=body)


def track_markers(state: FitState, settings: Settings, progress: Progress) -> FitState:
    """Inverse kinematics of every trial.

    Raises:
        TrialFailedError: from what a trial alone does.
    """
    captures, faults = state.recordings.captures, state.recordings.label_faults
    shared = {stage: seconds / len(captures) for stage, seconds in state.seconds.items()}
    tracked = []
    for i, (capture, own) in enumerate(zip(captures, faults, strict=True)):
        own_progress = part(progress, i / len(captures), (i + 1) / len(captures))
        with about(capture.name):
            trial = track_trial(capture, state.groundwork, settings, own_progress)
            tracked.append(replace(trial, label_faults=own, seconds=shared | trial.seconds))
    leaning = [
        note.in_trial(trial.capture.name)
        for trial in tracked
        if state.subject.model is not None
        for note in posture_notes(trial.motion)
    ]
    notes = (*state.groundwork.notes, *leaning)
    return replace(state, trials=tuple(tracked), groundwork=replace(state.groundwork, notes=notes))


def track_with_kept_model(state: FitState, settings: Settings, progress: Progress) -> FitState | None:
    """Inverse kinematics with the model that former trials left, which these refine for the next ones.

    Returns:
        None where there is no such model, or the trials speak of other markers or of another body.

    Raises:
        TrialFailedError: from what a trial alone does.
    """
    session = state.session
    if session is None or session.former is None or session.former.made_for != made_for(state, settings):
        return None
    kept = session.former.calibration
    groundwork = replace(state.groundwork, skeleton=kept.skeleton, notes=kept.notes)
    tracked = track_markers(replace(state, groundwork=groundwork, skeleton=kept.skeleton), settings, progress)
    observed = [groundwork.match.observed(trial.capture.markers) for trial in tracked.trials]
    frames = choose_frames(observed, None, settings.kinematics)
    q = np.concatenate([t.motion.q[some] for t, some in zip(tracked.trials, frames.places, strict=True)])
    posed = np.isfinite(q).all(axis=1)
    refined = kept.refined(frames.some(posed), q[posed], settings.kinematics) if posed.any() else None
    if refined is None:
        return None
    session.next = replace(session.former, calibration=refined)
    return tracked


def assign_forces(state: FitState, settings: Settings) -> FitState:
    """Every trial's forces given to the feet that are seen, on the frames that show a person.

    Raises:
        TrialFailedError: from what a trial alone does.
    """
    trials = []
    for trial in state.trials:
        with about(trial.capture.name):
            seen = with_contacts(seen_part(trial), state.groundwork, state.subject, settings)
            trials.append(in_whole(seen, trial))
    release_memory()
    return replace(state, trials=tuple(trials))


def former_marker_fit(trial: TrialFit, groundwork: Groundwork, settings: Settings) -> TrialFit:
    """A trial as it was when its forces had been given to feet; nothing was spent on it this time."""
    markers_alone = trial.kinematics_only.motion if trial.kinematics_only else trial.motion
    known = None if impossible_angles(trial, groundwork.skeleton).any() else trial.left_open  # and no more
    fit = compare_with_markers(trial.capture, groundwork, markers_alone.q, settings, known)
    nothing = dict.fromkeys(("load", "scaling", "kinematics"), 0.0)
    return replace(
        fit,
        contacts=trial.contacts,
        mask=trial.mask,
        proposals=trial.proposals,
        spline=trial.spline,
        prediction_spline=trial.prediction_spline,
        seconds=nothing,
        label_faults=trial.label_faults,
        why_not_predicted=trial.why_not_predicted,
    )


def track_trial(capture: Capture, groundwork: Groundwork, settings: Settings, progress: Progress) -> TrialFit:
    """Inverse kinematics of one trial."""
    cpu_timer = CpuTimer()
    with cpu_timer("kinematics"):
        measured = groundwork.match.observed(capture.markers)
        q = inverse_kinematics(
            groundwork.skeleton, measured, capture.markers.rate, settings.kinematics, progress
        )
    return replace(compare_with_markers(capture, groundwork, q, settings), seconds=cpu_timer.seconds)


def compare_with_markers(
    capture: Capture,
    groundwork: Groundwork,
    q: Float[np.ndarray, "frames dofs"],
    settings: Settings,
    open_there: Bool[np.ndarray, "frames dofs"] | None = None,
) -> TrialFit:
    """A trial's marker fit, compared with its markers; with coordinates that are known to be open."""
    markers, match, skeleton = capture.markers, groundwork.match, groundwork.skeleton
    model_markers = marker_positions(skeleton, q)
    observed = match.observed(markers)
    errors, notes = marker_errors(skeleton, match.model, model_markers, observed, settings.kinematics)
    return TrialFit(
        capture=capture,
        motion=Motion(skeleton.dofs, q, markers.rate, markers.start_time),
        marker_errors=errors,
        model_markers_ground=model_markers,
        notes=notes,
        left_open=left_open(skeleton, observed, q, settings.kinematics) if open_there is None else open_there,
        unseen_coordinates=unseen_coordinates(match.skeleton(skeleton), observed),
    )


def with_contacts(fit: TrialFit, groundwork: Groundwork, subject: Subject, settings: Settings) -> TrialFit:
    """The trial's forces given to feet that are seen; feet without a force where the trial has none."""
    skeleton, q, times = groundwork.skeleton, fit.motion.q, fit.motion.times
    unseen, com = fit.unseen_coordinates, centre_of_mass_of(skeleton, q)
    why = why_not_predicted(skeleton, q, unseen, subject.foot_bodies, com)
    fit = replace(fit, why_not_predicted=why)
    if not fit.capture.plates or not seen_legs(skeleton, unseen, subject.foot_bodies):
        return _without_forces(fit, skeleton, subject)
    conditioned = [condition(plate, times, settings.conditioning) for plate in fit.capture.plates]
    R, p = body_poses(skeleton, q)
    contacts = assign(
        conditioned,
        R,
        p,
        skeleton=skeleton,
        foot_bodies=subject.foot_bodies,
        times=times,
        settings=settings.contact,
    )
    return replace(fit, contacts=contacts)


def _without_forces(fit: TrialFit, skeleton: Skeleton, subject: Subject) -> TrialFit:
    """Feet to predict forces for, if the model has some and hangs freely on the ground."""
    try:
        feet = independent_feet(skeleton, subject.foot_bodies)
        soles(skeleton, feet)
        root_joint(skeleton)
    except ModelError as error:
        return replace(
            fit, notes=(*fit.notes, Note(Kind.SOLVE, f"no forces are recorded and none predicted: {error}"))
        )
    return replace(fit, contacts=without_measured_forces(feet, fit.motion.frames))
