"""Velocity and acceleration of sampled coordinates, as the paper differences them."""

import numpy as np
from jaxtyping import Float


def central_differences(
    q: Float[np.ndarray, "frames dofs"], rate: float
) -> tuple[Float[np.ndarray, "frames dofs"], Float[np.ndarray, "frames dofs"]]:
    """(q[t+1] − q[t−1]) / 2Δt and (q[t−1] − 2 q[t] + q[t+1]) / Δt²; ends repeat their neighbours'.

    Args:
        q: three frames or more [rad or m].
        rate: [Hz].
    """
    velocity, acceleration = np.empty_like(q), np.empty_like(q)
    velocity[1:-1] = (q[2:] - q[:-2]) * (rate / 2)
    acceleration[1:-1] = (q[:-2] - 2 * q[1:-1] + q[2:]) * rate**2
    for end, beside in ((0, 1), (-1, -2)):
        velocity[end], acceleration[end] = velocity[beside], acceleration[beside]
    return velocity, acceleration
