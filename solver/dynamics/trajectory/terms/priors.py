"""Priors of what trials share: inertias, and the parameters of extra columns."""

import numpy as np
from jaxtyping import Float

from solver.dynamics.inertia_parameters import InertiaParameters, prior_std
from solver.dynamics.trajectory.terms.shared_parameters import SharedParameters
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import ExtraParameters


class InertiaPrior:
    """What anthropometric tables say of segments, and of the whole body's mass.

    w Σ_k φ_k²/σ_k² + w_m (m(φ) − m⁰)²/σ_m², m the body's mass and m⁰ the skeleton's.
    """

    def __init__(
        self,
        inertias: InertiaParameters,
        weight: float,
        settings: TrajectorySettings,
        mass_weight: float | None = None,
    ) -> None:
        """Of a skeleton.

        Args:
            inertias: about those of the skeleton.
            weight: w.
            settings: σ_k and σ_m.
            mass_weight: w_m; None: w.
        """
        mass_weight = weight if mass_weight is None else mass_weight
        self.entered_mass = inertias.skeleton.mass
        self.precision = weight / prior_std(inertias, settings) ** 2
        self.mass_precision = mass_weight / (settings.body_mass_std * self.entered_mass) ** 2

    def cost(self, shared: SharedParameters) -> float:
        """Both sums."""
        excess = self._excess(shared)
        return float(self.precision @ shared.phi**2 + self.mass_precision * excess**2)

    def gradient(self, shared: SharedParameters) -> Float[np.ndarray, " shared"]:
        """By φ, where it is free."""
        by_phi = self.precision * shared.phi
        by_phi += self.mass_precision * self._excess(shared) * self._mass_by_phi(shared)
        gradient, free = np.zeros(shared.count), shared.free_inertias
        gradient[:free] = by_phi[:free]
        return gradient

    def curvature(self, shared: SharedParameters) -> Float[np.ndarray, "shared shared"]:
        """Of the mass, to first order in φ."""
        slope, free = self._mass_by_phi(shared), shared.free_inertias
        by_phi = np.diag(self.precision) + self.mass_precision * np.outer(slope, slope)
        curvature = np.zeros((shared.count, shared.count))
        curvature[:free, :free] = by_phi[:free, :free]
        return curvature

    def _excess(self, shared: SharedParameters) -> float:
        """Of the body over the entered mass [kg]."""
        inertias = shared.inertias
        moved = shared.pseudo_inertias[inertias.group >= 0, 3, 3].sum()
        kept = sum(b.mass for b, g in zip(inertias.skeleton.bodies, inertias.group, strict=True) if g < 0)
        return float(moved + kept - self.entered_mass)

    def _mass_by_phi(self, shared: SharedParameters) -> Float[np.ndarray, " parameters"]:
        slope = np.zeros(len(shared.phi))
        for body, group in enumerate(shared.inertias.group):
            if group >= 0:
                slope[10 * group : 10 * group + 10] += shared.by_phi[body, :, 3, 3]
        return slope


class ExtraPrior:
    """N(0, σ_k²) for each parameter of extra columns: Σ_k x_k²/σ_k²."""

    def __init__(self, extra: ExtraParameters) -> None:
        self.precision = extra.prior_std**-2.0

    def cost(self, shared: SharedParameters) -> float:
        """The sum."""
        return float(self.precision @ shared.x**2)

    def gradient(self, shared: SharedParameters) -> Float[np.ndarray, " shared"]:
        """By x."""
        return np.concatenate([np.zeros(shared.free_inertias), self.precision * shared.x])

    def curvature(self, shared: SharedParameters) -> Float[np.ndarray, "shared shared"]:
        """Constant."""
        return np.diag(np.concatenate([np.zeros(shared.free_inertias), self.precision]))
