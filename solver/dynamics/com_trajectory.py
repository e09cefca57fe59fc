"""The centre of mass' trajectory that obeys F = ma where forces were measured and is continuous elsewhere.

The unknowns of the dataset paper (Werling et al. 2024) are ζ = [z₁, ż₁, μ, z̈_u …]: start, initial velocity,
inverse mass, and the total acceleration of every frame u without a complete force. A ζ + b = [Z, α Z̈_U], and
ζ̂ = A† ([Z; 0] − b) for the measured Z. With a finite `force_error_m_s2` the accelerations of observed frames,
too, may differ from μ f − g by a little.

ζ fixes the trajectory by semi-implicit Euler steps: z_{t+1} − 2 z_t + z_{t−1} = Δt² z̈_t. Written in ζ the
matrix is dense, and its columns grow with the square of time. The same trajectories are spanned by their
positions at nodes: all frames whose acceleration is free, and both ends. Between two nodes every acceleration
is known, so the path is the straight line between them plus that acceleration summed twice, which vanishes at
both. A position depends on two nodes and a free acceleration on three. So the normal matrix is pentadiagonal,
at a cost linear in frames, and its condition grows neither with the trial's length nor with that of a gap.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

from solver.common.errors import FitError
from solver.common.notes import Kind, Note
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.com_settings import BLOCK_S, ComSettings
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

# [s] one independent error of the centre of mass in so long; from simulated errors that last 0.02 to 1 s,
# of which the trajectory itself takes up the slow part
NOISE_TIME_S = 0.03
DISAGREEMENT = 2.0  # standard deviations from which two masses are said to disagree: one in twenty

NOMINAL_BLOCKS = 2  # what the expected error counts for beside the scatter between blocks

REFERENCE_KG = 70.0  # centre and scale of the unknown mass ratio, nothing else
FEWEST_FRAMES = 3  # fewer have no second difference
SOLVES = 2  # of the normal equations: the answer, then its correction


@dataclass(frozen=True)
class MassPrior:
    """What is known about the mass beforehand; a standard deviation of zero fixes it."""

    mass_kg: float
    std_kg: float


@dataclass(frozen=True)
class MassEstimate:
    """A mass and its standard deviation, which includes the plates' gain; `sampling_std_kg` does not."""

    mass_kg: float
    std_kg: float
    sampling_std_kg: float  # from errors that differ from step to step
    lean_deg: float = 0.0  # of the forces from the vertical, where it is so large that they are in other axes


@dataclass(frozen=True)
class Standing:
    """Somebody who stands still, and what the plates read together."""

    name: str  # which plates of which recording
    mass: MassEstimate


@dataclass(frozen=True)
class MassRatio:
    """ρ = REFERENCE_KG · μ, the unknown in which the problem is linear."""

    best: float
    std: float
    sampling_std: float

    @property
    def mass(self) -> MassEstimate | None:
        """The mass; None unless it is positive."""
        if self.best <= 0:
            return None
        mass = REFERENCE_KG / self.best
        return MassEstimate(mass, mass * self.std / self.best, mass * self.sampling_std / self.best)


def estimate_mass_ratio(
    projection: "Projection", rate: float, settings: ComSettings, prior: MassPrior | None = None
) -> MassRatio | None:
    """The mass ratio of least squares, weighed against a prior where there is one.

    Noise model: the trajectory's misfits are correlated within blocks of `block_s` and independent between
    them; the scatter between blocks is pooled with the error expected of the centre of mass, which a trial of
    one or two blocks needs. The plates' gain comes on top.

    Args:
        projection: of one trial.
        rate: [Hz].
        settings: errors, blocks and gain.
        prior: None: the trial alone decides.

    Returns:
        None when no force shapes the trajectory and there is no prior.
    """
    data = _data_ratio(projection, rate, settings)
    if prior is None:
        return data
    centre = REFERENCE_KG / prior.mass_kg
    std = centre * prior.std_kg / prior.mass_kg
    if data is None or std == 0:
        return MassRatio(centre, std, 0.0)
    precision = np.array([data.std, std]) ** -2.0
    share = precision / precision.sum()
    best = float(share @ [data.best, centre])
    return MassRatio(best, float(precision.sum() ** -0.5), float(share[0] * data.sampling_std))


def _data_ratio(projection: "Projection", rate: float, settings: ComSettings) -> MassRatio | None:
    best = projection.best_ratio
    if best is None:
        return None
    sampling = _sampling_variance(projection, best, rate, settings) ** 0.5
    return MassRatio(best, float(np.hypot(sampling, settings.plate_gain_std * best)), sampling)


def _sampling_variance(projection: "Projection", ratio: float, rate: float, settings: ComSettings) -> float:
    """Variance of ρ: scores sum to zero over the trial, and how far each block's do not shows the error."""
    information = projection.information
    score = np.sum(projection.slope.misfit * projection.path(ratio).misfit, axis=1)
    blocks = max(1, round(len(score) / (BLOCK_S * rate)))
    starts = np.linspace(0, len(score), blocks, endpoint=False).astype(int)
    total, per_block = information.sum(), np.add.reduceat(information, starts)
    expected = settings.com_error_m**2 * NOISE_TIME_S * rate / total
    spare = total**2 / np.sum(per_block**2) - 1  # effective number of blocks, less the one that ρ takes
    if spare <= 0:
        return float(expected)
    scatter = np.sum(np.add.reduceat(score, starts) ** 2) / total**2 * (spare + 1) / spare
    return float((NOMINAL_BLOCKS * expected + spare * scatter) / (NOMINAL_BLOCKS + spare))


def disagreement(estimate: MassEstimate, entered_kg: float, settings: ComSettings) -> Note | None:
    """A warning where the forces tell another mass than somebody entered; None where they agree."""
    apart = estimate.mass_kg - entered_kg
    std = float(np.hypot(estimate.std_kg, settings.entered_mass_std_kg))
    if abs(apart) <= DISAGREEMENT * std:
        return None
    how, suspect = ("more", "loads carried") if apart > 0 else ("less", "steps beside the plates")
    return Note(
        Kind.ENTERED_MASS,
        f"the forces carry {estimate.mass_kg:.1f} ± {2 * estimate.std_kg:.1f} kg, {abs(apart):.1f} kg {how} "
        f"than the {entered_kg:.1f} kg that were entered",
        advice=f"check the entered mass, the plates' gain, and {suspect}",
    )


@dataclass(frozen=True)
class ComData:
    """One trial seen as a point mass.

    `observed` is the complement of the paper's U; on other frames the force means nothing.
    """

    com_ground: Float[np.ndarray, "frames 3"]  # [m] from the markers
    force_ground: Float[np.ndarray, "frames 3"]  # [N] of all feet together
    observed: Bool[np.ndarray, " frames"]
    rate: float  # [Hz]
    gravity: Float[np.ndarray, "3"]  # [m/s²]

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.com_ground.shape[0]

    def without(self, hidden: Bool[np.ndarray, " frames"]) -> "ComData":
        """The same trial with further frames unobserved."""
        return replace(self, observed=self.observed & ~hidden)

    def between(self, start: int, end: int) -> "ComData":
        """Frames `start` to `end` (excluded) as a trial of their own."""
        part = slice(start, end)
        return replace(
            self,
            com_ground=self.com_ground[part],
            force_ground=self.force_ground[part],
            observed=self.observed[part],
        )


def com_data(skeleton: Skeleton, motion: Motion, contacts: ContactWrenches, mask: FrameMask) -> ComData:
    """Centre of mass of a motion beside the forces that were measured.

    Args:
        skeleton: scaled; only the shares of the segments' masses matter.
        motion: as the kinematics fitted it; filtering is up to the caller.
        contacts: at the motion's frames.
        mask: which feet's forces count.

    Raises:
        FitError: motion, forces and mask are not of the same frames.
    """
    if not motion.frames == contacts.frames == len(mask.counts):
        raise FitError(
            f"Motion has {motion.frames} frames, forces {contacts.frames} and the mask {len(mask.counts)}; "
            "they must be of the same trial at the markers' frames."
        )
    return ComData(
        com_ground=centre_of_mass_of(skeleton, motion.q),
        force_ground=contacts.wrench_ground[:, :, :3].sum(axis=1),
        observed=contacts.observed & mask.all_feet,
        rate=motion.rate,
        gravity=np.asarray(skeleton.gravity, dtype=float),
    )


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


@dataclass(frozen=True)
class ComTrajectory:
    """A fitted trajectory of the centre of mass: all of ζ is in it."""

    com_ground: Float[np.ndarray, "frames 3"]  # [m]
    acceleration_ground: Float[np.ndarray, "frames 3"]  # [m/s²]
    inverse_mass: float  # μ [1/kg]; zero where nothing tells it
    mass: MassEstimate | None  # None likewise, or where μ is negative
    rate: float  # [Hz]


def fit_com_trajectory(data: ComData, settings: ComSettings, prior: MassPrior | None = None) -> ComTrajectory:
    """Fit the trajectory of one trial.

    Args:
        data: centre of mass from markers, forces, and where these are complete.
        settings: α and the two errors.
        prior: on the mass; a standard deviation of zero fixes it, None leaves it free as in the paper.

    Returns:
        A trial of fewer than three frames comes back as it was.
    """
    if data.frames < FEWEST_FRAMES:
        return unchanged(data)
    projection = project(data, settings.penalty_s2(data.observed))
    ratio = estimate_mass_ratio(projection, data.rate, settings, prior)
    path = projection.path(ratio.best if ratio else 0.0)
    return ComTrajectory(
        com_ground=path.com_ground,
        acceleration_ground=path.acceleration_ground,
        inverse_mass=ratio.best / REFERENCE_KG if ratio else 0.0,
        mass=ratio.mass if ratio else None,
        rate=data.rate,
    )


def unchanged(data: ComData) -> ComTrajectory:
    """The measured centre of mass as a trajectory, with its second differences and without a mass."""
    com = data.com_ground.copy()
    acceleration = np.zeros_like(com)
    if data.frames >= FEWEST_FRAMES:
        acceleration[1:-1] = np.diff(com, 2, axis=0) * data.rate**2
    return ComTrajectory(com, acceleration, inverse_mass=0.0, mass=None, rate=data.rate)
