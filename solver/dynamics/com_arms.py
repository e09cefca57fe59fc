"""The three arms of the paper's ablation: what hiding forces costs, with and without the unobserved frames.

All get the same trial and the frames whose force was hidden from the fit; only the oracle looks at it.
"""

import numpy as np
from jaxtyping import Bool

from solver.dynamics.com_data import ComData
from solver.dynamics.com_mass import MassPrior
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_system import FEWEST_FRAMES
from solver.dynamics.com_trajectory import ComTrajectory, fit_com_trajectory, unchanged
from solver.runs import runs


def oracle(
    data: ComData,
    hidden: Bool[np.ndarray, " frames"],
    settings: ComSettings,
    prior: MassPrior | None = None,
) -> ComTrajectory:
    """One trajectory that sees all recorded forces, the hidden ones too."""
    return fit_com_trajectory(data, settings, prior)


def ours(
    data: ComData, hidden: Bool[np.ndarray, " frames"], settings: ComSettings, prior: MassPrior | None = None
) -> ComTrajectory:
    """One trajectory through all frames, with a free acceleration where the force is hidden."""
    return fit_com_trajectory(data.without(hidden), settings, prior)


def piecewise(
    data: ComData, hidden: Bool[np.ndarray, " frames"], settings: ComSettings, prior: MassPrior | None = None
) -> ComTrajectory:
    """A trajectory for each run of frames with force, on its own; between them the markers' centre of mass.

    Nothing ties one run to the next. μ is the runs' mean by frames. Runs of fewer than three frames stay as
    measured.
    """
    stitched = unchanged(data)
    weighted, frames = 0.0, 0
    for start, end in runs(data.without(hidden).observed):
        if end - start < FEWEST_FRAMES:
            continue
        run = fit_com_trajectory(data.between(start, end), settings, prior)
        stitched.com_ground[start:end] = run.com_ground
        stitched.acceleration_ground[start:end] = run.acceleration_ground
        weighted += run.inverse_mass * (end - start)
        frames += end - start
    return ComTrajectory(
        stitched.com_ground,
        stitched.acceleration_ground,
        inverse_mass=weighted / frames if frames else 0.0,
        mass=None,
        rate=data.rate,
    )


ARMS = {"oracle": oracle, "ours": ours, "piecewise": piecewise}
