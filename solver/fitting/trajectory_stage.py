"""Motions that follow markers and the forces that count, all trials together."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.common.memory_release import release_memory
from solver.common.progress import Progress, silent
from solver.common.true_runs import runs
from solver.dynamics.com_trajectory import ComData, MassPrior, fit_com_trajectory
from solver.dynamics.root_wrench import centre_of_mass_of, with_com_at
from solver.dynamics.trajectory.extension import Extension, TrialExtension
from solver.dynamics.trajectory.near_edits import fit_near_edits
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit
from solver.dynamics.trajectory.trial_data import TrialData
from solver.fitting.edit_stage import settled_fit
from solver.fitting.fit_result import KinematicsOnly, TrialFit
from solver.fitting.mass_stage import mass_notes
from solver.fitting.prediction_stage import learnt_before, misses_a_force
from solver.fitting.settings import Settings
from solver.fitting.state import FitState, MassAndGains
from solver.kinematics.marker_errors import marker_errors
from solver.kinematics.marker_matching import MarkerMatch
from solver.skeleton.forward import marker_positions
from solver.skeleton.skeleton import Skeleton


def collect_data(state: FitState, settings: Settings) -> FitState:
    """What every trial gives to the trajectory fit, and where its search begins."""
    if state.weighed is None:
        return state
    skeleton = state.weighed_skeleton
    data = all_data(state.members, state.groundwork.match, state.weighed, state.extension)
    release_memory()
    begun = (
        begin_at_forces(own, fit, skeleton, settings)
        if fit.spline is None
        else replace(own, spline=fit.spline)
        for own, fit in zip(data, state.members, strict=True)
    )
    return replace(state, data=tuple(begun))


def fit_before_prediction(state: FitState, settings: Settings, progress: Progress) -> FitState:
    """The trajectory fit that a first prediction fit begins with, where a force is missing."""
    if state.edit is not None:
        if not state.edit.is_first_to_predict:
            return state
        unedited = replace(state.edit, edited=tuple(np.zeros_like(frames) for frames in state.edit.edited))
        return replace(state, motion_only=_fitted(replace(state, edit=unedited), settings, silent))
    if not any(misses_a_force(trial) for trial in state.members) or not settings.prediction.enabled:
        return state
    if learnt_before(state.members, state.groundwork) is not None:
        return state
    return replace(state, motion_only=_fitted(state, settings, progress))


def fit_motions(state: FitState, settings: Settings, progress: Progress) -> FitState:
    """The trajectory fit, held by the predicted forces where there are some."""
    if not state.fitted:
        return state
    edited = state.groundwork.phi is not None
    return replace(state, result=_fitted(state, settings, progress, edited=edited))


def _fitted(
    state: FitState, settings: Settings, progress: Progress, *, edited: bool = False
) -> TrajectoryFit:
    """Of all trials; near a small edit alone, where there is one."""
    weights, before = settings.trajectory, state.motion_only
    if state.edit is not None:
        return fit_near_edits(
            state.weighed_skeleton,
            state.data,
            state.edit.edited,
            weights,
            progress,
            before=state.edit.inertias,
        )
    return fit_trajectories(
        state.weighed_skeleton,
        list(state.data),
        weights,
        progress,
        phi=before.phi if before else state.groundwork.phi,
        extra=state.extension.parameters if state.extension else None,
        mass_is_fitted=state.extension is None,
        edited=edited,
    )


def take_motions(state: FitState, settings: Settings) -> FitState:
    """The trials with their fitted motions, compared with the markers, and what is to be said of the fit."""
    trials, result, prediction = [replace(fit, spline=None) for fit in state.trials], state.result, None
    groundwork = state.groundwork
    if result is None:
        return replace(state, trials=tuple(trials), learnt_on=groundwork.learnt_on)
    assert state.weighed is not None
    prediction, seconds = state.prediction, state.seconds["dynamics"] / len(state.fitted)
    for k, i in enumerate(state.fitted):
        fit, motion = state.trials[i], result.motions[k]
        model_markers = marker_positions(result.skeleton, motion.q)
        errors, marker_notes = marker_errors(
            result.skeleton,
            groundwork.match.model,
            model_markers,
            state.data[k].observed_ground,
            settings.kinematics,
            first_frame=fit.capture.markers.first_frame,
        )
        trials[i] = replace(
            fit,
            motion=motion,
            marker_errors=errors,
            model_markers_ground=model_markers,
            kinematics_only=KinematicsOnly(fit.motion, fit.marker_errors),
            spline=result.splines[k],
            prediction_spline=prediction.splines[k] if prediction else fit.prediction_spline,
            costs=result.costs,
            notes=marker_notes,
            seconds=fit.seconds | {"dynamics": seconds},
        )
    learnt_on = groundwork.learnt_on
    near = state.edit is not None and not state.edit.is_first_to_predict
    if prediction is not None and not near and learnt_before(state.members, groundwork) is None:
        learnt_on = {fit.capture.name: tuple(runs(fit.forces_known)) for fit in state.members}
    return replace(
        state,
        trials=tuple(trials),
        notes=(
            *result.notes,
            *state.weighed.notes,
            *(prediction.notes if prediction else ()),
            *mass_notes(state.skeleton, result, settings.trajectory),
        ),
        learnt_on=learnt_on,
        settled=settled_fit(state, settings.trajectory),
    )


def all_data(
    fits: Sequence[TrialFit], match: MarkerMatch, weighed: MassAndGains, extension: Extension | None
) -> list[TrialData]:
    """What the trials give to the trajectory fit.

    Args:
        fits: with contacts and mask.
        match: of the skeleton's markers.
        weighed: by the plates.
        extension: what acts beside the recorded forces.
    """
    data = []
    for fit, gain in zip(fits, weighed.gains, strict=True):
        extra = extra_of(fit, extension)
        plain = trial_data(fit, match, gain)
        data.append(extra.added_to(plain, gain) if extra else plain)
    return data


def extra_of(fit: TrialFit, extension: Extension | None) -> TrialExtension | None:
    """What of an extension acts in a trial."""
    extra = extension.trials.get(fit.capture.name) if extension else None
    first, frames = fit.capture.markers.first_frame, fit.motion.frames
    return extra.between(first, first + frames) if extra else None


def begin_at_forces(data: TrialData, fit: TrialFit, skeleton: Skeleton, settings: Settings) -> TrialData:
    """The search begins with the root moved: the centre of mass goes where the known forces take it."""
    com = ComData(
        centre_of_mass_of(skeleton, fit.motion.q),
        data.wrench_ground[:, :3],
        data.counts,
        fit.motion.rate,
        skeleton.gravity,
    )
    path = fit_com_trajectory(com, settings.com, MassPrior(skeleton.mass, 0.0))
    q = with_com_at(skeleton, fit.motion.q, path.com_ground)
    return replace(data, initial=replace(fit.motion, q=q))


def before_forces(fit: TrialFit) -> TrialFit:
    """The trial as the markers alone left it, with its forces."""
    assert fit.kinematics_only is not None
    before = fit.kinematics_only
    return replace(
        fit, motion=before.motion, marker_errors=before.marker_errors, kinematics_only=None, spline=None
    )


def trial_data(fit: TrialFit, match: MarkerMatch, gain: float = 1.0) -> TrialData:
    """What a trial with forces gives to the trajectory fit.

    Args:
        fit: with contacts and mask.
        match: of the fitted skeleton's markers.
        gain: of the plates, that the forces are divided by.
    """
    assert fit.contacts is not None
    wrench = np.where(fit.forces_known[:, None], fit.contacts.wrench_ground.sum(axis=1) / gain, 0.0)
    observed = match.observed(fit.capture.markers)
    return TrialData(observed, wrench, fit.forces_known, fit.motion, by_video=match.by_video)
