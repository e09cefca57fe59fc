"""The trajectory fit (eq. kitchen_sink_2): one spline through all frames, markers and F = ma together.

min over spline coefficients c and shared parameters φ of

    Σ_t Σ_m ρ(‖e_tm‖²)/σ_m²  +  Σ_t Δe_tᵀ C⁻¹ Δe_t  +  Σ_{t ∉ U} ρ(‖r_t(c, φ)‖²/σ_r²)
      +  Σ w ∫ (d³q/dt³)² dt  +  pull to the marker fit  +  priors(φ),

e the model markers less the measured ones, Δe_t their change since the frame before, r the root's residual
wrench; σ_m and C are the recording's own. Gauss-Newton with Levenberg's damping; time's band is a
block-tridiagonal matrix, φ its border. Frames of U are held by markers and smoothness, and by a wrench that
was foretold for them where there is one; their state still binds the frames around them.

The border is open to whatever else may act: r = demanded − measured − extra − columns x, with x shared by all
trials and N(0, prior_std²) before the data.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from threadpoolctl import threadpool_limits

from solver.dynamics.frame_spans import are_long
from solver.dynamics.inertia_caution import inertia_caution
from solver.dynamics.trajectory_search import TrajectoryFit, searched
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory_solver import TrajectorySolver, refuse
from solver.dynamics.trial_data import ExtraParameters, TrialData
from solver.dynamics.windowed_fit import WindowedFit
from solver.progress import Progress, silent
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

    Raises:
        FitError: no trial is long enough, or a trial's columns are not as many as extra parameters.
    """
    extra = extra or ExtraParameters.none()
    refuse(trials, extra)
    with threadpool_limits(1):
        caution = inertia_caution(skeleton, trials, settings) if settings.fit_inertias else 1.0
        if not are_long([len(trial.counts) for trial in trials], settings):
            solver = TrajectorySolver(skeleton, trials, settings, extra, caution, weighed=weighed)
            return searched(solver, progress, phi)
        return WindowedFit(skeleton, trials, settings, extra, caution, weighed=weighed).searched(
            progress, phi
        )
