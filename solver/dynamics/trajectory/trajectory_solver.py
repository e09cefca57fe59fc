"""The trajectory fit's objective and its Gauss-Newton system: terms of trials, priors of what they share."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.common.errors import FitError
from solver.dynamics.inertia_parameters import InertiaParameters, inertia_parameters
from solver.dynamics.trajectory.bordered_system import (
    BorderedFactor,
    Gradient,
    Step,
    TrialGradient,
    TrialSystem,
)
from solver.dynamics.trajectory.marker_error_levels import marker_error_levels
from solver.dynamics.trajectory.spline_band import nearest_spline
from solver.dynamics.trajectory.spline_basis import SplineBasis, spline_basis
from solver.dynamics.trajectory.terms.markers import Markers
from solver.dynamics.trajectory.terms.priors import (
    ExtraPrior,
    HeldEnds,
    InertiaPrior,
    PosePull,
    Smoothness,
    jerk_level,
    pull_precision,
)
from solver.dynamics.trajectory.terms.root_residual import RootResidual
from solver.dynamics.trajectory.terms.term import SharedParameters, SharedTerm, Term, TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData, TrialLevels
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

# [s] of known forces teach what they can; beyond, the weight grows with time, as errors of the model repeat
# in every stride: 100 s of walking would else make shanks' inertias 2.3 times what they are
INERTIA_LESSON_S = 5.0


def trial_levels(
    kinematics: ForwardKinematics,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    start: Motion,
    settings: TrajectorySettings,
) -> TrialLevels:
    """Levels of one trial.

    Args:
        kinematics: of the skeleton whose markers were observed.
        observed_ground: NaN where unseen [m].
        start: the marker fit.
        settings: least levels, and how far the motion may leave the marker fit.
    """
    return TrialLevels(
        marker_error_levels(kinematics, observed_ground, start, settings),
        pull_precision(kinematics.skeleton, observed_ground, settings),
        jerk_level(start),
    )


def knot_spacing(motion: Motion, settings: TrajectorySettings) -> int:
    """Of a trial's splines [frames]."""
    return max(1, round(settings.knot_spacing_s * motion.rate))


def basis_for(motion: Motion, settings: TrajectorySettings) -> SplineBasis:
    """Of a trial's splines."""
    return spline_basis(motion.frames, motion.rate, knot_spacing(motion, settings))


class TrialCost:
    """What one trial adds to the cost of the trajectory fit, by its spline and the shared parameters."""

    def __init__(
        self, skeleton: Skeleton, data: TrialData, settings: TrajectorySettings, extra: int = 0
    ) -> None:
        motion = data.start
        self.data, self.kinematics = data, ForwardKinematics(skeleton)
        self.basis: SplineBasis = basis_for(motion, settings)
        self.residual = RootResidual(data, settings, extra)
        levels = data.levels or trial_levels(self.kinematics, data.observed_ground, motion, settings)
        self.without_forces: tuple[Term, ...] = (
            Markers(self.kinematics, data.observed_ground, motion, settings, levels.marker_errors),
            PosePull(motion, levels.pull),
            Smoothness(levels.jerk, settings),
        )
        before, after = data.held_ends
        if before or after:
            assert data.spline is not None
            self.without_forces += (HeldEnds(data.spline, before=before, after=after),)

    @property
    def terms(self) -> tuple[Term, ...]:
        """All."""
        return (*self.without_forces, self.residual)

    def start(self, shared: SharedParameters) -> Float[np.ndarray, "coefficients columns"]:
        """The spline that the search begins with: an earlier fit's, or the one nearest to a motion.

        Args:
            shared: parameters that it begins with; where there are two places to begin, they decide.
        """
        data = self.data
        begun = data.spline
        if begun is None:
            begun = nearest_spline(self.basis, (data.initial or data.start).q)
        if data.other_start is None:
            return begun
        other = nearest_spline(self.basis, data.other_start.q)
        first, second = (self.cost(self.point(spline, shared)) for spline in (begun, other))
        return other if second < first else begun

    def point(
        self, coefficients: Float[np.ndarray, "coefficients columns"], shared: SharedParameters
    ) -> TrialPoint:
        """Where its terms are asked; it holds the trial's poses, so it should not outlive the question."""
        return TrialPoint(self.basis, self.kinematics, coefficients, shared)

    def motion(self, at: TrialPoint) -> Motion:
        """The trajectory at the frames."""
        return replace(self.data.start, q=at.q)

    def cost(self, at: TrialPoint) -> float:
        """All terms but the priors of the shared parameters."""
        return sum(term.cost(at) for term in self.terms)

    def gradient(self, at: TrialPoint) -> TrialGradient:
        """Of half the cost."""
        gradient = TrialGradient.zero(at.coefficients.shape, at.shared.count)
        for term in self.terms:
            term.add_gradient(at, gradient)
        return gradient

    def linearized(self, at: TrialPoint) -> TrialSystem:
        """Gauss-Newton's system."""
        system = TrialSystem.zero(self.basis, at.coefficients.shape[1], at.shared.count)
        for term in self.terms:
            term.add_linearized(at, system)
        return system


def refuse(trials: Sequence[TrialData], extra: ExtraParameters) -> None:
    """Raise what is wrong with the trials.

    Raises:
        FitError: no trial is long enough, or a trial's columns are not as many as extra parameters.
    """
    if not trials or min(len(t.observed_ground) for t in trials) < 2:
        raise FitError("The trajectory fit needs trials of two frames or more.")
    columns = {t.extra_columns_ground.shape[2] for t in trials if t.extra_columns_ground is not None}
    if columns - {len(extra.prior_std)}:
        raise FitError(
            f"Trials have {sorted(columns)} extra columns for {len(extra.prior_std)} extra parameters; each "
            "trial needs one column for each parameter, or none at all."
        )


def prior_weight(trials: Sequence[TrialData], settings: TrajectorySettings) -> float:
    """Of the inertias' prior: as set, and growing with the time of known forces beyond what they can teach.

    Longer recordings average out noise, but repeat what model and markers get wrong in every stride: with the
    weight of a short one, inertias would follow that at any price.
    """
    known_s = sum(float(t.counts.sum()) / t.start.rate for t in trials)
    return settings.inertia_prior_weight * max(1.0, known_s / INERTIA_LESSON_S)


@dataclass(frozen=True)
class SharedPriors:
    """Of what all trials share: inertias first, then x; and that of the inertias without caution."""

    cautious: InertiaPrior
    of_extra: ExtraPrior
    uncautious: InertiaPrior

    @property
    def priors(self) -> tuple[SharedTerm, ...]:
        """Those that the fit is held by."""
        return self.cautious, self.of_extra


def shared_priors(
    inertias: InertiaParameters,
    trials: Sequence[TrialData],
    settings: TrajectorySettings,
    extra: ExtraParameters,
    caution: float,
    *,
    mass_is_fitted: bool,
) -> SharedPriors:
    """As heavy as the trials' known forces make them; arguments as of the fit."""
    plain = prior_weight(trials, settings)
    cautious = InertiaPrior(inertias, caution * plain, settings, caution * plain if mass_is_fitted else plain)
    return SharedPriors(cautious, ExtraPrior(extra), InertiaPrior(inertias, plain, settings))


@dataclass(frozen=True, eq=False)
class State:
    """Where a search is."""

    coefficients: list[Float[np.ndarray, "coefficients columns"]]  # by trials
    shared: SharedParameters


class TrajectorySolver:
    """Gauss-Newton's system of all trials at a state, and where its steps lead."""

    def __init__(
        self,
        skeleton: Skeleton,
        trials: Sequence[TrialData],
        settings: TrajectorySettings,
        extra: ExtraParameters | None = None,
        caution: float = 1.0,
        *,
        mass_is_fitted: bool = False,
    ) -> None:
        self.settings, self.extra = settings, extra or ExtraParameters.none()
        self.caution = caution
        self.inertias = inertia_parameters(skeleton)
        width = len(self.extra.prior_std)
        self.parts = [TrialCost(skeleton, data, settings, width) for data in trials]
        self.shared_priors = shared_priors(
            self.inertias, trials, settings, self.extra, caution, mass_is_fitted=mass_is_fitted
        )
        self.uncautious, self.priors = self.shared_priors.uncautious, self.shared_priors.priors

    def begun(self, phi: Float[np.ndarray, " parameters"] | None) -> State:
        """Where a search begins; with nominal inertias, unless an earlier fit has some."""
        shared = self.shared(np.zeros(self.inertias.count) if phi is None else phi, self.extra.start)
        return State([p.start(shared) for p in self.parts], shared)

    def shared(
        self, phi: Float[np.ndarray, " parameters"], x: Float[np.ndarray, " extra"]
    ) -> SharedParameters:
        """Inertia parameters and x as one vector."""
        return SharedParameters(self.inertias, phi, x, self.settings.fit_inertias)

    def at(self, state: State) -> Iterator[tuple[TrialCost, TrialPoint]]:
        """Each trial where it is; the poses of one are gone before those of the next are made."""
        for part, coefficients in zip(self.parts, state.coefficients, strict=True):
            yield part, part.point(coefficients, state.shared)

    def linearized(self, state: State) -> list[TrialSystem]:
        """Of each trial, the priors left out."""
        return [part.linearized(at) for part, at in self.at(state)]

    def factorized(self, state: State, system: list[TrialSystem], damping: float = 0.0) -> BorderedFactor:
        """With the priors; in the place of the trials' systems, which are gone afterwards."""
        size = state.shared.count
        curvature = sum((p.curvature(state.shared) for p in self.priors), np.zeros((size, size)))
        return BorderedFactor(system, curvature, damping)

    def gradient_of(self, state: State, system: list[TrialSystem]) -> Gradient:
        """Of half the cost, by systems that were made at this state."""
        return self.whole_gradient(state, [part.gradient for part in system])

    def gradient(self, state: State) -> Gradient:
        """The same without the curvature, at a fraction of its cost."""
        return self.whole_gradient(state, [part.gradient(at) for part, at in self.at(state)])

    def whole_gradient(self, state: State, trials: list[TrialGradient]) -> Gradient:
        """Of half the cost, by those of the trials."""
        shared = sum((p.gradient(state.shared) for p in self.priors), np.zeros(state.shared.count))
        shared = sum((part.shared for part in trials), shared)
        cost = sum(part.cost for part in trials) + self.prior_cost(state)
        return Gradient(tuple(part.coefficients for part in trials), shared, cost)

    def stepped(self, state: State, step: Step) -> State:
        """Where a step leads."""
        coefficients = [c + s for c, s in zip(state.coefficients, step.coefficients, strict=True)]
        return State(coefficients, state.shared.moved(step.shared))

    def cost(self, state: State) -> float:
        """Of trials and priors."""
        return sum(part.cost(at) for part, at in self.at(state)) + self.prior_cost(state)

    def prior_cost(self, state: State) -> float:
        """Of what the shared parameters are held by."""
        return sum(prior.cost(state.shared) for prior in self.priors)
