"""What the ground does to a body where no force counts: what its motion demands, and nothing in flight.

A marker fit's accelerations are noise above a few hertz, so its momentum is smoothed as a low-pass of third
order would. The ground only pushes. Where the smooth momentum would have it pull, the body flies: force and
moment about the centre of mass are zero there, and the smoothing is done again with that known. In a run the
impulse that a filter smears into flight then goes back to where a foot stands.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import make_interp_spline
from scipy.linalg import solveh_banded

from solver.dynamics.root_wrench import about_point

PASSES = (
    2  # the second one knows where the body flies; a third takes stance for flight: a run errs by 15 % more
)
FLIGHT_WEIGHT_S2 = 10.0  # [s²] of a force in flight against a momentum off; 1 to 1000 differ by 3 %
ORDER = 3  # of the differences that are kept small, as of the shared low-pass
FEWEST_FRAMES = 8  # below it a trial has no accelerations


@dataclass(frozen=True)
class UnmeasuredForces:
    """Predicted from the motion alone."""

    wrench_ground: Float[np.ndarray, "frames 6"]  # of all feet [N, N·m about the ground origin]
    flies: Bool[np.ndarray, " frames"]  # nothing touches the ground; the wrench is zero


def unmeasured_forces(
    demand_ground: Float[np.ndarray, "frames 6"],
    com_ground: Float[np.ndarray, "frames 3"],
    rate: float,
    cutoff_Hz: float,
) -> UnmeasuredForces:
    """The wrench that the ground exerts on all feet together.

    Args:
        demand_ground: external wrench that the motion demands, hardly filtered [N, N·m about the ground
            origin].
        com_ground: of the whole body [m].
        rate: [Hz].
        cutoff_Hz: where the smoothing lets half pass.
    """
    frames = len(demand_ground)
    flies = np.zeros(frames, dtype=bool)
    demand = about_point(demand_ground, com_ground)
    if frames < FEWEST_FRAMES:
        return UnmeasuredForces(demand_ground, flies)
    times = np.arange(frames) / rate
    momentum = make_interp_spline(times, demand, k=3).antiderivative()(times)
    for again in range(PASSES):
        smooth = _smoothed(momentum, flies, rate, cutoff_Hz)
        wrench = make_interp_spline(times, smooth, k=3).derivative()(times)
        if again < PASSES - 1:
            flies = wrench[:, 1] < 0
    wrench[flies] = 0.0
    return UnmeasuredForces(about_point(wrench, -com_ground), flies)


def _smoothed(
    momentum: Float[np.ndarray, "frames 6"], flies: Bool[np.ndarray, " frames"], rate: float, cutoff_Hz: float
) -> Float[np.ndarray, "frames 6"]:
    """Nearest to the momentum with small third differences, and none of the first order in flight."""
    frames = len(momentum)
    banded = np.zeros((ORDER + 1, frames))
    banded[-1] = 1.0
    bend = (rate / (2 * np.pi * cutoff_Hz)) ** (2 * ORDER)
    held = FLIGHT_WEIGHT_S2 * rate**2 * (flies[1:] & flies[:-1])
    for coefficients, weights in (
        (np.array([-1.0, 3.0, -3.0, 1.0]), np.full(frames - ORDER, bend)),
        (np.array([-1.0, 1.0]), held),
    ):
        reach, rows = len(coefficients), len(weights)
        for i in range(reach):
            for j in range(i, reach):
                product = coefficients[i] * coefficients[j] * weights
                banded[ORDER - (j - i), j : j + rows] += product
    return solveh_banded(banded, momentum)
