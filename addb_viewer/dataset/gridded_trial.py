"""A solved trial on the release's grid: motions from their splines, torques and residuals computed there."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from addb_viewer.dataset.grid import Grid, grid_of
from addb_viewer.dataset.ground_forces import (
    Surfaces,
    Verdicts,
    contacts_on_grid,
    given_to_no_foot,
    mask_on_grid,
    surfaces_under,
    verdicts_on,
    with_pressure_points,
)
from solver.capture.capture import Markers
from solver.capture.plates.conditioning import shared_cutoff
from solver.capture.plates.force_settings import ConditioningSettings
from solver.common.errors import ModelError
from solver.common.frames_at_once import by_frames
from solver.common.true_runs import runs
from solver.contact.contact_phases import ContactPhase, contact_phases
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.force_prediction.missing_wrench import torques_under
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.trajectory.spline_basis import DEGREE, spline_at
from solver.fitting.fit_result import Fit, KinematicsOnly, TrialFit
from solver.fitting.settings import Settings
from solver.fitting.torques_stage import filter_as_forces
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion, ResampledMotion, resampled
from solver.skeleton.forward import body_poses, marker_positions
from solver.skeleton.skeleton import Skeleton

SAME_M = 1e-9  # [rad or m] that a spline may miss the fit's own frames by: rounding

ErrorsOf = Callable[[Motion], MarkerErrors]


@dataclass(frozen=True)
class Moving:
    """A pass of a trial."""

    motion: Motion
    errors: MarkerErrors


def moving_at(motion: Motion, grid: Grid, errors_of: ErrorsOf) -> Moving:
    """The natural quintic spline through a motion, at the grid's frames.

    Args:
        motion: at the recording's frames.
        grid: of the release.
        errors_of: markers' distances in a motion at the grid's frames.
    """
    at_frames = motion if grid.is_native else resampled(motion, grid.rate, grid.frames)
    return Moving(at_frames, errors_of(at_frames))


def spline_moving(trial: TrialFit, settings: Settings, grid: Grid, errors_of: ErrorsOf) -> Moving:
    """The fitted spline itself at the grid's frames; the one through the fit's frames where it is not kept.

    Args:
        trial: fitted to forces.
        settings: of the fit.
        grid: of the release.
        errors_of: as for `moving_at`.
    """
    coefficients = trial.spline
    if grid.is_native or coefficients is None or not trial.motion.posed.all():
        return moving_at(trial.motion, grid, errors_of)
    width = max(1, round(settings.trajectory.knot_spacing_s * grid.native_rate)) / grid.native_rate
    own = np.arange(grid.native_frames) / grid.native_rate
    if own[-1] > (len(coefficients) - DEGREE) * width + 1e-9:
        return moving_at(trial.motion, grid, errors_of)
    if np.abs(spline_at(coefficients, width, own) - trial.motion.q).max() > SAME_M:
        return moving_at(trial.motion, grid, errors_of)
    q, qd, qdd = (spline_at(coefficients, width, grid.seconds, order) for order in range(3))
    motion = ResampledMotion(trial.motion.dofs, q, grid.rate, grid.start_time, qd=qd, qdd=qdd)
    return Moving(motion, errors_of(motion))


_ROUNDING = 1e-6  # [N, N·m] below it nothing acts beside the forces


@dataclass(frozen=True)
class Extra:
    """What accepted causes add to a trial, at some frames."""

    root: Float[np.ndarray, "frames 6"]  # [N, N·m about the root joint's centre]
    torques: Float[np.ndarray, "frames dofs"]  # that they take from the joint torques [N·m or N]

    def on(self, grid: Grid) -> "Extra":
        """By cubic splines, at the grid's frames."""
        return Extra(grid.interpolated(self.root), grid.interpolated(self.torques))


def extra_of(trial: TrialFit, skeleton: Skeleton, settings: Settings) -> Extra:
    """By how much the fit's dynamics differ from those under the recorded and predicted forces alone.

    Args:
        trial: at the recording's frames, with dynamics.
        skeleton: fitted.
        settings: of the fit.
    """
    contacts, mask, dynamics = _parts(trial)
    alone = inverse_dynamics(skeleton, dynamics.motion, contacts, mask, settings.dynamics)
    root = alone.residual_root - dynamics.residual_root
    if not np.abs(root).max(initial=0.0) > _ROUNDING:
        return Extra(np.zeros_like(root), np.zeros_like(dynamics.joint_torques))
    torques = torques_under(skeleton, alone, contacts, mask, joined_wrenches(trial))
    return Extra(root, torques - dynamics.joint_torques)


def joined_wrenches(trial: TrialFit) -> Float[np.ndarray, "frames feet 6"]:
    """Measured where they count, predicted elsewhere [N, N·m about the ground origin].

    The inference joined both without a jump.
    """
    contacts, mask, dynamics = _parts(trial)
    predicted = dynamics.wrench_predicted_ground
    other = np.zeros_like(contacts.wrench_ground) if predicted is None else predicted
    return np.where(mask.counts[:, :, None], contacts.wrench_ground, other)


def dynamics_on_grid(
    trial: TrialFit,
    motion: Motion,
    contacts: ContactWrenches,
    mask: FrameMask,
    *,
    grid: Grid,
    extra: Extra,
    skeleton: Skeleton,
    settings: Settings,
) -> Dynamics:
    """Inverse dynamics of the motion on the grid, under the wrenches there.

    Where a foot's wrench is missing, torques rest on the predicted one, by the spline of `joined_wrenches`.

    Args:
        trial: at the recording's frames, with dynamics.
        motion: on the grid.
        contacts: on the grid.
        mask: on the grid.
        grid: of the release.
        extra: on the grid.
        skeleton: fitted.
        settings: of the fit.
    """
    there = inverse_dynamics(skeleton, motion, contacts, mask, settings.dynamics)
    ends = min(settings.dynamics.end_frames, grid.native_frames // 4)
    inside = np.zeros(grid.frames, dtype=bool)
    for start, end in runs(trial.motion.posed):
        inside |= (grid.places >= start + ends) & (grid.places <= end - 1 - ends)
    there = replace(there, used=contacts.observed & mask.all_feet & inside)
    if not mask.counts.all():
        counted = mask.counts[:, :, None]
        predicted = grid.interpolated(joined_wrenches(trial))
        wrenches = np.where(counted, contacts.wrench_ground, predicted)
        there = replace(
            there,
            joint_torques=torques_under(skeleton, there, contacts, mask, wrenches),
            wrench_is_predicted=~mask.counts,
            wrench_predicted_ground=np.where(counted, 0.0, predicted),
        )
    return replace(
        there,
        joint_torques=there.joint_torques - extra.torques,
        residual_root=there.residual_root - extra.root,
        residual_raw_root=there.residual_raw_root - extra.root,
    )


def _parts(trial: TrialFit) -> tuple[ContactWrenches, FrameMask, Dynamics]:
    assert trial.contacts is not None
    assert trial.mask is not None
    assert trial.dynamics is not None
    return trial.contacts, trial.mask, trial.dynamics


@dataclass(frozen=True)
class GriddedTrial:
    """Everything that a release says of a trial, at the grid's frames."""

    grid: Grid
    trial: TrialFit  # its arrays on the grid; plates keep their own clock
    filtered: KinematicsOnly  # pass F
    verdicts: Verdicts
    surfaces: Surfaces
    extra_root: Float[np.ndarray, "frames 6"]  # that accepted causes add [N, N·m about the root's centre]
    phases: tuple[ContactPhase, ...]  # in frames of the grid
    conditioning: ConditioningSettings

    @property
    def cutoff_Hz(self) -> float:
        """Of the filter that forces and pass F went through, at the recording's rate."""
        return shared_cutoff(self.grid.native_rate, self.conditioning)

    @property
    def name(self) -> str:
        """Of the trial."""
        return self.trial.capture.name


def on_grid(
    fit: Fit, trial: TrialFit, settings: Settings, rate: float | None, *, finished: bool = False
) -> GriddedTrial:
    """A trial of a solved subject at the release's frames, which at the recording's own rate is as it was.

    Args:
        fit: solved, not re-solved.
        trial: of it, with contacts, mask and dynamics.
        settings: of the fit.
        rate: of the release [Hz]; None: the recording's own.
        finished: whether somebody has finished the trial's review.

    Raises:
        ModelError: the skeleton's root is not free to move in all six ways.
    """
    assert trial.contacts is not None
    assert trial.dynamics is not None
    native, skeleton = trial.capture.markers, fit.skeleton
    grid = grid_of(native.frames, native.rate, native.start_time, rate)
    there, surfaces = _measured_on(grid, trial, settings)
    assert there.contacts is not None
    assert there.mask is not None
    k, f, d = _motions(fit, trial, settings, grid, there.capture.markers)
    shown, extra, dynamics = d or k, extra_of(trial, skeleton, settings), trial.dynamics
    if not grid.is_native:
        extra = extra.on(grid)
        dynamics = dynamics_on_grid(
            trial,
            (d or f).motion,
            there.contacts,
            there.mask,
            grid=grid,
            extra=extra,
            skeleton=skeleton,
            settings=settings,
        )
    strange = given_to_no_foot(trial.contacts, trial.capture, settings)
    verdicts = verdicts_on(
        trial, there.mask, there.contacts, grid, settings=settings, strange=strange, finished=finished
    )
    return GriddedTrial(
        grid=grid,
        trial=replace(
            there,
            motion=shown.motion,
            marker_errors=shown.errors,
            model_markers_ground=_model_markers(trial, shown.motion, skeleton, grid),
            dynamics=replace(dynamics, used=dynamics.used & verdicts.counts),
            kinematics_only=KinematicsOnly(k.motion, k.errors) if d else None,
            spline=None,
            prediction_spline=None,
            std=None,
        ),
        filtered=KinematicsOnly(f.motion, f.errors),
        verdicts=verdicts,
        surfaces=surfaces,
        extra_root=extra.root,
        phases=_phases_on(grid, _phases(trial, skeleton, settings)),
        conditioning=settings.conditioning,
    )


def _measured_on(grid: Grid, trial: TrialFit, settings: Settings) -> tuple[TrialFit, Surfaces]:
    """Markers, wrenches and mask on the grid, and what the feet press on; the rest is still the fit's."""
    assert trial.contacts is not None
    assert trial.mask is not None
    contacts = contacts_on_grid(trial.contacts, grid)
    surfaces = surfaces_under(contacts, trial.capture, settings)
    if grid.is_native:
        return replace(trial, contacts=contacts), surfaces
    native = trial.capture.markers
    positions = grid.interpolated_where_seen(native.positions_ground)
    markers = replace(native, positions_ground=positions, rate=grid.rate)
    there = replace(
        trial,
        capture=replace(trial.capture, markers=markers),
        contacts=with_pressure_points(contacts, surfaces, settings.conditioning.threshold_N),
        mask=mask_on_grid(trial.mask, grid),
    )
    return there, surfaces


def _model_markers(
    trial: TrialFit, motion: Motion, skeleton: Skeleton, grid: Grid
) -> Float[np.ndarray, "frames markers 3"]:
    """Where the skeleton has the compared markers at the grid's frames [m]."""
    return trial.model_markers_ground if grid.is_native else marker_positions(skeleton, motion.q)


def _motions(
    fit: Fit, trial: TrialFit, settings: Settings, grid: Grid, measured: Markers
) -> tuple[Moving, Moving, Moving | None]:
    """Passes K, F, and D where the trial was fitted to forces."""
    alone = trial.kinematics_only
    raw, skeleton = alone.motion if alone else trial.motion, fit.skeleton
    observed = fit.groundwork.match.observed(measured) if fit.groundwork else None

    def distances(
        q: Float[np.ndarray, "some dofs"], seen: Float[np.ndarray, "some markers 3"]
    ) -> Float[np.ndarray, "some markers"]:
        return np.linalg.norm(marker_positions(skeleton, q) - seen, axis=2)

    def errors_of(motion: Motion) -> MarkerErrors:
        names = trial.marker_errors.names
        if observed is None:
            return MarkerErrors(names, np.zeros((motion.frames, len(names))))
        return MarkerErrors(names, by_frames(distances, motion.q, observed))

    f = moving_at(filter_as_forces(raw, settings), grid, errors_of)
    if grid.is_native:
        of_markers = Moving(raw, (alone or trial).marker_errors)
        return of_markers, f, Moving(trial.motion, trial.marker_errors) if alone else None
    k = moving_at(raw, grid, errors_of)
    return k, f, spline_moving(trial, settings, grid, errors_of) if alone else None


def _phases(trial: TrialFit, skeleton: Skeleton, settings: Settings) -> tuple[ContactPhase, ...]:
    """Contacts of the feet at the recording's frames, from plates and the markers' motion."""
    assert trial.contacts is not None
    motion = trial.kinematics_only.motion if trial.kinematics_only else trial.motion
    try:
        R, p = body_poses(skeleton, motion.q)
        return contact_phases(
            trial.contacts, R, p, skeleton=skeleton, rate=motion.rate, settings=settings.contact
        )
    except ModelError:
        return ()  # bodies that forces act on, and no feet with toes


def _phases_on(grid: Grid, phases: tuple[ContactPhase, ...]) -> tuple[ContactPhase, ...]:
    moved = [(*grid.frames_nearest_to(phase.start, phase.end), phase) for phase in phases]
    return tuple(replace(phase, start=a, end=b) for a, b, phase in moved if a < b)
