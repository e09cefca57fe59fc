"""Standard deviations of a trial, made by hand."""

import numpy as np

from solver.dynamics.dynamics import TrialStd


def made_std(frames, dofs):
    """Of angles 0.01, of speeds 0.02 … powers 0.05; those of torques are unknown on the first frame."""
    of_dofs = [np.full((frames, dofs), 0.01 * k) for k in range(1, 6)]
    of_dofs[3][0] = np.nan
    return TrialStd(*of_dofs, np.full((frames, 3), 0.001))
