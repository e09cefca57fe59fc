"""What a step of the fit predicts on hidden frames: for several layouts and sets of terms at once.

All begin at the same motion. What markers and smoothness add there is the same for all, and so are the
residual's rows: only which of them take part differs, and the columns that stand beside them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.one_thread import one_thread
from solver.dynamics.trajectory.bordered_system import (
    BorderedFactor,
    Gradient,
    SharedChoice,
    Step,
    TrialSystem,
)
from solver.dynamics.trajectory.spline_band import CoefficientBand
from solver.dynamics.trajectory.terms.root_residual import ResidualHeldOut
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import TrajectorySolver, refuse, shared_priors
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class TrialHeldOut:
    """One trial of a layout."""

    held_out: Bool[np.ndarray, " frames"]  # known frames whose forces take no part
    columns_ground: Float[np.ndarray, "frames 6 extra"]  # made without these


class HeldOutSteps:
    """Steps from one place."""

    def __init__(
        self,
        skeleton: Skeleton,
        trials: Sequence[TrialData],
        settings: TrajectorySettings,
        *,
        phi: Float[np.ndarray, " parameters"] | None = None,
        extra: ExtraParameters,
        mass_is_fitted: bool = False,
    ) -> None:
        """Linearize there.

        Args:
            skeleton: scaled, with the entered mass.
            trials: as for the fit, with all known frames and columns of every kind.
            settings: weights.
            phi: inertia parameters there; None: the nominal ones.
            extra: of the columns; zero where they are not the same in all layouts.
            mass_is_fitted: as for the fit.

        Raises:
            FitError: as the fit.
        """
        refuse(trials, extra)
        with one_thread():
            self.solver = TrajectorySolver(skeleton, trials, settings, extra)
            self.trials, self.mass_is_fitted = trials, mass_is_fitted
            self.state = self.solver.begun(phi)
            self.lasting: list[TrialSystem] = []
            self.residuals: list[ResidualHeldOut] = []
            for part, at in self.solver.at(self.state):
                system = TrialSystem.zero(part.basis, at.coefficients.shape[1], 0)
                for term in part.without_forces:
                    term.add_linearized(at, system)
                self.lasting.append(system)
                self.residuals.append(ResidualHeldOut(part.residual, at))

    def missed(
        self,
        layout: Sequence[TrialHeldOut],
        choices: Sequence[tuple[Bool[np.ndarray, " extra"], float]],
        caution: float = 1.0,
        *,
        is_last: bool = False,
    ) -> list[Float[np.ndarray, "choices hidden 6"]]:
        """Residuals on the hidden frames of each trial: forces [N], moments about the root's centre [N·m].

        Args:
            layout: of the trials.
            choices: of the extra columns, those that are free (the others' x stays), and the weight of the
                inertias' prior in terms of that of the settings.
            caution: of the fit with its inertias, as `inertia_caution` tells it.
            is_last: no other layout is asked about: the band of the markers is taken, not copied.
        """
        steps = self.steps(layout, choices, caution, is_last=is_last)
        shared_steps = np.array([step.shared for step in steps])
        with one_thread():
            return [
                residual.missed(
                    trial.held_out,
                    trial.columns_ground,
                    [step.coefficients[i] for step in steps],
                    shared_steps,
                )
                for i, (residual, trial) in enumerate(zip(self.residuals, layout, strict=True))
            ]

    def steps(
        self,
        layout: Sequence[TrialHeldOut],
        choices: Sequence[tuple[Bool[np.ndarray, " extra"], float]],
        caution: float = 1.0,
        *,
        is_last: bool = False,
    ) -> list[Step]:
        """Where the fit would go without the hidden frames, of each choice; arguments as of `missed`."""
        shared, solver = self.state.shared, self.solver
        priors = shared_priors(
            solver.inertias,
            self.trials,
            solver.settings,
            solver.extra,
            caution,
            mass_is_fitted=self.mass_is_fitted,
        ).priors
        free = [np.concatenate([np.ones(shared.free_inertias, dtype=bool), some]) for some, _ in choices]
        asked = np.flatnonzero(np.any(free, axis=0))
        curvatures = np.array([prior.curvature(shared)[np.ix_(asked, asked)] for prior in priors])
        slopes = np.array([prior.gradient(shared)[asked] for prior in priors])
        of_choices = [  # the first prior is that of the inertias
            SharedChoice(some[asked], (weight - 1) * curvatures[0], (weight - 1) * slopes[0])
            for some, (_, weight) in zip(free, choices, strict=True)
        ]
        with one_thread():
            system = [
                self._seen(lasting, residual, trial, asked, is_last=is_last)
                for lasting, residual, trial in zip(self.lasting, self.residuals, layout, strict=True)
            ]
            by_shared = np.sum([part.gradient.shared for part in system], axis=0) + slopes.sum(axis=0)
            coefficients = tuple(part.gradient.coefficients for part in system)
            gradient = Gradient(coefficients, by_shared, sum(part.gradient.cost for part in system))
            steps = BorderedFactor(system, curvatures.sum(axis=0)).steps(gradient, of_choices)
        whole = np.zeros((len(steps), shared.count))
        whole[:, asked] = [step.shared for step in steps]
        return [replace(step, shared=own) for step, own in zip(steps, whole, strict=True)]

    def _seen(
        self,
        lasting: TrialSystem,
        residual: ResidualHeldOut,
        trial: TrialHeldOut,
        asked: Int[np.ndarray, " asked"],
        *,
        is_last: bool,
    ) -> TrialSystem:
        """With these of the shared parameters, all inertias among them."""
        basis, inertias = lasting.band.basis, self.state.shared.free_inertias
        system = TrialSystem.zero(basis, lasting.gradient.coefficients.shape[1], len(asked))
        system.band = lasting.band if is_last else CoefficientBand(basis, lasting.band.panels.copy())
        system.gradient.coefficients += lasting.gradient.coefficients
        columns = trial.columns_ground[:, :, asked[inertias:] - inertias]
        residual.add_linearized(system, trial.held_out, columns)
        return system
