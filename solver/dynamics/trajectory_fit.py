"""The trajectory fit (eq. kitchen_sink_2): one spline through all frames, markers and F = ma together.

min over spline coefficients c and shared parameters φ of

    Σ_t Σ_m ρ(‖e_tm‖²)/σ_m²  +  Σ_t Σ_m ‖e_tm − e_(t−1)m‖²/σ_d²  +  Σ_{t ∉ U} ‖r_t(c, φ)‖²/σ_r²
      +  Σ w ∫ (d³q/dt³)² dt  +  pull to the marker fit  +  priors(φ),

e the model markers less the measured ones, r the root's residual wrench. Gauss-Newton with Levenberg's
damping; time's band is a block-tridiagonal matrix, φ its border. Frames of U have no force term and are held
by markers and smoothness; their state still binds the frames around them.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from threadpoolctl import threadpool_limits

from solver.dynamics.inertia_parameters import InertiaParameters, inertia_parameters, prior_std
from solver.dynamics.spline_band import CoefficientBand
from solver.dynamics.spline_basis import SplineBasis, spline_basis
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory_terms import MarkerTrack, ResidualTrack
from solver.errors import FitError
from solver.kinematics.frame_solver import root_dofs
from solver.kinematics.motion import Motion
from solver.progress import Progress, silent
from solver.skeleton.skeleton import Skeleton

REFERENCE_RATE_HZ = 100.0  # the weights of single frames are stated for it
MOST_DAMPING = 1e8


@dataclass(frozen=True)
class TrialData:
    """What one trial gives to the fit; everything at the markers' frames."""

    observed_ground: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen; the skeleton's markers
    wrench_ground: Float[np.ndarray, "frames 6"]  # [N, N·m about the ground origin] of all feet together
    counts: Bool[np.ndarray, " frames"]  # False on frames of U
    start: Motion  # the marker fit
    initial: Motion | None = None  # where the search begins; None: at the marker fit


@dataclass(frozen=True)
class TrajectoryFit:
    """A trial's trajectory and the skeleton's inertias that go with it."""

    skeleton: Skeleton
    motions: tuple[Motion, ...]
    phi: Float[np.ndarray, " parameters"]
    inertia_names: tuple[str, ...]
    iterations: int
    converged: bool
    notes: tuple[str, ...]


def fit_trajectories(
    skeleton: Skeleton,
    trials: list[TrialData],
    settings: TrajectorySettings,
    progress: Progress = silent,
) -> TrajectoryFit:
    """Fit all trials of a subject with one set of inertias.

    Args:
        skeleton: scaled, with the entered mass; its markers are those of the trials' data.
        trials: any number, at any rates.
        settings: weights.
        progress: told the fraction done; may raise `Cancelled`.

    Raises:
        FitError: no trial is long enough.
    """
    if not trials or min(len(t.observed_ground) for t in trials) < 2:
        raise FitError("The trajectory fit needs trials of two frames or more.")
    with threadpool_limits(1):
        return _Solver(skeleton, trials, settings).run(progress)


@dataclass
class _State:
    coefficients: list[Float[np.ndarray, "coefficients dofs"]]
    phi: Float[np.ndarray, " parameters"]


class _Solver:
    def __init__(self, skeleton: Skeleton, trials: list[TrialData], settings: TrajectorySettings) -> None:
        self.settings, self.trials = settings, trials
        self.inertias = inertia_parameters(skeleton, settings)
        self.parameters = self.inertias.count if settings.fit_inertias else 0
        self.prior_precision = settings.inertia_prior_weight / prior_std(self.inertias, settings) ** 2
        self.parts = [_Trial(skeleton, data, settings) for data in trials]
        self.entered_mass = skeleton.mass

    def run(self, progress: Progress) -> TrajectoryFit:
        state = _State([p.start() for p in self.parts], np.zeros(self.inertias.count))
        cost = self._cost(state)
        damping, converged, iteration = 1e-6, False, 0
        while iteration < self.settings.iterations and not converged and damping < MOST_DAMPING:
            progress("dynamics", iteration / self.settings.iterations)
            iteration += 1
            system = [p.linearized(c, self._model(state.phi), self.parameters) for p, c in self._pairs(state)]
            while damping < MOST_DAMPING:
                tried = self._stepped(state, system, damping)
                tried_cost = self._cost(tried)
                if tried_cost < cost:
                    break
                damping = max(damping * 100, 1e-3)
            if damping >= MOST_DAMPING:
                break
            converged = cost - tried_cost < self.settings.tolerance * cost
            state, cost, damping = tried, tried_cost, damping / 10
            del system  # before the next one is built
        progress("dynamics", 1.0)
        fitted = self.inertias.skeleton_at(state.phi) if self.parameters else self.inertias.skeleton
        return TrajectoryFit(
            skeleton=fitted,
            motions=tuple(p.motion(c) for p, c in self._pairs(state)),
            phi=state.phi,
            inertia_names=self.inertias.names,
            iterations=iteration,
            converged=converged,
            notes=() if converged else (f"the trajectory fit did not settle in {iteration} iterations",),
        )

    def _pairs(self, state: _State) -> list[tuple["_Trial", Float[np.ndarray, "coefficients dofs"]]]:
        return list(zip(self.parts, state.coefficients, strict=True))

    def _model(self, phi: Float[np.ndarray, " parameters"]) -> tuple[InertiaParameters, np.ndarray]:
        return self.inertias, phi

    def _cost(self, state: _State) -> float:
        model = self._model(state.phi)
        return sum(p.cost(c, model) for p, c in self._pairs(state)) + self._prior(state.phi)[0]

    def _prior(
        self, phi: Float[np.ndarray, " parameters"]
    ) -> tuple[float, Float[np.ndarray, " parameters"], Float[np.ndarray, "parameters parameters"]]:
        """Cost, gradient and curvature of the priors of φ and of the body's total mass."""
        J, D = self.inertias.pseudo_inertias(phi), self.inertias.derivatives(phi)
        moved = J[self.inertias.group >= 0, 3, 3].sum()
        kept = sum(
            b.mass for b, g in zip(self.inertias.skeleton.bodies, self.inertias.group, strict=True) if g < 0
        )
        excess = moved + kept - self.entered_mass
        slope = np.zeros(len(phi))
        for b, g in enumerate(self.inertias.group):
            if g >= 0:
                slope[10 * g : 10 * g + 10] += D[b, :, 3, 3]
        precision = (
            self.settings.body_mass_std * self.entered_mass
        ) ** -2 * self.settings.inertia_prior_weight
        cost = float(self.prior_precision @ phi**2 + precision * excess**2)
        gradient = self.prior_precision * phi + precision * excess * slope
        return cost, gradient, np.diag(self.prior_precision) + precision * np.outer(slope, slope)

    def _stepped(self, state: _State, system: list["_System"], damping: float) -> _State:
        """One damped step: eliminate each trial's coefficients, solve the border, substitute back."""
        _, gradient, corner = self._prior(state.phi)
        count = self.parameters
        gradient, corner = gradient[:count].copy(), corner[:count, :count].copy()
        eliminated = []
        for part in system:
            factor = part.band.block_tridiagonal(damping).factorized_in_place()
            right = np.concatenate([part.border, part.gradient[:, :, None]], axis=2)
            half = factor.half_solve(part.band.in_blocks(right))
            flat = half.reshape(-1, count + 1)
            corner += part.corner - flat[:, :count].T @ flat[:, :count]
            gradient += part.gradient_corner - flat[:, :count].T @ flat[:, count]
            eliminated.append((factor, half))
        step_phi = -np.linalg.solve(corner, gradient) if count else np.zeros(0)
        coefficients = []
        for (factor, half), part, c in zip(eliminated, system, state.coefficients, strict=True):
            reduced = -(half[:, :, count] + half[:, :, :count] @ step_phi)
            coefficients.append(c + part.band.from_blocks(factor.back_solve(reduced[:, :, None])[:, :, 0]))
        phi = state.phi.copy()
        phi[:count] += step_phi
        return _State(coefficients, phi)


def jerk_level(motion: Motion, settings: TrajectorySettings) -> Float[np.ndarray, " dofs"]:
    """RMS third derivative of each dof in the marker fit below its noise [rad/s³ or m/s³].

    Running jerks ten times as much as walking; a smoothness that fits one would bend the other.
    """
    jerk = motion.low_passed(settings.jerk_cutoff_Hz).derivative(3)
    inner = jerk[len(jerk) // 10 : len(jerk) - len(jerk) // 10]
    own = np.sqrt((inner**2).mean(axis=0))
    return np.maximum(own, settings.least_jerk_share * np.sqrt((own**2).mean()))


@dataclass(frozen=True)
class _System:
    """Gauss-Newton terms of one trial."""

    band: CoefficientBand
    gradient: Float[np.ndarray, "coefficients dofs"]
    border: Float[np.ndarray, "coefficients dofs parameters"]
    corner: Float[np.ndarray, "parameters parameters"]
    gradient_corner: Float[np.ndarray, " parameters"]


class _Trial:
    """One trial's terms."""

    def __init__(self, skeleton: Skeleton, data: TrialData, settings: TrajectorySettings) -> None:
        motion = data.start
        spacing = max(1, round(settings.knot_spacing_s * motion.rate))
        self.basis: SplineBasis = spline_basis(motion.frames, motion.rate, spacing)
        self.data, self.settings = data, settings
        self.per_frame = REFERENCE_RATE_HZ / motion.rate
        self.markers = MarkerTrack(skeleton, data.observed_ground, motion, settings)
        self.residuals = ResidualTrack(data.wrench_ground, data.counts, settings)
        root = root_dofs(skeleton)
        self.pose_precision = np.where(root, 0.0, settings.pose_std_rad**-2)
        self.jerk_weight = settings.smoothness / jerk_level(motion, settings) ** 2

    def start(self) -> Float[np.ndarray, "coefficients dofs"]:
        """The spline nearest to where the search begins."""
        band = CoefficientBand.empty(self.basis, 1)
        band.add_same_frame(np.ones((self.basis.frames, 1, 1)))
        band.add_jerk(np.array([1e-9]))
        initial = self.data.initial or self.data.start
        right = CoefficientBand.gather(self.basis, initial.q, 0)
        factor = band.block_tridiagonal().factorized_in_place()
        half = factor.half_solve(band.in_blocks(right[:, None, :]))
        return band.from_blocks(factor.back_solve(half))[:, 0, :]

    def states(self, coefficients: Float[np.ndarray, "coefficients dofs"]) -> tuple[np.ndarray, ...]:
        """q, q̇, q̈ at the frames."""
        return tuple(self.basis.evaluate(coefficients, order) for order in range(3))

    def motion(self, coefficients: Float[np.ndarray, "coefficients dofs"]) -> Motion:
        """The trajectory at the frames."""
        return replace(self.data.start, q=self.basis.evaluate(coefficients))

    def cost(
        self,
        coefficients: Float[np.ndarray, "coefficients dofs"],
        model: tuple[InertiaParameters, np.ndarray],
    ) -> float:
        """All terms but the priors of φ."""
        q, v, a = self.states(coefficients)
        pull = (self.pose_precision * (q - self.data.start.q) ** 2).sum()
        frames = self.markers.cost(q) + pull + self.residuals.cost(*model, q, v, a)
        return float(self.per_frame * frames + (self.jerk_weight * self._jerk(coefficients)).sum())

    def linearized(
        self,
        coefficients: Float[np.ndarray, "coefficients dofs"],
        model: tuple[InertiaParameters, np.ndarray],
        parameters: int,
    ) -> _System:
        """Gauss-Newton terms."""
        q, v, a = self.states(coefficients)
        band = CoefficientBand.empty(self.basis, q.shape[1])
        marker = self.markers.linearized(q)
        diagonal = np.arange(q.shape[1])
        marker.H[:, diagonal, diagonal] += self.pose_precision
        band.add_same_frame(marker.H, self.per_frame)
        band.add_neighbour_frames(marker.H_previous, self.per_frame)
        frame_gradient = self.per_frame * (marker.g + self.pose_precision * (q - self.data.start.q))
        del marker  # two of the largest arrays; the rest needs room
        gradient = CoefficientBand.gather(self.basis, frame_gradient, 0)
        residual = self.residuals.linearized(*model, q, v, a, with_parameters=parameters > 0)
        rows = np.sqrt(self.per_frame)
        gradient += band.add_residual_rows(
            rows * residual.value, [rows * J for J in (residual.by_q, residual.by_v, residual.by_a)]
        )
        border = band.coupling(
            [rows * J for J in (residual.by_q, residual.by_v, residual.by_a)], rows * residual.by_phi
        )
        flat = rows * residual.by_phi.reshape(residual.value.size, parameters)
        value = rows * residual.value.ravel()
        band.add_jerk(self.jerk_weight)
        gradient += self._jerk_gradient(coefficients)
        return _System(band, gradient, border, flat.T @ flat, flat.T @ value)

    def _jerk(self, c: Float[np.ndarray, "coefficients dofs"]) -> Float[np.ndarray, " dofs"]:
        """∫ (d³q/dt³)² dt of every dof."""
        gram = self.basis.jerk_gram
        return sum(
            (2.0 if k else 1.0) * (gram[: len(c) - k, k, None] * c[: len(c) - k] * c[k:]).sum(axis=0)
            for k in range(gram.shape[1])
        )

    def _jerk_gradient(
        self, c: Float[np.ndarray, "coefficients dofs"]
    ) -> Float[np.ndarray, "coefficients dofs"]:
        gram = self.basis.jerk_gram
        product = gram[:, 0, None] * c
        for k in range(1, gram.shape[1]):
            upper = gram[: len(c) - k, k, None]
            product[: len(c) - k] += upper * c[k:]
            product[k:] += upper * c[: len(c) - k]
        return self.jerk_weight * product
