"""The trajectory fit (eq. kitchen_sink_2): one spline through all frames, markers and F = ma together.

min over spline coefficients c and shared parameters φ of

    Σ_t Σ_m ρ(‖e_tm‖²)/σ_m²  +  Σ_t Δe_tᵀ C⁻¹ Δe_t  +  Σ_{t ∉ U} ρ(‖r_t(c, φ)‖²/σ_r²)
      +  Σ w ∫ (d³q/dt³)² dt  +  pull to the marker fit  +  priors(φ),

e the model markers less the measured ones, Δe_t their change since the frame before, r the root's residual
wrench; σ_m and C are the recording's own. Gauss-Newton with Levenberg's damping; time's band is a
block-tridiagonal matrix, φ its border. Frames of U are held by markers and smoothness, and by a wrench that
was predicted for them where there is one; their state still binds the frames around them.

The border is open to whatever else may act: r = required − measured − extra − columns x, with x shared by all
trials and N(0, prior_std²) before the data.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from threadpoolctl import threadpool_limits

from solver.common.filters import low_pass
from solver.common.frames_at_once import by_frames
from solver.common.progress import Progress, silent
from solver.dynamics.force_prediction.demand_gains import required_ground
from solver.dynamics.root_wrench import about_point, root_centre
from solver.dynamics.trajectory.frame_spans import are_long
from solver.dynamics.trajectory.terms.trial_point import REFERENCE_RATE_HZ
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit, searched
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import TrajectorySolver, refuse
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.dynamics.trajectory.windowed_fit import WindowedFit
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton


def fit_trajectories(
    skeleton: Skeleton,
    trials: Sequence[TrialData],
    settings: TrajectorySettings,
    progress: Progress = silent,
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters | None = None,
    weighed: bool = False,
    edited: bool = False,
) -> TrajectoryFit:
    """Fit all trials of a subject with one set of inertias.

    As one problem, as long as they have no more than `whole_frames` together; longer ones window by window.

    Args:
        skeleton: scaled, with the entered mass; its markers are those of the trials' data.
        trials: any number, at any rates.
        settings: weights.
        progress: told the fraction done; may raise `Cancelled`.
        phi: inertia parameters where the search begins, those of an earlier fit; None: the nominal ones.
        extra: of the trials' extra columns; None: they have none.
        weighed: the skeleton's mass is what these forces weigh already; it moves no more easily than shares.
        edited: the trials begin at splines of an earlier fit, and forces have changed since; what that gains
            decides where the search ends. Longer trials are made anew as from the beginning.

    Raises:
        FitError: no trial is long enough, or a trial's columns are not as many as extra parameters.
    """
    extra = extra or ExtraParameters.none()
    refuse(trials, extra)
    with threadpool_limits(1):
        caution = inertia_caution(skeleton, trials, settings) if settings.fit_inertias else 1.0
        if not are_long([len(trial.counts) for trial in trials], settings):
            solver = TrajectorySolver(skeleton, trials, settings, extra, caution, weighed=weighed)
            return searched(solver, progress, phi, edited=edited)
        return WindowedFit(skeleton, trials, settings, extra, caution, weighed=weighed).searched(
            progress, phi
        )


def inertia_caution(skeleton: Skeleton, trials: Sequence[TrialData], settings: TrajectorySettings) -> float:
    """By how much the fit overrates what its frames say of inertias; at least 1.

    Below a cut-off f, a second holds 2f independent errors, where the fit counts a hundred of a fixed size,
    16 N and 8 N·m. What a model, a clock or a plate gets wrong lasts for a sixth of a second or a whole trial
    and may be many times as large; taken at its word, it makes shanks twice what they are. The size of these
    errors is what the marker fit's motion leaves unexplained there, with the inertias of the tables.

    Args:
        skeleton: scaled, with these inertias.
        trials: their marker fits and forces.
        settings: the fit's deviations of the residual, and the cut-off.
    """
    squares, frames = 0.0, 0.0
    for trial in trials:
        weight = int(trial.counts.sum()) / trial.start.rate
        if weight:
            squares += weight * _unexplained(skeleton, trial, settings)
            frames += weight
    size = squares / frames if frames else 0.0
    return max(1.0, size * REFERENCE_RATE_HZ / (2 * settings.inertia_cutoff_Hz))


def _unexplained(skeleton: Skeleton, trial: TrialData, settings: TrajectorySettings) -> float:
    """Mean square of the low-passed residual about the root joint's centre, over the fit's own deviations."""
    motion = trial.start
    missing = required_ground(skeleton, motion) - trial.wrench_ground
    if trial.extra_wrench_ground is not None:
        missing = missing - trial.extra_wrench_ground
    root = root_joint(skeleton)
    kinematics = ForwardKinematics(skeleton)
    centre = by_frames(lambda q: root_centre(root, kinematics.poses(q)), motion.q)
    missing = about_point(missing, centre)
    missing[~trial.counts] = 0.0
    slow = low_pass(missing, motion.rate, settings.inertia_cutoff_Hz)[trial.counts]
    std = np.repeat([settings.residual_force_std_N, settings.residual_moment_std_Nm], 3)
    return float(np.mean((slow / std) ** 2))
