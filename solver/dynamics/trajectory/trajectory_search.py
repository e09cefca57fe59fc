"""The search of the trajectory fit: steps of Gauss and Newton, damped where a whole one does not help."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from solver.common.notes import Kind, Note, noted
from solver.common.one_thread import one_thread
from solver.common.progress import Progress
from solver.dynamics.trajectory.bordered_system import BorderedFactor, Gradient, SharedChoice, Step
from solver.dynamics.trajectory.terms.term import SharedParameters
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import SharedPriors, State, TrajectorySolver, refuse
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

# A last step with the curvature at hand is tried after a step that gained less than this share of the cost.
NEARLY_THERE = 0.5
FIRST_DAMPING, MOST_DAMPING = 1e-6, 1e8
# A small undamped step that lowers the cost by what its quadratic model predicted, but for this share of the
# tolerance, has arrived: what is left is of the order of that difference. Of a large one, that may be chance.
SMALL_STEP = 10  # tolerances
AS_PREDICTED = 0.1
LAST_STEPS = 2  # with a fit's last factor: it ends five times nearer to the optimum, or more
MOST_FOLLOWING = 6  # steps after an edit with one factor, which costs as much as five of them
TRIES, SHORTER = 4, 0.25  # of such a step, and how long each is against the one before
LAST_DIGITS = 1e-12  # of the cost, which is a sum of many: no step is told by less


@dataclass(frozen=True)
class Border:
    """The fit's quadratic model of φ and x near its end, the trajectories eliminated."""

    curvature: Float[np.ndarray, "shared shared"]  # of half the cost, priors included
    at: SharedParameters
    priors: SharedPriors


@dataclass(frozen=True)
class TrajectoryFit:
    """A trial's trajectory and the skeleton's inertias that go with it."""

    skeleton: Skeleton
    motions: tuple[Motion, ...]
    splines: tuple[Float[np.ndarray, "coefficients dofs"], ...]  # coefficients of the motions
    phi: Float[np.ndarray, " parameters"]
    iterations: int
    # Where one more step would take φ, were all frames' errors independent and of the fit's own size
    asked_phi: Float[np.ndarray, " parameters"]
    converged: bool = False
    notes: tuple[Note, ...] = ()
    costs: tuple[float, ...] = ()  # where the search began, and after each iteration
    extra: Float[np.ndarray, " extra"] = field(default_factory=lambda: np.zeros(0))  # x
    # Of x, with trajectories and inertias free: from the border after all trials' bands are eliminated. The
    # weights take frames as independent, so it is rather too small.
    extra_covariance: Float[np.ndarray, "extra extra"] = field(default_factory=lambda: np.zeros((0, 0)))
    border: Border | None = None  # None: φ stayed


def searched(
    solver: TrajectorySolver,
    progress: Progress,
    phi: Float[np.ndarray, " parameters"] | None,
    *,
    edited: bool = False,
) -> TrajectoryFit:
    """From where the trials' data begin to where a step gains no more.

    Args:
        solver: of the trials.
        progress: told the fraction done; may raise `Cancelled`.
        phi: inertia parameters where the search begins; None: the nominal ones.
        edited: the data begin where a fit ended, and forces on a few frames have changed since. What that
            gains decides, which may be less than the tolerance of the whole cost and hundreds of newtons on a
            frame: the motion follows the edit to within the tolerance, the cost to its square.
    """
    state = solver.begun(phi)
    damping, converged, iteration = FIRST_DAMPING, False, 0
    costs: list[float] = []
    asked, border = state.shared.phi, None
    while iteration < solver.settings.iterations and not converged and damping < MOST_DAMPING:
        progress("dynamics", iteration / solver.settings.iterations)
        iteration += 1
        while damping < MOST_DAMPING:
            system = solver.linearized(state)
            gradient = solver.gradient_of(state, system)
            cost = gradient.cost
            factor = solver.factorized(state, system, damping)
            step = factor.step(gradient)
            tried = solver.stepped(state, step)
            tried_cost = solver.cost(tried)
            arrived = damping <= FIRST_DAMPING and step.predicted < solver.settings.tolerance * cost
            if tried_cost < cost or arrived:
                break
            damping = max(damping * 100, 1e-3)
            del system, factor  # before the next ones are built
        if damping >= MOST_DAMPING:
            break
        if arrived and tried_cost >= cost:
            tried, tried_cost = state, cost
        if state.shared.free_inertias:
            border = Border(factor.corner, state.shared, solver.shared_priors)
        costs += [tried_cost] if costs else [cost, tried_cost]
        gained, least = cost - tried_cost, solver.settings.tolerance * cost
        undamped = damping <= FIRST_DAMPING
        small = undamped and gained < SMALL_STEP * least
        as_predicted = small and abs(gained - step.predicted) < AS_PREDICTED * least
        converged = not edited and (gained < least or as_predicted or arrived)
        left, state, cost, damping = state, tried, tried_cost, damping / 10
        if (undamped or edited) and not converged and gained < NEARLY_THERE * cost:
            if edited:
                least = solver.settings.tolerance**2 * (costs[0] - cost)
            left, gradient, state, converged = _settled(
                solver,
                state,
                factor,
                least=max(least, LAST_DIGITS * cost),
                following=MOST_FOLLOWING if edited else 0,
            )
            converged = converged and undamped
        if converged and not edited:
            left, gradient, state, _ = _settled(solver, state, factor, least=0.0, following=LAST_STEPS)
        if converged:
            asked = state.shared.phi if solver.caution == 1.0 else _asked(solver, left, gradient, factor)
        del system, factor
    progress("dynamics", 1.0)
    unsettled = noted(Kind.SOLVE, f"the trajectory fit did not settle in {iteration} iterations")
    corner = np.zeros((0, 0))
    if len(state.shared.x):
        corner = solver.factorized(state, solver.linearized(state)).corner
    return replace(
        _fit_at(solver, state, corner, iterations=iteration),
        converged=converged,
        notes=() if converged else unsettled,
        costs=tuple(float(c) for c in costs),
        asked_phi=asked,
        border=border,
    )


def _fit_at(
    solver: TrajectorySolver, state: State, corner: Float[np.ndarray, "shared shared"], *, iterations: int
) -> TrajectoryFit:
    return TrajectoryFit(
        skeleton=state.shared.skeleton if state.shared.free_inertias else solver.inertias.skeleton,
        motions=tuple(part.motion(at) for part, at in solver.at(state)),
        splines=tuple(state.coefficients),
        phi=state.shared.phi,
        iterations=iterations,
        asked_phi=state.shared.phi,
        extra=state.shared.x,
        extra_covariance=extra_covariance(state.shared, corner),
    )


def _settled(
    solver: TrajectorySolver, state: State, factor: BorderedFactor, *, least: float, following: int
) -> tuple[State, Gradient, State, bool]:
    """Where steps with the curvature at hand lead, and whether the last of them was the last one.

    It is if all that is left to gain is less than asked for, by the gradient there and that curvature. What
    the gradients tell of another curvature on the way corrects it (L-BFGS): that of frames far from their
    force is much overrated, as their robust weights are held.

    Args:
        solver: of the trials.
        state: where they begin.
        factor: of the curvature.
        least: what may be left to gain.
        following: how many steps may come before the last one.

    Returns:
        Where the last step began, and the gradient there; where it ended; whether it was the last one.
    """
    gradient, learnt = solver.gradient(state), list[_Learnt]()
    while True:
        step = _corrected(factor, gradient, learnt)
        if step.predicted < least:
            tried = solver.stepped(state, step)
            return state, gradient, tried if solver.cost(tried) < gradient.cost else state, True
        if len(learnt) == following:
            return state, gradient, state, False
        for _ in range(TRIES):
            tried = solver.stepped(state, step)
            slope = solver.gradient(tried)
            if slope.cost < gradient.cost:
                break
            shorter = tuple(SHORTER * part for part in step.coefficients)
            step = replace(step, coefficients=shorter, shared=SHORTER * step.shared)
        else:
            return state, gradient, state, False
        learnt.append(_Learnt(_flat(step), _flat(slope) - _flat(gradient)))
        state, gradient = tried, slope


@dataclass(frozen=True)
class _Learnt:
    """Of the curvature: by how much a step changed the gradient."""

    step: Float[np.ndarray, " all"]
    change: Float[np.ndarray, " all"]

    @property
    def curvature(self) -> float:
        """Along the step, times its square."""
        return float(self.step @ self.change)


def _corrected(factor: BorderedFactor, gradient: Gradient, learnt: Sequence[_Learnt]) -> Step:
    """The step down a gradient by the factored curvature and what was learnt since (two-loop recursion)."""
    down, curved = _flat(gradient), [one for one in learnt if one.curvature > 0]
    shares = []
    for one in reversed(curved):
        shares.append(float(one.step @ down) / one.curvature)
        down = down - shares[-1] * one.change
    step = _flat(factor.step(_laid_out(down, gradient)))
    for one, share in zip(curved, reversed(shares), strict=True):
        step -= (float(one.change @ step) / one.curvature + share) * one.step
    along = _laid_out(step, gradient)
    return Step(along.coefficients, along.shared, -float(_flat(gradient) @ step))


def _flat(of: Gradient | Step) -> Float[np.ndarray, " all"]:
    return np.concatenate([*(part.ravel() for part in of.coefficients), of.shared])


def _laid_out(flat: Float[np.ndarray, " all"], like: Gradient) -> Gradient:
    """As trials' coefficients and shared parameters again."""
    *parts, shared = np.split(flat, np.cumsum([part.size for part in like.coefficients]))
    shapes = (part.shape for part in like.coefficients)
    coefficients = tuple(part.reshape(s) for part, s in zip(parts, shapes, strict=True))
    return replace(like, coefficients=coefficients, shared=shared)


def _asked(
    solver: TrajectorySolver, state: State, gradient: Gradient, factor: BorderedFactor
) -> Float[np.ndarray, " parameters"]:
    """φ where the last step would have led with the inertias' prior as it is without caution.

    Args:
        solver: of the trials.
        state: that the last step began at.
        gradient: there.
        factor: that it was taken with.
    """
    cautious = solver.priors[0]
    choice = SharedChoice(
        np.ones(state.shared.count, dtype=bool),
        solver.uncautious.curvature(state.shared) - cautious.curvature(state.shared),
        solver.uncautious.gradient(state.shared) - cautious.gradient(state.shared),
    )
    (step,) = factor.steps(gradient, [choice])
    return state.shared.moved(step.shared).phi


def extra_covariance(
    at: SharedParameters, corner: Float[np.ndarray, "shared shared"]
) -> Float[np.ndarray, "extra extra"]:
    """Of x: by the inverse of the border from which all bands are eliminated, which no x need not have."""
    return np.linalg.inv(corner)[at.free_inertias :, at.free_inertias :] if len(at.x) else np.zeros((0, 0))


def take_steps(
    skeleton: Skeleton,
    trials: Sequence[TrialData],
    settings: TrajectorySettings,
    count: int,
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters,
) -> TrajectoryFit:
    """Steps of the fit from near its end, until one arrives, within the square of its gain, in the tolerance.

    Args:
        skeleton: scaled, with the entered mass.
        trials: as for the fit.
        settings: weights.
        count: of the steps, at least; one or more.
        phi: inertia parameters where they begin; None: the nominal ones.
        extra: of the trials' extra columns.

    Raises:
        FitError: as the fit.
    """
    refuse(trials, extra)
    with one_thread():
        solver = TrajectorySolver(skeleton, trials, settings, extra)
        state, taken, gained = solver.begun(phi), 0, 1.0
        while taken < count or (gained**2 > settings.tolerance and taken < settings.iterations):
            system = solver.linearized(state)
            gradient = solver.gradient_of(state, system)
            factor = solver.factorized(state, system)
            step = factor.step(gradient)
            state, taken, gained = solver.stepped(state, step), taken + 1, step.predicted / gradient.cost
            corner = factor.corner
            del system, factor  # before the next ones are built
        return _fit_at(solver, state, corner, iterations=taken)
