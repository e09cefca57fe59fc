"""Trajectories that obey the forces that count, torques and residuals of all trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from solver.common.cpu_timer import CpuTimer
from solver.common.memory_release import release_memory
from solver.common.progress import Progress
from solver.common.runs import runs
from solver.dynamics.com_data import ComData
from solver.dynamics.com_mass import MassPrior
from solver.dynamics.com_trajectory import fit_com_trajectory
from solver.dynamics.force_prediction.learnt_terms import LearntTerms
from solver.dynamics.force_prediction.prediction_fit import Predicted
from solver.dynamics.inertia_parameters import inertia_parameters
from solver.dynamics.root_shift import with_com_at
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.dynamics.trajectory.extension import Extension, TrialExtension
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData
from solver.fitting.edit_stage import fitted_near_edit, settled_fit, small_edit
from solver.fitting.fit import Groundwork, KinematicsOnly, SettledFit, TrialFit
from solver.fitting.prediction_stage import learnt_before, misses_a_force, prediction_fit_of, with_predicted
from solver.fitting.settings import Settings
from solver.fitting.weighing_stage import Weighed, estimate_mass_and_gains
from solver.kinematics.marker_errors import marker_errors
from solver.kinematics.marker_matching import MarkerMatch
from solver.skeleton.forward import marker_positions
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class Obeying:
    """Trials after the trajectory fit."""

    skeleton: Skeleton  # with fitted inertias
    fits: tuple[TrialFit, ...]
    phi: Float[np.ndarray, " parameters"] | None  # None: no trial was fitted to forces
    notes: tuple[str, ...]
    extra: Float[np.ndarray, " extra"]  # x of the extension, where there is one
    predicted_ground: Mapping[str, Float[np.ndarray, "frames 6"]] = field(default_factory=dict)
    # by trial, of all feet [N, N·m about the ground origin]; empty where no force is missing
    learnt: LearntTerms | None = (
        None  # by the prediction fit that predicted missing forces, this time or before
    )
    learnt_on: Mapping[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    # by trial, the stretches of known frames that chose the kinds of these terms
    settled: SettledFit | None = None


def fit_to_forces(
    fits: Sequence[TrialFit],
    groundwork: Groundwork,
    skeleton: Skeleton,
    settings: Settings,
    progress: Progress,
    *,
    extension: Extension | None = None,
) -> Obeying:
    """Trajectories of all trials that have forces enough, fitted together; the others stay as they are.

    Args:
        fits: with contacts and mask; the search begins at the spline of every trial that has one.
        groundwork: with the markers; the search begins at its inertias.
        skeleton: with the mass that the forces were judged with.
        settings: of every stage.
        progress: told the fraction done; may raise `Cancelled`.
        extension: what acts beside the recorded forces.
    """
    match = groundwork.match
    fitted = fitted_to_forces(fits, settings)
    if not fitted:
        x = extension.x if extension else np.zeros(0)
        plain = tuple(replace(fit, spline=None) for fit in fits)
        return Obeying(skeleton, plain, None, (), x, learnt=groundwork.learnt, learnt_on=groundwork.learnt_on)
    cpu_timer = CpuTimer()
    with cpu_timer("dynamics"):
        members = [fits[i] for i in fitted]
        told = estimate_mass_and_gains(members, skeleton, settings, extended=extension is not None)
        edit = small_edit(members, told, groundwork, settings, extension)
        told = edit.told if edit is not None else told
        data = all_data(members, match, told, extension)
        release_memory()
        nominal, gain_notes = with_mass(skeleton, told.mass_kg), told.notes
        data = [
            started(trial, fits[i], nominal, settings)
            if fits[i].spline is None
            else replace(trial, spline=fits[i].spline)
            for i, trial in zip(fitted, data, strict=True)
        ]
        if edit is not None:
            result, prediction_fit = fitted_near_edit(
                edit, members, data, nominal, settings=settings, progress=progress
            )
        else:
            result, prediction_fit = _fitted_together(
                members,
                data,
                groundwork,
                skeleton=nominal,
                settings=settings,
                progress=progress,
                extension=extension,
            )
    predicted_ground: dict[str, Float[np.ndarray, "frames 6"]] = {}
    if prediction_fit is not None:
        gain_notes += prediction_fit.notes
        names = [fit.capture.name for fit in members]
        predicted_ground = dict(zip(names, prediction_fit.wrenches_ground, strict=True))
    updated = [replace(fit, spline=None) for fit in fits]
    for i, motion, spline, trial in zip(fitted, result.motions, result.splines, data, strict=True):
        model_markers = marker_positions(result.skeleton, motion.q)
        errors, marker_notes = marker_errors(
            result.skeleton,
            match.model,
            model_markers,
            trial.observed_ground,
            settings.kinematics,
            first_frame=fits[i].capture.markers.first_frame,
        )
        updated[i] = replace(
            fits[i],
            motion=motion,
            marker_errors=errors,
            model_markers_ground=model_markers,
            kinematics_only=KinematicsOnly(fits[i].motion, fits[i].marker_errors),
            spline=spline,
            costs=result.costs,
            notes=marker_notes,
            seconds=fits[i].seconds | {"dynamics": cpu_timer.seconds["dynamics"] / len(fitted)},
        )
    moved = result.skeleton.mass / skeleton.mass - 1
    if abs(moved) > settings.trajectory.notable_mass:
        gain_notes += (
            f"the fit moved the body's mass from {skeleton.mass:.1f} to {result.skeleton.mass:.1f} kg: is a "
            "force missing, the plates' gain off, something carried, or the entered mass wrong?",
        )
    gain_notes += segment_mass_notes(with_mass(skeleton, result.skeleton.mass), result, settings.trajectory)
    notes = (*result.notes, *gain_notes)
    learnt, learnt_on = groundwork.learnt, groundwork.learnt_on
    if prediction_fit is not None:
        if learnt_before(members, groundwork, settings) is None:
            learnt_on = {fit.capture.name: tuple(runs(fit.forces_known)) for fit in members}
        learnt = prediction_fit.learnt
        for k, i in enumerate(fitted):
            updated[i] = replace(updated[i], prediction_spline=prediction_fit.splines[k])
    return Obeying(
        result.skeleton,
        tuple(updated),
        result.phi,
        notes,
        result.extra,
        predicted_ground,
        learnt,
        learnt_on,
        settled_fit(members, told, result, prediction_fit, edit),
    )


def _fitted_together(
    fits: Sequence[TrialFit],
    data: Sequence[TrialData],
    groundwork: Groundwork,
    *,
    skeleton: Skeleton,
    settings: Settings,
    progress: Progress,
    extension: Extension | None,
) -> tuple[TrajectoryFit, Predicted | None]:
    """The trajectory fit; where a force is missing, held by what its prediction fit predicts.

    A first prediction fit begins where the fit ends without it. After an edit of the flags it begins
    at the former prediction fit, and one fit is enough.
    """

    def fit(
        trials: Sequence[TrialData], phi: Float[np.ndarray, " parameters"] | None, *, edited: bool
    ) -> TrajectoryFit:
        return fit_trajectories(
            skeleton,
            list(trials),
            settings.trajectory,
            progress,
            phi=phi,
            extra=extension.parameters if extension else None,
            weighed=extension is None,
            edited=edited,
        )

    edited = groundwork.phi is not None
    if not settings.prediction.enabled or not any(misses_a_force(trial) for trial in fits):
        return fit(data, groundwork.phi, edited=edited), None
    learnt = learnt_before(fits, groundwork, settings)
    begun = fit(data, groundwork.phi, edited=False) if learnt is None else None
    prediction_fit = prediction_fit_of(
        fits, data, begun, skeleton, settings, extension=extension, learnt=learnt
    )
    assert prediction_fit is not None
    held = with_predicted(data, begun, prediction_fit)
    return fit(held, begun.phi if begun else groundwork.phi, edited=edited), prediction_fit


def fitted_to_forces(fits: Sequence[TrialFit], settings: Settings) -> list[int]:
    """Which trials have forces enough for the trajectory fit."""
    if not settings.trajectory.enabled:
        return []
    return [i for i, f in enumerate(fits) if f.forces_known.sum() >= settings.trajectory.fewest_frames]


def all_data(
    fits: Sequence[TrialFit],
    match: MarkerMatch,
    told: Weighed,
    extension: Extension | None,
) -> list[TrialData]:
    """What the trials give to the trajectory fit.

    Args:
        fits: with contacts and mask.
        match: of the skeleton's markers.
        told: by the plates, of the body's mass and of their gains.
        extension: what acts beside the recorded forces.
    """
    data = []
    for fit, gain in zip(fits, told.gains, strict=True):
        extra = extra_of(fit, extension)
        plain = trial_data(fit, match, gain)
        data.append(extra.added_to(plain, gain) if extra else plain)
    return data


def extra_of(fit: TrialFit, extension: Extension | None) -> TrialExtension | None:
    """What of an extension acts in a trial."""
    extra = extension.trials.get(fit.capture.name) if extension else None
    first, frames = fit.capture.markers.first_frame, fit.motion.frames
    return extra.between(first, first + frames) if extra else None


def started(data: TrialData, fit: TrialFit, skeleton: Skeleton, settings: Settings) -> TrialData:
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
    return TrialData(match.observed(fit.capture.markers), wrench, fit.forces_known, fit.motion)


def segment_mass_notes(
    nominal: Skeleton, fit: TrajectoryFit, settings: TrajectorySettings
) -> tuple[str, ...]:
    """A note that names segments and ratios where forces ask for more than people's scatter; else nothing.

    Args:
        nominal: scaled, that the fit's inertias are changes of.
        fit: of it.
        settings: from which ratio on.
    """
    if not settings.fit_inertias:
        return ()
    inertias = inertia_parameters(nominal, settings)
    asked = inertias.pseudo_inertias(fit.asked_phi)[:, 3, 3]
    ratios = _ratios(nominal, asked)
    kept = _ratios(nominal, [body.mass for body in fit.skeleton.bodies])
    said = []
    for group in range(len(inertias.names)):
        bodies = np.flatnonzero(inertias.group == group)
        first = bodies[0]
        if max(abs(ratios[first] - 1), abs(kept[first] - 1)) <= settings.notable_segment_mass:
            continue
        names = " and ".join(nominal.bodies[b].name for b in bodies)
        said.append((abs(ratios[first] - 1), f"{names} {ratios[first]:.2f} (the fit has {kept[first]:.2f})"))
    if not said:
        return ()
    listed = ", ".join(text for _, text in sorted(said, reverse=True))
    return (
        "the forces would fit better with other segment masses than the tables give, by the factors: "
        f"{listed}; do forces come late, is a plate turned or misplaced, is something carried, or is the "
        "body unlike the tables? Soft tissue has the same effect, above all in runs and landings",
    )


def _ratios(
    nominal: Skeleton, masses: Sequence[float] | Float[np.ndarray, " bodies"]
) -> Float[np.ndarray, " bodies"]:
    """To the nominal masses; 1 where a segment has none."""
    own = np.array([body.mass for body in nominal.bodies])
    return np.divide(np.asarray(masses), own, out=np.ones(len(own)), where=own > 0)
