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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float
from threadpoolctl import threadpool_limits

from solver.dynamics.bordered_system import (
    BorderedFactor,
    Gradient,
    SharedChoice,
    Step,
    TrialGradient,
    TrialSystem,
)
from solver.dynamics.inertia_caution import inertia_caution
from solver.dynamics.inertia_parameters import inertia_parameters
from solver.dynamics.terms.extra_prior import ExtraPrior
from solver.dynamics.terms.inertia_prior import InertiaPrior
from solver.dynamics.terms.shared_parameters import SharedParameters
from solver.dynamics.terms.term import SharedTerm
from solver.dynamics.terms.trial_point import TrialPoint
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.dynamics.trial_cost import TrialCost
from solver.dynamics.trial_data import ExtraParameters, TrialData
from solver.errors import FitError
from solver.kinematics.motion import Motion
from solver.progress import Progress, silent
from solver.skeleton.skeleton import Skeleton

# A last step with the curvature at hand is tried after a step that gained less than this share of the cost.
NEARLY_THERE = 0.5
FIRST_DAMPING, MOST_DAMPING = 1e-6, 1e8
# A small undamped step that lowers the cost by what its quadratic model foretold, but for this share of the
# tolerance, has arrived: what is left is of the order of that difference. Of a large one, that may be chance.
SMALL_STEP = 10  # tolerances
AS_FORETOLD = 0.1


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
    costs: tuple[float, ...]  # where the search began, and after each iteration
    # Where one more step would take φ, were all frames' errors independent and of the fit's own size
    asked_phi: Float[np.ndarray, " parameters"]
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
    weighed: bool = False,
) -> TrajectoryFit:
    """Fit all trials of a subject with one set of inertias.

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
    _refuse(trials, extra)
    with threadpool_limits(1):
        caution = inertia_caution(skeleton, trials, settings) if settings.fit_inertias else 1.0
        return _Solver(skeleton, trials, settings, extra, caution, weighed=weighed).run(progress, phi)


@dataclass(frozen=True)
class FirstStep:
    """Where a step of the fit leads, or a few."""

    skeleton: Skeleton
    motions: tuple[Motion, ...]
    extra: Float[np.ndarray, " extra"]
    free: Bool[np.ndarray, " shared"]  # of φ and x
    corner: Float[np.ndarray, "free free"]  # of these, the trajectories eliminated
    splines: tuple[Float[np.ndarray, "coefficients dofs"], ...]  # coefficients of the motions
    phi: Float[np.ndarray, " parameters"]

    @property
    def extra_variance(self) -> Float[np.ndarray, " extra"]:
        """Of x; zero where it is held."""
        variance = np.zeros(len(self.free))
        variance[self.free] = np.diag(np.linalg.inv(self.corner))
        return variance[len(variance) - len(self.extra) :]


def first_steps(
    skeleton: Skeleton,
    trials: list[TrialData],
    settings: TrajectorySettings,
    choices: Sequence[tuple[Bool[np.ndarray, " extra"], float]],
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters,
) -> list[FirstStep]:
    """One step of the fit for each choice of extra columns, at little more than the price of one.

    Args:
        skeleton: scaled, with the entered mass.
        trials: as for the fit.
        settings: weights.
        choices: of the extra columns, those that are free (the others' x stays), and the weight of the
            inertias' prior in terms of that of the settings.
        phi: inertia parameters where it begins; None: the nominal ones.
        extra: of the trials' extra columns.

    Raises:
        FitError: as the fit.
    """
    _refuse(trials, extra)
    with threadpool_limits(1):
        return _Solver(skeleton, trials, settings, extra).first_steps(phi, choices)


def stepped(
    skeleton: Skeleton,
    trials: list[TrialData],
    settings: TrajectorySettings,
    count: int,
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters,
) -> FirstStep:
    """So many steps of the fit from near its end, where each arrives within the square of what the last left.

    Args:
        skeleton: scaled, with the entered mass.
        trials: as for the fit.
        settings: weights.
        count: of the steps, one or more.
        phi: inertia parameters where they begin; None: the nominal ones.
        extra: of the trials' extra columns.

    Raises:
        FitError: as the fit.
    """
    _refuse(trials, extra)
    with threadpool_limits(1):
        return _Solver(skeleton, trials, settings, extra).steps(phi, count)


def _refuse(trials: list[TrialData], extra: ExtraParameters) -> None:
    if not trials or min(len(t.observed_ground) for t in trials) < 2:
        raise FitError("The trajectory fit needs trials of two frames or more.")
    columns = {t.extra_columns_ground.shape[2] for t in trials if t.extra_columns_ground is not None}
    if columns - {len(extra.prior_std)}:
        raise FitError(
            f"Trials have {sorted(columns)} extra columns for {len(extra.prior_std)} extra parameters; each "
            "trial needs one column for each parameter, or none at all."
        )


def prior_weight(trials: list[TrialData], settings: TrajectorySettings) -> float:
    """Of the inertias' prior: as set, and growing with the time of known forces beyond what they can teach.

    Longer recordings average out noise, but repeat what model and markers get wrong in every stride: with the
    weight of a short one, inertias would follow that at any price.
    """
    known_s = sum(float(t.counts.sum()) / t.start.rate for t in trials)
    return settings.inertia_prior_weight * max(1.0, known_s / settings.inertia_lesson_s)


@dataclass(frozen=True, eq=False)
class _State:
    coefficients: list[Float[np.ndarray, "coefficients columns"]]  # by trials
    shared: SharedParameters


class _Solver:
    def __init__(
        self,
        skeleton: Skeleton,
        trials: list[TrialData],
        settings: TrajectorySettings,
        extra: ExtraParameters | None = None,
        caution: float = 1.0,
        *,
        weighed: bool = False,
    ) -> None:
        self.settings, self.extra = settings, extra or ExtraParameters.none()
        self.caution = caution
        self.inertias = inertia_parameters(skeleton, settings)
        width = len(self.extra.prior_std)
        self.parts = [TrialCost(skeleton, data, settings, width) for data in trials]
        plain = prior_weight(trials, settings)
        self.uncautious = InertiaPrior(self.inertias, plain, settings)
        self.priors: tuple[SharedTerm, ...] = (
            InertiaPrior(self.inertias, caution * plain, settings, caution * plain if weighed else plain),
            ExtraPrior(self.extra),
        )

    def first_steps(
        self,
        phi: Float[np.ndarray, " parameters"] | None,
        choices: Sequence[tuple[Bool[np.ndarray, " extra"], float]],
    ) -> list[FirstStep]:
        state = self._begun(phi)
        system = self._linearized(state)
        gradient = self._gradient_of(state, system)
        inertias, prior = np.ones(state.shared.free_inertias, dtype=bool), self.priors[0]
        curvature, slope = prior.curvature(state.shared), prior.gradient(state.shared)
        shared = [
            SharedChoice(np.concatenate([inertias, some]), (weight - 1) * curvature, (weight - 1) * slope)
            for some, weight in choices
        ]
        found = []
        factor = self._factorized(state, system)
        for step, choice in zip(factor.steps(gradient, shared), shared, strict=True):
            there, free = self._stepped(state, step), choice.free
            corner = (factor.corner + choice.curvature)[np.ix_(free, free)]
            found.append(self._arrived(there, free, corner))
        return found

    def steps(self, phi: Float[np.ndarray, " parameters"] | None, count: int) -> FirstStep:
        state = self._begun(phi)
        for _ in range(count):
            system = self._linearized(state)
            gradient = self._gradient_of(state, system)
            factor = self._factorized(state, system)
            state = self._stepped(state, factor.step(gradient))
            corner = factor.corner
            del system, factor  # before the next ones are built
        return self._arrived(state, np.ones(state.shared.count, dtype=bool), corner)

    def _arrived(
        self, state: _State, free: Bool[np.ndarray, " shared"], corner: Float[np.ndarray, "free free"]
    ) -> FirstStep:
        return FirstStep(
            skeleton=self._skeleton(state),
            motions=tuple(part.motion(at) for part, at in self._at(state)),
            extra=state.shared.x,
            free=free,
            corner=corner,
            splines=tuple(state.coefficients),
            phi=state.shared.phi,
        )

    def _skeleton(self, state: _State) -> Skeleton:
        return state.shared.skeleton if state.shared.free_inertias else self.inertias.skeleton

    def _begun(self, phi: Float[np.ndarray, " parameters"] | None) -> _State:
        shared = self._shared(np.zeros(self.inertias.count) if phi is None else phi, self.extra.start)
        return _State([p.start() for p in self.parts], shared)

    def run(self, progress: Progress, phi: Float[np.ndarray, " parameters"] | None) -> TrajectoryFit:
        state = self._begun(phi)
        damping, converged, iteration = FIRST_DAMPING, False, 0
        costs: list[float] = []
        asked = state.shared.phi
        while iteration < self.settings.iterations and not converged and damping < MOST_DAMPING:
            progress("dynamics", iteration / self.settings.iterations)
            iteration += 1
            while damping < MOST_DAMPING:
                system = self._linearized(state)
                cost = sum(part.cost for part in system) + self._prior_cost(state)
                gradient = self._gradient_of(state, system)
                factor = self._factorized(state, system, damping)
                step = factor.step(gradient)
                tried = self._stepped(state, step)
                tried_cost = self._cost(tried)
                if tried_cost < cost:
                    break
                damping = max(damping * 100, 1e-3)
                del system, factor  # before the next ones are built
            if damping >= MOST_DAMPING:
                break
            costs += [tried_cost] if costs else [cost, tried_cost]
            gained, least = cost - tried_cost, self.settings.tolerance * cost
            undamped = damping <= FIRST_DAMPING
            small = undamped and gained < SMALL_STEP * least
            as_foretold = small and abs(gained - step.foretold) < AS_FORETOLD * least
            converged = gained < least or as_foretold
            state, cost, damping = tried, tried_cost, damping / 10
            if undamped and not converged and gained < NEARLY_THERE * cost:
                state, converged = self._settled(state, cost, factor)
            if converged:
                asked = self._asked(state, factor)
            del system, factor
        progress("dynamics", 1.0)
        shared = state.shared
        return TrajectoryFit(
            skeleton=self._skeleton(state),
            motions=tuple(part.motion(at) for part, at in self._at(state)),
            splines=tuple(state.coefficients),
            phi=shared.phi,
            inertia_names=self.inertias.names,
            iterations=iteration,
            converged=converged,
            asked_phi=asked,
            notes=() if converged else (f"the trajectory fit did not settle in {iteration} iterations",),
            costs=tuple(float(c) for c in costs),
            extra=shared.x,
            extra_covariance=self._extra_covariance(state),
        )

    def _shared(
        self, phi: Float[np.ndarray, " parameters"], x: Float[np.ndarray, " extra"]
    ) -> SharedParameters:
        return SharedParameters(self.inertias, phi, x, self.settings.fit_inertias)

    def _at(self, state: _State) -> Iterator[tuple[TrialCost, TrialPoint]]:
        """Each trial where it is; the poses of one are gone before those of the next are made."""
        for part, coefficients in zip(self.parts, state.coefficients, strict=True):
            yield part, part.point(coefficients, state.shared)

    def _linearized(self, state: _State) -> list[TrialSystem]:
        return [part.linearized(at) for part, at in self._at(state)]

    def _factorized(self, state: _State, system: list[TrialSystem], damping: float = 0.0) -> BorderedFactor:
        size = state.shared.count
        curvature = sum((p.curvature(state.shared) for p in self.priors), np.zeros((size, size)))
        return BorderedFactor(system, curvature, damping)

    def _gradient_of(self, state: _State, system: list[TrialSystem]) -> Gradient:
        return self._whole_gradient(state, [part.gradient for part in system])

    def _gradient(self, state: _State) -> Gradient:
        """The same without the curvature, at a fraction of its cost."""
        return self._whole_gradient(state, [part.gradient(at) for part, at in self._at(state)])

    def _whole_gradient(self, state: _State, trials: list[TrialGradient]) -> Gradient:
        shared = sum((p.gradient(state.shared) for p in self.priors), np.zeros(state.shared.count))
        shared = sum((part.shared for part in trials), shared)
        return Gradient(tuple(part.coefficients for part in trials), shared)

    def _stepped(self, state: _State, step: Step) -> _State:
        coefficients = [c + s for c, s in zip(state.coefficients, step.coefficients, strict=True)]
        return _State(coefficients, state.shared.moved(step.shared))

    def _settled(self, state: _State, cost: float, factor: BorderedFactor) -> tuple[_State, bool]:
        """The state after a last step with the curvature at hand, and whether it is the last one.

        It is if all that is left to gain is less than the tolerance, by the gradient here and that curvature.
        """
        step = factor.step(self._gradient(state))
        if step.foretold >= self.settings.tolerance * cost:
            return state, False
        tried = self._stepped(state, step)
        return (tried, True) if self._cost(tried) < cost else (state, False)

    def _asked(self, state: _State, factor: BorderedFactor) -> Float[np.ndarray, " parameters"]:
        """φ after a step with the curvature at hand, the inertias' prior without its caution."""
        if self.caution == 1.0:
            return state.shared.phi
        cautious = self.priors[0]
        choice = SharedChoice(
            np.ones(state.shared.count, dtype=bool),
            self.uncautious.curvature(state.shared) - cautious.curvature(state.shared),
            self.uncautious.gradient(state.shared) - cautious.gradient(state.shared),
        )
        (step,) = factor.steps(self._gradient(state), [choice])
        return state.shared.moved(step.shared).phi

    def _cost(self, state: _State) -> float:
        return sum(part.cost(at) for part, at in self._at(state)) + self._prior_cost(state)

    def _prior_cost(self, state: _State) -> float:
        return sum(prior.cost(state.shared) for prior in self.priors)

    def _extra_covariance(self, state: _State) -> Float[np.ndarray, "extra extra"]:
        """Of x at the solution: the inverse of the border from which all bands are eliminated."""
        if not len(state.shared.x):
            return np.zeros((0, 0))
        corner = self._factorized(state, self._linearized(state)).corner
        free = state.shared.free_inertias
        return np.linalg.inv(corner)[free:, free:]
