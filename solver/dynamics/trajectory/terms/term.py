"""What a term of the trajectory fit gives: its cost, its gradient, and its share of the Gauss-Newton system.

The fit knows terms by these protocols alone. Two kinds: of one trial, by its spline's coefficients and the
shared parameters; and of the shared parameters alone, which are priors. Gradients and systems are of half the
cost, so that rows R with derivatives J give Jᵀ R and Jᵀ J.
"""

from typing import Protocol

import numpy as np
from jaxtyping import Float

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.terms.shared_parameters import SharedParameters
from solver.dynamics.trajectory.terms.trial_point import TrialPoint


class Term(Protocol):
    """A summand of one trial's cost, over all its frames.

    Made once a fit, of the trial's data and the settings; what it holds does not change afterwards. It adds
    to what is handed to it, and leaves alone what other terms have added there.
    """

    def cost(self, at: TrialPoint) -> float:
        """Whole, not half."""
        ...

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """That of half the cost, exactly, at a fraction of the system's price."""
        ...

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """The same gradient, the cost, and Gauss-Newton's matrix, which is positive semidefinite."""
        ...


class SharedTerm(Protocol):
    """A summand of the subject's cost that depends on the shared parameters alone."""

    def cost(self, shared: SharedParameters) -> float:
        """Whole, not half."""
        ...

    def gradient(self, shared: SharedParameters) -> Float[np.ndarray, " shared"]:
        """Of half the cost."""
        ...

    def curvature(self, shared: SharedParameters) -> Float[np.ndarray, "shared shared"]:
        """Gauss-Newton's, of half the cost."""
        ...
