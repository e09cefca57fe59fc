"""Least squares over all that shapes the centre-of-mass trajectory but the mass, at a cost linear in frames.

ζ = [z₁, ż₁, μ, z̈_u …] fixes the trajectory by semi-implicit Euler steps: z_{t+1} − 2 z_t + z_{t−1} = Δt² z̈_t.
Written in ζ the matrix is dense, and its columns grow with the square of time. The same trajectories are
spanned by their positions at nodes: all frames whose acceleration is free, and both ends. Between two nodes
every acceleration is known, so the path is the straight line between them plus that acceleration summed
twice, which vanishes at both. A position depends on two nodes and a free acceleration on three. So the normal
matrix is pentadiagonal, and its condition grows neither with the trial's length nor with that of a gap.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

from solver.dynamics.com_data import ComData

REFERENCE_KG = 70.0  # centre and scale of the unknown mass ratio, nothing else
FEWEST_FRAMES = 3  # fewer have no second difference
SOLVES = 2  # of the normal equations: the answer, then its correction


@dataclass(frozen=True)
class Path:
    """A trajectory, and what it leaves of positions, and of accelerations times their penalty."""

    com_ground: Float[np.ndarray, "frames 3"]  # [m]
    acceleration_ground: Float[np.ndarray, "frames 3"]  # [m/s²] z̈ of each frame
    misfit: Float[np.ndarray, "frames 6"]  # [m]


@dataclass(frozen=True)
class Projection:
    """The best trajectory for every mass: a straight line in the mass ratio ρ = REFERENCE_KG · μ."""

    at_one: Path  # for ρ = 1
    slope: Path  # derivative by ρ

    def path(self, ratio: float) -> Path:
        """The best trajectory for that mass ratio."""
        one, slope, beyond = self.at_one, self.slope, ratio - 1.0
        return Path(
            one.com_ground + beyond * slope.com_ground,
            one.acceleration_ground + beyond * slope.acceleration_ground,
            one.misfit + beyond * slope.misfit,
        )

    @property
    def information(self) -> Float[np.ndarray, " frames"]:
        """What each frame tells about ρ: the square of its misfit's slope [m²]."""
        return np.sum(self.slope.misfit**2, axis=1)

    @property
    def best_ratio(self) -> float | None:
        """The ρ of least squares; None where no force shapes the trajectory."""
        information = self.information.sum()
        if not information > 0:
            return None
        return 1.0 - float(np.sum(self.slope.misfit * self.at_one.misfit) / information)


def project(data: ComData, penalty_s2: Float[np.ndarray, " frames"]) -> Projection:
    """Minimize Σ_t |z_t − Z_t|² + Σ_t penalty_t² |z̈_t − known_t|² over all but the mass.

    known is μ f − g on observed frames and zero on the others. At the first and the last frame nothing holds
    z̈ back: there it shows in the initial velocity, or not at all.

    Args:
        data: one trial of at least three frames.
        penalty_s2: weight of a frame's acceleration [s²]; infinite: z̈_t = known_t exactly.
    """
    known = _known_acceleration(data)
    nodes = _nodes(np.isfinite(penalty_s2))
    inner = nodes[1:-1]
    penalty = penalty_s2[inner, None]
    lines, curvature = _lines(nodes, data.frames), _curvature(nodes, data.rate)
    bend = _summed_twice(known, nodes, data.rate)
    bend -= lines @ bend[nodes]
    held_positions = np.hstack([data.com_ground, np.zeros_like(data.com_ground)]) - bend
    held_accelerations = penalty * (known[inner] - _second_difference(bend, data.rate)[inner])
    at_nodes = _least_squares(lines, held_positions, curvature * penalty, held_accelerations)
    z = lines @ at_nodes + bend
    acceleration = known.copy()
    acceleration[inner] = _second_difference(z, data.rate)[inner]
    unexplained = np.zeros_like(z)
    unexplained[inner] = held_accelerations - penalty * (curvature @ at_nodes)
    misfit = np.stack([held_positions - lines @ at_nodes, unexplained], axis=1)
    one, slope = slice(0, 3), slice(3, 6)
    frames = len(z)
    return Projection(
        *(
            Path(z[:, axes], acceleration[:, axes], misfit[:, :, axes].reshape(frames, 6))
            for axes in (one, slope)
        )
    )


def _known_acceleration(data: ComData) -> Float[np.ndarray, "frames 6"]:
    """μ f − g at ρ = 1, and its derivative by ρ; zero where the force is missing."""
    per_ratio = data.force_ground / REFERENCE_KG
    return np.where(data.observed[:, None], np.hstack([per_ratio + data.gravity, per_ratio]), 0.0)


def _second_difference(z: Float[np.ndarray, "frames n"], rate: float) -> Float[np.ndarray, "frames n"]:
    return np.pad(np.diff(z, 2, axis=0) * rate**2, ((1, 1), (0, 0)))


def _summed_twice(
    acceleration: Float[np.ndarray, "frames n"], nodes: Int[np.ndarray, " nodes"], rate: float
) -> Float[np.ndarray, "frames n"]:
    """Positions from rest with that acceleration on all frames but the nodes."""
    steps = acceleration / rate**2
    steps[nodes] = 0.0
    positions = np.cumsum(np.cumsum(steps, axis=0), axis=0)
    return np.pad(positions[:-1], ((1, 0), (0, 0)))


def _nodes(free: Bool[np.ndarray, " frames"]) -> Int[np.ndarray, " nodes"]:
    chosen = free.copy()
    chosen[[0, -1]] = True
    return np.flatnonzero(chosen)


def _lines(nodes: Int[np.ndarray, " nodes"], frames: int) -> sparse.csr_array:
    """Positions of all frames on the straight lines between neighbouring nodes."""
    every = np.arange(frames)
    left = np.minimum(np.searchsorted(nodes, every, side="right") - 1, len(nodes) - 2)
    share = (every - nodes[left]) / np.diff(nodes)[left]
    entries = np.concatenate([1 - share, share])
    places = np.concatenate([every, every]), np.concatenate([left, left + 1])
    return sparse.csr_array((entries, places), shape=(frames, len(nodes)))


def _curvature(nodes: Int[np.ndarray, " nodes"], rate: float) -> sparse.csr_array:
    """Second difference of those lines at the inner nodes."""
    pace = rate**2 / np.diff(nodes)
    before, after = pace[:-1], pace[1:]
    shape = len(nodes) - 2, len(nodes)
    return sparse.diags_array([before, -before - after, after], offsets=[0, 1, 2], shape=shape).tocsr()


def _least_squares(
    lines: sparse.csr_array,
    positions: Float[np.ndarray, "frames n"],
    curvature: sparse.csr_array,
    accelerations: Float[np.ndarray, "inner n"],
) -> Float[np.ndarray, "nodes n"]:
    """Node positions x with the least |lines x − positions|² + |curvature x − accelerations|².

    At high rates the curvature's squares swamp the positions' digits in the normal matrix. So the answer is
    refined by solving for what it leaves.
    """
    normal = lines.T @ lines + curvature.T @ curvature
    bands = np.zeros((3, normal.shape[0]))
    for k in range(min(3, normal.shape[0])):
        bands[k, : normal.shape[0] - k] = normal.diagonal(k)
    factor = cholesky_banded(bands, lower=True), True
    x = np.zeros((normal.shape[0], positions.shape[1]))
    for _ in range(SOLVES):
        x += cho_solve_banded(
            factor, lines.T @ (positions - lines @ x) + curvature.T @ (accelerations - curvature @ x)
        )
    return x
