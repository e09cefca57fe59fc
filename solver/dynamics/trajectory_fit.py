"""The trajectory fit (eq. kitchen_sink_2): one spline through all frames, markers and F = ma together.

min over spline coefficients c and shared parameters φ of

    Σ_t Σ_m ρ(‖e_tm‖²)/σ_m²  +  Σ_t Σ_m ‖e_tm − e_(t−1)m‖²/σ_d²  +  Σ_{t ∉ U} ‖r_t(c, φ)‖²/σ_r²
      +  Σ w ∫ (d³q/dt³)² dt  +  pull to the marker fit  +  priors(φ),

e the model markers less the measured ones, r the root's residual wrench. Gauss-Newton with Levenberg's
damping; time's band is a block-tridiagonal matrix, φ its border. Frames of U have no force term and are held
by markers and smoothness; their state still binds the frames around them.

The border is open to whatever else may act: r = demanded − measured − extra − columns x, with x shared by all
trials and N(0, prior_std²) before the data.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float
from threadpoolctl import threadpool_limits

from solver.dynamics.inertia_parameters import inertia_parameters, prior_std
from solver.dynamics.spline_band import CoefficientBand, nearest_spline
from solver.dynamics.spline_basis import SplineBasis, spline_basis
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory_terms import MarkerTrack, ResidualModel, ResidualTrack
from solver.errors import FitError
from solver.kinematics.frame_solver import root_dofs
from solver.kinematics.motion import Motion
from solver.progress import Progress, silent
from solver.skeleton.skeleton import Skeleton

REFERENCE_RATE_HZ = 100.0  # the weights of single frames are stated for it
FIRST_DAMPING, MOST_DAMPING = 1e-6, 1e8
# An undamped step that lowers the cost by what its quadratic model foretold, but for this share of the
# tolerance, has arrived: what is left is of the order of that difference.
AS_FORETOLD = 0.1


@dataclass(frozen=True)
class TrialData:
    """What one trial gives to the fit; everything at the markers' frames."""

    observed_ground: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen; the skeleton's markers
    wrench_ground: Float[np.ndarray, "frames 6"]  # [N, N·m about the ground origin] of all feet together
    counts: Bool[np.ndarray, " frames"]  # False on frames of U
    start: Motion  # the marker fit
    initial: Motion | None = None  # where the search begins; None: at the marker fit
    spline: Float[np.ndarray, "coefficients dofs"] | None = None  # of an earlier fit: begin there instead
    extra_wrench_ground: Float[np.ndarray, "frames 6"] | None = None  # acts beside the feet's; None: nothing
    extra_columns_ground: Float[np.ndarray, "frames 6 extra"] | None = None  # likewise per x; None: zero


@dataclass(frozen=True)
class ExtraParameters:
    """x of the trials' extra columns: scatter before the data, and where the search begins."""

    prior_std: Float[np.ndarray, " extra"]
    start: Float[np.ndarray, " extra"]

    @classmethod
    def none(cls) -> "ExtraParameters":
        """Nothing extra."""
        return cls(np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class TrajectoryFit:
    """A trial's trajectory and the skeleton's inertias that go with it."""

    skeleton: Skeleton
    motions: tuple[Motion, ...]
    splines: tuple[Float[np.ndarray, "coefficients dofs"], ...]  # coefficients of the motions
    phi: Float[np.ndarray, " parameters"]
    inertia_names: tuple[str, ...]
    iterations: int
    converged: bool
    notes: tuple[str, ...]
    extra: Float[np.ndarray, " extra"] = field(default_factory=lambda: np.zeros(0))  # x
    # Of x, with trajectories and inertias free: from the border after all trials' bands are eliminated. The
    # weights take frames as independent, so it is rather too small.
    extra_covariance: Float[np.ndarray, "extra extra"] = field(default_factory=lambda: np.zeros((0, 0)))


def fit_trajectories(
    skeleton: Skeleton,
    trials: list[TrialData],
    settings: TrajectorySettings,
    progress: Progress = silent,
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters | None = None,
) -> TrajectoryFit:
    """Fit all trials of a subject with one set of inertias.

    Args:
        skeleton: scaled, with the entered mass; its markers are those of the trials' data.
        trials: any number, at any rates.
        settings: weights.
        progress: told the fraction done; may raise `Cancelled`.
        phi: inertia parameters where the search begins, those of an earlier fit; None: the nominal ones.
        extra: of the trials' extra columns; None: they have none.

    Raises:
        FitError: no trial is long enough, or a trial's columns are not as many as extra parameters.
    """
    if not trials or min(len(t.observed_ground) for t in trials) < 2:
        raise FitError("The trajectory fit needs trials of two frames or more.")
    extra = extra or ExtraParameters.none()
    columns = {t.extra_columns_ground.shape[2] for t in trials if t.extra_columns_ground is not None}
    if columns - {len(extra.prior_std)}:
        raise FitError(
            f"Trials have {sorted(columns)} extra columns for {len(extra.prior_std)} extra parameters; each "
            "trial needs one column for each parameter, or none at all."
        )
    with threadpool_limits(1):
        return _Solver(skeleton, trials, settings, extra).run(progress, phi)


@dataclass
class _State:
    coefficients: list[Float[np.ndarray, "coefficients dofs"]]
    phi: Float[np.ndarray, " parameters"]
    x: Float[np.ndarray, " extra"] = field(default_factory=lambda: np.zeros(0))


class _Solver:
    def __init__(
        self,
        skeleton: Skeleton,
        trials: list[TrialData],
        settings: TrajectorySettings,
        extra: ExtraParameters | None = None,
    ) -> None:
        self.settings, self.trials = settings, trials
        self.extra = extra or ExtraParameters.none()
        self.inertias = inertia_parameters(skeleton, settings)
        self.parameters = self.inertias.count if settings.fit_inertias else 0
        self.prior_precision = settings.inertia_prior_weight / prior_std(self.inertias, settings) ** 2
        self.extra_precision = self.extra.prior_std**-2.0
        width = len(self.extra.prior_std)
        self.parts = [_Trial(skeleton, data, settings, width) for data in trials]
        self.entered_mass = skeleton.mass

    def run(self, progress: Progress, phi: Float[np.ndarray, " parameters"] | None) -> TrajectoryFit:
        state = _State(
            [p.start() for p in self.parts],
            np.zeros(self.inertias.count) if phi is None else phi,
            self.extra.start,
        )
        cost = self._cost(state)
        damping, converged, iteration = FIRST_DAMPING, False, 0
        while iteration < self.settings.iterations and not converged and damping < MOST_DAMPING:
            progress("dynamics", iteration / self.settings.iterations)
            iteration += 1
            system = self._linearized(state)
            while damping < MOST_DAMPING:
                tried, foretold = self._stepped(state, system, damping)
                tried_cost = self._cost(tried)
                if tried_cost < cost:
                    break
                damping = max(damping * 100, 1e-3)
            if damping >= MOST_DAMPING:
                break
            gained, least = cost - tried_cost, self.settings.tolerance * cost
            as_foretold = damping <= FIRST_DAMPING and abs(gained - foretold) < AS_FORETOLD * least
            converged = gained < least or as_foretold
            state, cost, damping = tried, tried_cost, damping / 10
            del system  # before the next one is built
        progress("dynamics", 1.0)
        fitted = self.inertias.skeleton_at(state.phi) if self.parameters else self.inertias.skeleton
        return TrajectoryFit(
            skeleton=fitted,
            motions=tuple(p.motion(c) for p, c in self._pairs(state)),
            splines=tuple(state.coefficients),
            phi=state.phi,
            inertia_names=self.inertias.names,
            iterations=iteration,
            converged=converged,
            notes=() if converged else (f"the trajectory fit did not settle in {iteration} iterations",),
            extra=state.x,
            extra_covariance=self._extra_covariance(state),
        )

    def _pairs(self, state: _State) -> list[tuple["_Trial", Float[np.ndarray, "coefficients dofs"]]]:
        return list(zip(self.parts, state.coefficients, strict=True))

    def _linearized(self, state: _State) -> list["_System"]:
        model = self._model(state)
        return [p.linearized(c, model, with_inertias=self.parameters > 0) for p, c in self._pairs(state)]

    def _model(self, state: _State) -> ResidualModel:
        return ResidualModel(self.inertias, state.phi, state.x)

    def _cost(self, state: _State) -> float:
        model = self._model(state)
        return sum(p.cost(c, model) for p, c in self._pairs(state)) + self._prior(state)[0]

    def _prior(
        self, state: _State
    ) -> tuple[float, Float[np.ndarray, " shared"], Float[np.ndarray, "shared shared"]]:
        """Cost, gradient and curvature of the priors of φ, of the body's total mass and of x.

        The latter two by φ, where it is free, and x, one after the other.
        """
        phi, x, count = state.phi, state.x, self.parameters
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
        cost = float(self.prior_precision @ phi**2 + precision * excess**2 + self.extra_precision @ x**2)
        gradient = self.prior_precision * phi + precision * excess * slope
        curvature = np.diag(np.concatenate([self.prior_precision[:count], self.extra_precision]))
        curvature[:count, :count] += precision * np.outer(slope, slope)[:count, :count]
        return cost, np.concatenate([gradient[:count], self.extra_precision * x]), curvature

    def _stepped(self, state: _State, system: list["_System"], damping: float) -> tuple[_State, float]:
        """One damped step, and by how much it lowers the cost if that is quadratic.

        Eliminates each trial's coefficients, solves the border and substitutes back.
        """
        _, gradient, corner = self._prior(state)
        count = len(gradient)
        eliminated, foretold = [], 0.0
        for part in system:
            factor = part.band.block_tridiagonal(damping).factorized_in_place()
            right = part.band.in_blocks(np.concatenate([part.border, part.gradient[:, :, None]], axis=2))
            half = factor.half_solve(right)
            del right  # as large as the half-solved columns
            flat = half.reshape(-1, count + 1)
            corner += part.corner - flat[:, :count].T @ flat[:, :count]
            gradient += part.gradient_corner - flat[:, :count].T @ flat[:, count]
            foretold += float(flat[:, count] @ flat[:, count])
            eliminated.append((factor, half))
        step = -np.linalg.solve(corner, gradient) if count else np.zeros(0)
        foretold -= float(gradient @ step)
        coefficients = []
        for (factor, half), part, c in zip(eliminated, system, state.coefficients, strict=True):
            reduced = -(half[:, :, count] + half[:, :, :count] @ step)
            coefficients.append(c + part.band.from_blocks(factor.back_solve(reduced[:, :, None])[:, :, 0]))
        phi = state.phi.copy()
        phi[: self.parameters] += step[: self.parameters]
        return _State(coefficients, phi, state.x + step[self.parameters :]), foretold

    def _extra_covariance(self, state: _State) -> Float[np.ndarray, "extra extra"]:
        """Of x at the solution: the inverse of the border from which all bands are eliminated."""
        if not len(state.x):
            return np.zeros((0, 0))
        corner = self._prior(state)[2]
        for part in self._linearized(state):
            factor = part.band.block_tridiagonal().factorized_in_place()
            half = factor.half_solve(part.band.in_blocks(part.border)).reshape(-1, len(corner))
            corner += part.corner - half.T @ half
        return np.linalg.inv(corner)[self.parameters :, self.parameters :]


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
    border: Float[np.ndarray, "coefficients dofs shared"]
    corner: Float[np.ndarray, "shared shared"]
    gradient_corner: Float[np.ndarray, " shared"]


class _Trial:
    """One trial's terms."""

    def __init__(
        self, skeleton: Skeleton, data: TrialData, settings: TrajectorySettings, extra: int = 0
    ) -> None:
        motion = data.start
        spacing = max(1, round(settings.knot_spacing_s * motion.rate))
        self.basis: SplineBasis = spline_basis(motion.frames, motion.rate, spacing)
        self.data, self.settings = data, settings
        self.per_frame = REFERENCE_RATE_HZ / motion.rate
        self.markers = MarkerTrack(skeleton, data.observed_ground, motion, settings)
        wrench, columns = data.wrench_ground, data.extra_columns_ground
        if data.extra_wrench_ground is not None:
            wrench = wrench + data.extra_wrench_ground
        if columns is None:
            columns = np.zeros((motion.frames, 6, extra))
        self.residuals = ResidualTrack(wrench, data.counts, settings, columns)
        root = root_dofs(skeleton)
        self.pose_precision = np.where(root, 0.0, settings.pose_std_rad**-2)
        self.jerk_weight = settings.smoothness / jerk_level(motion, settings) ** 2

    def start(self) -> Float[np.ndarray, "coefficients dofs"]:
        """The spline that the search begins with: an earlier fit's, or the one nearest to a motion."""
        if self.data.spline is not None:
            return self.data.spline
        return nearest_spline(self.basis, (self.data.initial or self.data.start).q)

    def states(self, coefficients: Float[np.ndarray, "coefficients dofs"]) -> tuple[np.ndarray, ...]:
        """q, q̇, q̈ at the frames."""
        return tuple(self.basis.evaluate(coefficients, order) for order in range(3))

    def motion(self, coefficients: Float[np.ndarray, "coefficients dofs"]) -> Motion:
        """The trajectory at the frames."""
        return replace(self.data.start, q=self.basis.evaluate(coefficients))

    def cost(self, coefficients: Float[np.ndarray, "coefficients dofs"], model: ResidualModel) -> float:
        """All terms but the priors of φ and x."""
        q, v, a = self.states(coefficients)
        pull = (self.pose_precision * (q - self.data.start.q) ** 2).sum()
        frames = self.markers.cost(q) + pull + self.residuals.cost(model, q, v, a)
        jerk = (coefficients * self.basis.jerk_product(coefficients)).sum(axis=0)
        return float(self.per_frame * frames + (self.jerk_weight * jerk).sum())

    def linearized(
        self,
        coefficients: Float[np.ndarray, "coefficients dofs"],
        model: ResidualModel,
        *,
        with_inertias: bool,
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
        residual = self.residuals.linearized(model, q, v, a, with_inertias=with_inertias)
        rows = np.sqrt(self.per_frame)
        gradient += band.add_residual_rows(
            rows * residual.value, [rows * J for J in (residual.by_q, residual.by_v, residual.by_a)]
        )
        border = band.coupling(
            [rows * J for J in (residual.by_q, residual.by_v, residual.by_a)], rows * residual.by_shared
        )
        flat = rows * residual.by_shared.reshape(residual.value.size, -1)
        value = rows * residual.value.ravel()
        band.add_jerk(self.jerk_weight)
        gradient += self.jerk_weight * self.basis.jerk_product(coefficients)
        return _System(band, gradient, border, flat.T @ flat, flat.T @ value)
