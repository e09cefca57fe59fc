"""Prior of the extra columns' parameters: N(0, prior_std²) each."""

import numpy as np
from jaxtyping import Float

from solver.dynamics.terms.shared_parameters import SharedParameters
from solver.dynamics.trial_data import ExtraParameters


class ExtraPrior:
    """Σ_k x_k²/σ_k²."""

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
