"""How smooth a trajectory is before anything is seen of it, and the smoothness that its markers speak for.

One weight of the jerk does not suit a heel strike and a slow squat: where the motion has little jerk of its
own, most of what a marker fit shows of it is noise, and too loose a prior would take that for motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cholesky_banded

from solver.dynamics.trajectory.spline_band import CoefficientBand, in_blocks
from solver.dynamics.trajectory.spline_basis import SplineBasis

JERKLESS = 3  # motions of a dof that have no jerk: at rest, at even speed, evenly accelerated


@dataclass(frozen=True, eq=False)
class TrajectoryPrior:
    """What is known of the trajectory before the markers: near inverse kinematics, of little jerk."""

    basis: SplineBasis
    pull: Float[np.ndarray, " dofs"]  # towards inverse kinematics, of each frame [1/rad²]; 0: none
    jerk_precision: Float[np.ndarray, " dofs"]  # times the smoothness [s⁶/rad², s⁶/m²]

    def half_log_det(self, smoothness: float) -> float:
        """Half the log determinant of the precision; of dofs without pull, but for a constant."""
        free = self.pull == 0
        jerk_weight = smoothness * self.jerk_precision
        log = 0.5 * (self.basis.coefficients - JERKLESS) * float(np.log(jerk_weight[free]).sum())
        values, jerk = self.basis.value_gram.T, self.basis.jerk_gram.T  # (a, a + k) at [k, a]
        for p, w in zip(self.pull[~free], jerk_weight[~free], strict=True):
            log += float(np.log(cholesky_banded(p * values + w * jerk, lower=True)[0]).sum())
        return log


def likeliest_smoothness(
    band: CoefficientBand,
    gradient: Float[np.ndarray, "coefficients dofs"],
    c: Float[np.ndarray, "coefficients dofs"],
    prior: TrajectoryPrior,
    choices: Sequence[float],
) -> float:
    """The smoothness under which the markers are most probable, whatever the trajectory.

    With prior precision P(s), posterior precision A(s) and gradient g(s) at c, the log density of the markers
    is, but for what doesn't depend on s, ½ gᵀA⁻¹g − ½ s ∫ jerk² at c − ½ log|A| + ½ log|P|.

    Args:
        band: of the markers and the pull, as it is left.
        gradient: likewise, at c.
        c: where they were linearized.
        prior: with the pull that is in the band.
        choices: ascending; as soon as one is worse than the one before, those beyond are not tried.
    """
    slope = prior.jerk_precision * band.basis.jerk_product(c)
    best, chosen, within = -np.inf, choices[0], 0.0
    for s in choices:
        band.add_jerk((s - within) * prior.jerk_precision)
        within = s
        factor = band.block_tridiagonal().factorized_in_place()
        half = factor.half_solve(in_blocks((gradient + s * slope)[:, :, None]))
        fit = 0.5 * float((half**2).sum() - s * (c * slope).sum())
        log = fit - factor.half_log_det + prior.half_log_det(s)
        if log <= best:
            break
        best, chosen = log, s
    band.add_jerk(-within * prior.jerk_precision)
    return chosen
