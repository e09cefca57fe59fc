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

The trajectory fit of trials that are too long to be one problem: memory is that of a window.

Inertias φ and x are found first on some of the frames. With these fixed every trial is fitted by itself, long
ones in windows that overlap. There, every window tells what it would have of φ and x when its own motion
follows: the border that is left when its band is eliminated. Their sum makes one more step of Gauss and
Newton, that of the whole problem, and the motion follows once more. So φ and x are those of all frames.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.common.filters import low_pass
from solver.common.frames_at_once import by_frames, joined
from solver.common.notes import Kind, Note
from solver.common.one_thread import one_thread
from solver.common.progress import Progress, part, silent
from solver.dynamics.inertia_parameters import inertia_parameters
from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.root_wrench import about_point, root_centre
from solver.dynamics.trajectory.bordered_system import BorderedFactor, Gradient
from solver.dynamics.trajectory.frame_spans import Span, are_long, teaching_spans, windows
from solver.dynamics.trajectory.terms.term import REFERENCE_RATE_HZ, SharedParameters
from solver.dynamics.trajectory.trajectory_search import Border, TrajectoryFit, extra_covariance, searched
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import (
    State,
    TrajectorySolver,
    basis_for,
    knot_spacing,
    refuse,
    shared_priors,
    trial_levels,
)
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

# [Hz] below it, what the markers' motion leaves of the forces tells how far these are to be believed about
# inertias: marker noise is above, clocks, plates and model errors are below
INERTIA_CUTOFF_HZ = 6.0

TAUGHT, FITTED, SUMMED = 0.2, 0.6, 0.8  # shares of the work that are done after each stage
Splines = list[Float[np.ndarray, "coefficients dofs"]]


class WindowedFit:
    """A fit whose trials are weighed as wholes and worked out in parts."""

    def __init__(
        self,
        skeleton: Skeleton,
        trials: Sequence[TrialData],
        settings: TrajectorySettings,
        extra: ExtraParameters,
        caution: float,
        *,
        mass_is_fitted: bool,
    ) -> None:
        """Arguments as of `fit_trajectories`; the caution is that of all frames."""
        kinematics = ForwardKinematics(skeleton)
        self.skeleton, self.settings, self.extra = skeleton, settings, extra
        self.caution, self.mass_is_fitted = caution, mass_is_fitted
        self.spacing = [knot_spacing(trial.start, settings) for trial in trials]
        self.trials = [
            replace(t, levels=t.levels or trial_levels(kinematics, t.observed_ground, t.start, settings))
            for t in trials
        ]
        self.windows = [
            span
            for i, trial in enumerate(trials)
            for span in windows(i, len(trial.counts), self.spacing[i], settings)
        ]

    def searched(self, progress: Progress, phi: Float[np.ndarray, " parameters"] | None) -> TrajectoryFit:
        """All stages.

        Args:
            progress: told the fraction done; may raise `Cancelled`.
            phi: inertia parameters where the search begins; None: the nominal ones.
        """
        spans = teaching_spans(self.trials, self.spacing, self.settings)
        teachers = [self._part(self.trials[span.trial], span) for span in spans]
        taught = searched(self._solver(teachers), part(progress, 0.0, TAUGHT), phi)
        if not self.settings.fit_inertias and not len(self.extra.start):
            return self._whole_fit(taught, self._followed(self.trials, taught, part(progress, TAUGHT, 1.0)))
        first = self._followed(self.trials, taught, part(progress, TAUGHT, FITTED))
        splines, costs = self._joined(first), _summed_costs(first)
        del first
        trials = [
            replace(trial, spline=spline, other_start=None)
            for trial, spline in zip(self.trials, splines, strict=True)
        ]
        shared = self._by_all_frames(trials, taught, part(progress, FITTED, SUMMED))
        last = self._followed(trials, shared, part(progress, SUMMED, 1.0))
        own_progress = self._whole_fit(shared, last)
        return replace(own_progress, costs=(*costs, own_progress.costs[-1]))

    def _part(self, trial: TrialData, span: Span) -> TrialData:
        return trial.part(span.start, span.end, self.spacing[span.trial])

    def _solver(self, trials: Sequence[TrialData]) -> TrajectorySolver:
        """Of trials, or parts of them, with all that they share free."""
        return TrajectorySolver(
            self.skeleton, trials, self.settings, self.extra, self.caution, mass_is_fitted=self.mass_is_fitted
        )

    def _followed(
        self, trials: Sequence[TrialData], shared: TrajectoryFit, progress: Progress
    ) -> list[TrajectoryFit]:
        """The spline of every window with what all share fixed."""
        fixed, fits = replace(self.settings, fit_inertias=False), []
        for k, span in enumerate(self.windows):
            data = self._part(trials[span.trial], span).with_fixed_extra(shared.extra)
            own_progress = part(progress, k / len(self.windows), (k + 1) / len(self.windows))
            fit = searched(TrajectorySolver(shared.skeleton, [data], fixed), own_progress, None)
            fits.append(replace(fit, motions=()))  # that of the joined splines is the trial's
        return fits

    def _by_all_frames(
        self, trials: Sequence[TrialData], taught: TrajectoryFit, progress: Progress
    ) -> TrajectoryFit:
        """What all share after a step that sums up what every window would have of it.

        Args:
            trials: with the splines that go with what was taught.
            taught: by some of the frames.
            progress: told the fraction done; may raise `Cancelled`.
        """
        inertias = inertia_parameters(self.skeleton)
        at = SharedParameters(inertias, taught.phi, taught.extra, self.settings.fit_inertias)
        of_all = shared_priors(
            inertias, trials, self.settings, self.extra, self.caution, mass_is_fitted=self.mass_is_fitted
        )
        corner = sum((p.curvature(at) for p in of_all.priors), np.zeros((at.count, at.count)))
        gradient = sum((p.gradient(at) for p in of_all.priors), np.zeros(at.count))
        for k, span in enumerate(self.windows):
            progress("dynamics", k / len(self.windows))
            own = [s.frames for s in self.windows if s.trial == span.trial]
            once = len(trials[span.trial].counts) / sum(own)  # shared frames are in two windows
            own_corner, own_gradient = self._border_of(self._part(trials[span.trial], span), at)
            corner += once * own_corner
            gradient += once * own_gradient
        cautious, plain = of_all.cautious, of_all.uncautious
        asked_corner = corner + plain.curvature(at) - cautious.curvature(at)
        asked_gradient = gradient + plain.gradient(at) - cautious.gradient(at)
        moved = at.moved(-np.linalg.solve(corner, gradient))
        free = at.free_inertias
        return replace(
            taught,
            skeleton=moved.skeleton if free else inertias.skeleton,
            phi=moved.phi,
            asked_phi=at.moved(-np.linalg.solve(asked_corner, asked_gradient)).phi,
            extra=moved.x,
            extra_covariance=extra_covariance(at, corner),
            border=Border(corner, at, of_all) if free else None,
        )

    def _border_of(
        self, window: TrialData, at: SharedParameters
    ) -> tuple[Float[np.ndarray, "shared shared"], Float[np.ndarray, " shared"]]:
        """Curvature and gradient of what all share when a window's motion follows; its band is gone then."""
        assert window.spline is not None
        solver = self._solver([window])
        system = solver.linearized(State([window.spline], solver.shared(at.phi, at.x)))
        own = system[0].gradient
        slope = Gradient((own.coefficients,), own.shared, own.cost)
        factor = BorderedFactor(system, np.zeros((at.count, at.count)))
        return factor.corner, factor.reduced(slope)

    def _joined(self, fits: Sequence[TrajectoryFit]) -> Splines:
        """One spline a trial."""
        splines = []
        for i, trial in enumerate(self.trials):
            own = [(f.splines[0], s) for f, s in zip(fits, self.windows, strict=True) if s.trial == i]
            starts = [span.start // self.spacing[i] for _, span in own]
            splines.append(joined([spline for spline, _ in own], starts))
            assert len(splines[-1]) == basis_for(trial.start, self.settings).coefficients
        return splines

    def _whole_fit(self, shared: TrajectoryFit, fits: Sequence[TrajectoryFit]) -> TrajectoryFit:
        """The whole."""
        splines, unsettled = self._joined(fits), sum(not fit.converged for fit in fits)
        note = Note(
            Kind.SOLVE, f"the trajectory fit did not settle in {unsettled} of {len(fits)} parts of the trials"
        )
        return replace(
            shared,
            motions=tuple(
                replace(trial.start, q=basis_for(trial.start, self.settings).evaluate(spline))
                for trial, spline in zip(self.trials, splines, strict=True)
            ),
            splines=tuple(splines),
            iterations=max(fit.iterations for fit in fits),
            converged=not unsettled,
            notes=(note,) if unsettled else (),
            costs=_summed_costs(fits),
        )


def _summed_costs(fits: Sequence[TrajectoryFit]) -> tuple[float, ...]:
    """Where the searches began, and after each iteration; those that have ended stay where they are."""
    rounds = max(len(fit.costs) for fit in fits)
    return tuple(sum(fit.costs[min(k, len(fit.costs) - 1)] for fit in fits) for k in range(rounds))


def fit_trajectories(
    skeleton: Skeleton,
    trials: Sequence[TrialData],
    settings: TrajectorySettings,
    progress: Progress = silent,
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters | None = None,
    mass_is_fitted: bool = False,
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
        mass_is_fitted: the skeleton's mass is what these forces weigh already; it moves no more easily than
            shares.
        edited: the trials begin at splines of an earlier fit, and forces have changed since; what that gains
            decides where the search ends. Longer trials are made anew as from the beginning.

    Raises:
        FitError: no trial is long enough, or a trial's columns are not as many as extra parameters.
    """
    extra = extra or ExtraParameters.none()
    refuse(trials, extra)
    with one_thread():
        caution = inertia_caution(skeleton, trials, settings) if settings.fit_inertias else 1.0
        if not are_long([len(trial.counts) for trial in trials], settings):
            solver = TrajectorySolver(
                skeleton, trials, settings, extra, caution, mass_is_fitted=mass_is_fitted
            )
            return searched(solver, progress, phi, edited=edited)
        return WindowedFit(
            skeleton, trials, settings, extra, caution, mass_is_fitted=mass_is_fitted
        ).searched(progress, phi)


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
    return max(1.0, size * REFERENCE_RATE_HZ / (2 * INERTIA_CUTOFF_HZ))


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
    slow = low_pass(missing, motion.rate, INERTIA_CUTOFF_HZ)[trial.counts]
    std = np.repeat([settings.residual_force_std_N, settings.residual_moment_std_Nm], 3)
    return float(np.mean((slow / std) ** 2))
