"""Trajectories that obey the forces that count, withheld blocks, torques and residuals of all trials."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.capture.conditioning import shared_cutoff
from solver.clock import Clock
from solver.dynamics.com_data import ComData, com_data
from solver.dynamics.com_mass import MassPrior
from solver.dynamics.com_trajectory import fit_com_trajectory
from solver.dynamics.heldout import Heldout, withheld_frames
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.mass import mass_from_forces
from solver.dynamics.root_shift import with_com_at
from solver.dynamics.root_wrench import centre_of_mass
from solver.dynamics.trajectory_fit import TrialData, fit_trajectories
from solver.fit import KinematicsOnly, TrialFit
from solver.kinematics.marker_errors import marker_errors
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.motion import Motion
from solver.progress import Progress, part
from solver.settings import Settings
from solver.skeleton.forward import ForwardKinematics, marker_positions
from solver.skeleton.skeleton import Skeleton


def obeying_forces(
    fits: Sequence[TrialFit], match: MarkerMatch, skeleton: Skeleton, settings: Settings, progress: Progress
) -> tuple[Skeleton, list[TrialFit], tuple[str, ...]]:
    """Trajectories of all trials that have forces enough, fitted together; the others stay as they are."""
    fitted = [i for i, f in enumerate(fits) if f.forces_known.sum() >= settings.trajectory.fewest_frames]
    if not fitted or not settings.trajectory.enabled:
        return skeleton, list(fits), ()
    clock = Clock()
    with clock("dynamics"):
        gains, gain_notes = force_gains([fits[i] for i in fitted], skeleton, settings)
        data = [
            _started(trial_data(fits[i], match, gain), fits[i], skeleton, settings)
            for i, gain in zip(fitted, gains, strict=True)
        ]
        result = fit_trajectories(skeleton, data, settings.trajectory, part(progress, 0.0, 0.6))
        heldout = _heldout([fits[i] for i in fitted], data, skeleton, settings, part(progress, 0.6, 1.0))
    updated = list(fits)
    for i, motion, trial, withheld in zip(fitted, result.motions, data, heldout, strict=True):
        model_markers = marker_positions(result.skeleton, motion.q)
        errors, notes = marker_errors(match.model, model_markers, trial.observed_ground, settings.kinematics)
        updated[i] = replace(
            fits[i],
            motion=motion,
            marker_errors=errors,
            model_markers_ground=model_markers,
            kinematics_only=KinematicsOnly(fits[i].motion, fits[i].marker_errors),
            heldout=withheld,
            notes=notes,
            seconds=fits[i].seconds | {"dynamics": clock.seconds["dynamics"] / len(fitted)},
        )
    moved = result.skeleton.mass / skeleton.mass - 1
    if abs(moved) > settings.trajectory.notable_mass:
        gain_notes += (
            f"the fit moved the body's mass from {skeleton.mass:.1f} to {result.skeleton.mass:.1f} kg: is a "
            "force missing, the plates' gain off, something carried, or the entered mass wrong?",
        )
    return result.skeleton, updated, (*result.notes, *gain_notes)


def _started(data: TrialData, fit: TrialFit, skeleton: Skeleton, settings: Settings) -> TrialData:
    """The search begins with the root moved: the centre of mass goes where the known forces take it."""
    kinematics = ForwardKinematics(skeleton)
    com = ComData(
        centre_of_mass(skeleton, kinematics.poses(fit.motion.q)),
        data.wrench_ground[:, :3],
        data.counts,
        fit.motion.rate,
        skeleton.gravity,
    )
    path = fit_com_trajectory(com, settings.com, MassPrior(skeleton.mass, 0.0))
    q = with_com_at(skeleton, fit.motion.q, path.com_ground)
    return replace(data, initial=replace(fit.motion, q=q))


def force_gains(
    fits: Sequence[TrialFit], skeleton: Skeleton, settings: Settings
) -> tuple[list[float], tuple[str, ...]]:
    """How much more each trial's plates read than the mass that all trials agree on.

    One body has one mass. Where plates of different trials say otherwise, the fit follows their forces in
    shape and leaves the difference in the residual; else it would bend every motion, most of all where forces
    are missing. One trial alone has no such difference.
    """
    trials = [com_data(skeleton, f.motion, f.contacts, f.mask) for f in fits if f.contacts and f.mask]
    pooled = mass_from_forces(trials, settings.com)
    if len(trials) < 2 or pooled is None:
        return [1.0] * len(trials), ()
    gains, notes = [], []
    for fit, trial in zip(fits, trials, strict=True):
        own = mass_from_forces([trial], settings.com)
        gain = 1.0
        if own is not None:
            trust = 1 / (1 + (own.sampling_std_kg / (settings.trajectory.gain_std * pooled.mass_kg)) ** 2)
            gain += trust * (own.mass_kg / pooled.mass_kg - 1)
        if abs(gain - 1) > settings.trajectory.notable_gain:
            notes.append(
                f"{fit.capture.name}: plates read {100 * (gain - 1):+.1f} % against the other trials"
            )
        gains.append(gain)
    return gains, tuple(notes)


def _heldout(
    fits: Sequence[TrialFit],
    data: Sequence[TrialData],
    skeleton: Skeleton,
    settings: Settings,
    progress: Progress,
) -> list[Heldout | None]:
    """The same fit without the forces of some blocks, judged on these blocks."""
    withheld = [withheld_frames(d.counts, d.start.rate, settings.trajectory) for d in data]
    if not settings.trajectory.heldout or not any(w.any() for w in withheld):
        return [None] * len(fits)
    blind = [replace(d, counts=d.counts & ~w) for d, w in zip(data, withheld, strict=True)]
    result = fit_trajectories(skeleton, blind, settings.trajectory, progress)
    outcome: list[Heldout | None] = []
    for fit, frames, motion in zip(fits, withheld, result.motions, strict=True):
        assert fit.contacts is not None
        assert fit.mask is not None
        of_fit = inverse_dynamics(result.skeleton, motion, fit.contacts, fit.mask, settings.dynamics)
        before = inverse_dynamics(
            skeleton, filtered(fit.motion, settings), fit.contacts, fit.mask, settings.dynamics
        )
        outcome.append(Heldout(frames & of_fit.used, of_fit.residual_root, before.residual_root))
    return outcome


def with_dynamics(fit: TrialFit, skeleton: Skeleton, settings: Settings) -> TrialFit:
    """Torques and residuals; a trajectory that was fitted to forces needs no filter any more."""
    if fit.contacts is None or fit.mask is None:
        return fit
    clock = Clock()
    with clock("dynamics"):
        motion = fit.motion if fit.kinematics_only else filtered(fit.motion, settings)
        dynamics = inverse_dynamics(skeleton, motion, fit.contacts, fit.mask, settings.dynamics)
    seconds = fit.seconds.get("dynamics", 0.0) + clock.seconds["dynamics"]
    return replace(fit, dynamics=dynamics, seconds=fit.seconds | {"dynamics": seconds})


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


def filtered(motion: Motion, settings: Settings) -> Motion:
    """The motion after the filter that the forces pass."""
    return motion.low_passed(shared_cutoff(motion.rate, settings.conditioning), settings.conditioning.order)
