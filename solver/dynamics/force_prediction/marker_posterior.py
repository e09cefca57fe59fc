"""The trajectory that markers alone tell, and how uncertain the wrench is that it demands.

Markers ride on skin: their errors last a tenth of a second and those of one segment's markers go together.
Such errors are a Gauss-Markov process, e(t) with covariance (own² + shared² 11ᵀ) exp(−|Δt|/τ) over the
markers of a segment. With a prior on the jerk, whose weight the markers choose, this is one Gaussian over the
spline's coefficients; the wrench that they demand is Gaussian, too, and its covariance says how much of a
residual the markers excuse. Cameras add white noise, which is seen from frame to frame; it is taken for as
much of the process as has its power at one frequency.

The markers' trajectory of a long trial, window by window: no matrix of the trial's size is held.
"""

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import solve_triangular

from solver.common.frames_at_once import by_frames, joined, overlapping
from solver.common.one_thread import one_thread
from solver.common.white_noise import white_noise
from solver.dynamics.force_prediction.marker_noise import MarkerNoise
from solver.dynamics.momentum_terms import MomentumTerms, momentum_terms
from solver.dynamics.trajectory.block_tridiagonal import BlockCholesky
from solver.dynamics.trajectory.spline_band import (
    REACH,
    CoefficientBand,
    from_blocks,
    in_blocks,
    nearest_spline,
)
from solver.dynamics.trajectory.spline_basis import DEGREE, ORDER, SplineBasis, spline_basis
from solver.dynamics.trajectory.terms.priors import JERK_CUTOFF_HZ, jerk_level, pull_precision
from solver.dynamics.trajectory.trajectory_prior import TrajectoryPrior, likeliest_smoothness
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.weighted_means import Windows
from solver.kinematics.motion import Motion
from solver.kinematics.unseen_bodies import undetermined_dofs
from solver.skeleton.forward import ForwardKinematics, marker_jacobian
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

# of the angles and accelerations of joints that markers show, as much have those that move no marker. Where
# markers show them, backs have 0.2 to 0.55, arms 0.3 to 0.9, and more in jumps
UNSEEN_SHARE = 0.5
CHUNK = 128  # frames whose Jacobians and marker precisions are held at once


@dataclass(frozen=True, eq=False)
class MarkerPosterior:
    """Mean trajectory and the factor of its precision."""

    skeleton: Skeleton
    motion: Motion  # spline at the frames
    basis: SplineBasis
    velocity: Float[np.ndarray, "frames dofs"]
    acceleration: Float[np.ndarray, "frames dofs"]
    factor: BlockCholesky
    memory_s: float
    smoothness: float  # that the markers chose
    coefficients: Float[np.ndarray, "coefficients dofs"]  # of the motion

    def wrench_covariance(
        self, measured_ground: Float[np.ndarray, "frames 6"], windows: Windows
    ) -> Float[np.ndarray, "rows rows"]:
        """Covariance of the required wrench's window means, beside a measured one; see `covariance`."""
        return self.covariance(self.momentum(measured_ground), windows)

    def momentum(self, measured_ground: Float[np.ndarray, "frames 6"]) -> MomentumTerms:
        """Required less measured wrench about the centre of mass, with derivatives by q, q̇ and q̈."""
        return momentum_terms(self.model, self.motion.q, self.velocity, self.acceleration, measured_ground)

    @cached_property
    def model(self) -> RigidBodyModel:
        """Of the skeleton."""
        return RigidBodyModel(self.skeleton)

    def covariance(self, terms: MomentumTerms, windows: Windows) -> Float[np.ndarray, "rows rows"]:
        """Covariance of the required wrench's window means [N², N·N·m, (N·m)²].

        Args:
            terms: of `momentum`.
            windows: what is averaged; rows are windows × six components.
        """
        with one_thread():
            return _propagated(self, [terms.by_q, terms.by_v, terms.by_a], windows)


def marker_posterior(
    skeleton: Skeleton,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    start: Motion,
    noise: MarkerNoise,
    settings: TrajectorySettings,
) -> MarkerPosterior:
    """Fit the trajectory to the markers alone.

    Args:
        skeleton: scaled; its markers are those observed.
        observed_ground: NaN where unseen [m].
        start: of inverse kinematics.
        noise: of the markers.
        settings: jerk levels, pull and robust scale of the trajectory fit.
    """
    return posterior_of(MarkerTrack(skeleton, observed_ground, start, noise, settings), noise)


def posterior_of(
    track: "MarkerTrack", noise: MarkerNoise, begin: Float[np.ndarray, "coefficients dofs"] | None = None
) -> MarkerPosterior:
    """Fit the trajectory to a track, or to a part of one.

    Args:
        track: of the markers.
        noise: iterations and the choice of smoothness.
        begin: coefficients to begin with; None: those nearest to inverse kinematics.
    """
    with one_thread():
        start, pull = track.start, track.pull
        basis = spline_basis(start.frames, start.rate, track.spacing)
        smoothness = noise.smoothness[0]
        c = nearest_spline(basis, start.q) if begin is None else begin
        prior = TrajectoryPrior(basis, pull, track.jerk**-2.0)
        for iteration in range(noise.iterations):
            band, gradient = track.linearized(basis, basis.evaluate(c), pull)
            if iteration == noise.iterations - 2:  # near the markers, whose cost is a parabola there
                smoothness = likeliest_smoothness(band, gradient, c, prior, noise.smoothness)
            jerk_weight = smoothness * prior.jerk_precision
            band.add_jerk(jerk_weight)
            gradient += jerk_weight * basis.jerk_product(c)
            factor = band.block_tridiagonal().factorized_in_place()
            half = factor.half_solve(in_blocks(gradient[:, :, None]))
            step = from_blocks(factor.back_solve(half)[:, :, 0], *c.shape)
            c = c - step
        return MarkerPosterior(
            track.kinematics.skeleton,
            replace(start, q=basis.evaluate(c)),
            basis,
            basis.evaluate(c, 1),
            basis.evaluate(c, 2),
            factor,
            noise.memory_s,
            smoothness,
            c,
        )


class MarkerTrack:
    """Marker errors of a trial, weighed by segment, and what is known of its motion beside them."""

    def __init__(
        self,
        skeleton: Skeleton,
        observed_ground: Float[np.ndarray, "frames markers 3"],
        start: Motion,
        noise: MarkerNoise,
        settings: TrajectorySettings,
    ) -> None:
        self.kinematics = ForwardKinematics(skeleton)
        self.seen = np.isfinite(observed_ground).all(axis=2)
        self.observed = np.where(self.seen[..., None], observed_ground, 0.0)
        error, error_body = np.split(by_frames(self._errors_of, start.q, self.seen, self.observed), 2, axis=2)
        self.trust = self.seen / (1 + (error**2).sum(axis=2) / settings.marker_robust_scale_m**2)
        self.pairs = (self.seen[1:] & self.seen[:-1]) * np.minimum(self.trust[1:], self.trust[:-1])
        self.start = start
        self.spacing = max(1, round(noise.knot_spacing_s * start.rate))
        self.pull, self.jerk = pull_precision(skeleton, observed_ground, settings), jerk_level(start)
        unseen = undetermined_dofs(skeleton, observed_ground)
        if unseen.any():
            shown = start.q[:, ~unseen & (self.pull > 0)]
            pull, jerk = _unseen_motion(replace(start, q=shown), noise.smoothness[0])
            self.pull[unseen] = np.minimum(self.pull[unseen], pull)
            self.jerk[unseen] = np.maximum(self.jerk[unseen], jerk)
        stray = _dynamic_error(error_body, self.seen)
        white = noise.white_share * _white_noise(error_body, self.seen, start.q.shape[1])
        as_slow = (1 + (2 * np.pi * noise.white_Hz * noise.time_s) ** 2) / (2 * noise.time_s * start.rate)
        own = max(noise.least_m, noise.own_share * stray)
        self.own_std_m = float(np.hypot(own, white * np.sqrt(as_slow)))
        self.shared_std_m = max(noise.least_m, noise.shared_share * stray)
        self.static = 1 / (2 * noise.time_s * start.rate)  # × the inverse of the markers' covariance
        self.change = noise.time_s * start.rate / 2
        bodies = self.kinematics.marker_bodies
        self.of_body = (bodies[:, None] == np.unique(bodies)).astype(float)

    def part(self, start: int, end: int) -> "MarkerTrack":
        """Frames `start` to `end` (excluded), as noisy as the whole."""
        own = copy(self)
        own.start = self.start.between(start, end)
        own.seen, own.observed, own.trust = (x[start:end] for x in (self.seen, self.observed, self.trust))
        own.pairs = self.pairs[start : end - 1]
        return own

    def _errors_of(
        self,
        q: Float[np.ndarray, "some dofs"],
        seen: Bool[np.ndarray, "some markers"],
        observed: Float[np.ndarray, "some markers 3"],
    ) -> Float[np.ndarray, "some markers 6"]:
        """In the ground frame and in the segments' own [m]."""
        poses = self.kinematics.poses(q)
        error = np.where(seen[..., None], self.kinematics.markers(poses) - observed, 0.0)
        R_ground_segment = poses.R_ground_body[:, self.kinematics.marker_bodies]
        return np.concatenate([error, np.einsum("tmji,tmj->tmi", R_ground_segment, error)], axis=2)

    def linearized(
        self, basis: SplineBasis, q: Float[np.ndarray, "frames dofs"], pull: Float[np.ndarray, " dofs"]
    ) -> tuple[CoefficientBand, Float[np.ndarray, "coefficients dofs"]]:
        """Precision and gradient of half the cost."""
        frames, dofs = q.shape
        poses = self.kinematics.poses(q)
        x = self.kinematics.markers(poses)
        error = self._error(x)
        H, g = np.zeros((frames, dofs, dofs)), np.zeros((frames, dofs))
        H_before = np.zeros((frames, dofs, dofs))
        for low in range(0, frames, CHUNK):
            high = min(frames, low + CHUNK + 1)  # one more: the pair across the border
            own = slice(low, min(frames, low + CHUNK))
            J = marker_jacobian(self.kinematics, poses.at(slice(low, high)), x[low:high])
            J = J.reshape(high - low, -1, 3, dofs)
            P = self.static * self._precision(self.trust[own])
            count = own.stop - low
            self._add(H[own], g[own], P, J[:count], error[own])
            Q = self.change * self._precision(self.pairs[low : high - 1])
            change = error[low + 1 : high] - error[low : high - 1]
            self._add(H[low + 1 : high], g[low + 1 : high], Q, J[1:], change)
            self._add(H[low : high - 1], g[low : high - 1], Q, J[:-1], -change)
            H_before[low + 1 : high] = -_inner(J[1:], _weighed(Q, J[:-1]))
        H[:, np.arange(dofs), np.arange(dofs)] += pull
        g += pull * (q - self.start.q)
        band = CoefficientBand.empty(basis, dofs)
        band.add_frames(0, H, H_before)
        return band, CoefficientBand.gather(basis, g, 0)

    def _add(
        self,
        H: Float[np.ndarray, "some dofs dofs"],
        g: Float[np.ndarray, "some dofs"],
        P: Float[np.ndarray, "some markers markers"],
        J: Float[np.ndarray, "some markers 3 dofs"],
        error: Float[np.ndarray, "some markers 3"],
    ) -> None:
        H += _inner(J, _weighed(P, J))
        g += _inner(J, (P @ error)[..., None])[..., 0]

    def _precision(
        self, weight: Float[np.ndarray, "some markers"]
    ) -> Float[np.ndarray, "some markers markers"]:
        """Inverse of own² diag(1/w) + shared² 11ᵀ within segments (Woodbury)."""
        D = weight / self.own_std_m**2
        spread = D[:, :, None] * self.of_body
        inner = 1 / (self.shared_std_m**-2 + spread.sum(axis=1))
        return D[:, :, None] * np.eye(D.shape[1]) - (spread * inner[:, None]) @ spread.transpose(0, 2, 1)

    def _error(self, x: Float[np.ndarray, "frames markers 3"]) -> Float[np.ndarray, "frames markers 3"]:
        return np.where(self.seen[..., None], x - self.observed, 0.0)


def _unseen_motion(shown: Motion, smoothness: float) -> tuple[float, float]:
    """Pull of each frame [1/rad²] and jerk level [rad/s³] of joints that move no marker.

    A process of precision P ∫q² dt + W ∫(d³q/dt³)² dt has the variances ω/3P of its angle and ω⁵/3P of its
    acceleration, with ω⁶ = P/W. Both are to be those of the other joints, times `UNSEEN_SHARE`².

    Args:
        shown: of the joints that move markers.
        smoothness: that the jerk level goes with.
    """
    slow = shown.low_passed(JERK_CUTOFF_HZ)
    inner = slice(shown.frames // 10, shown.frames - shown.frames // 10)
    angle = np.sqrt(slow.q[inner].var(axis=0).sum())
    if not angle:
        return np.inf, 0.0
    acceleration = np.sqrt((slow.derivative(2)[inner] ** 2).mean(axis=0).sum())
    omega = np.sqrt(acceleration / angle)
    precision = omega * slow.q.shape[1] / (3 * (UNSEEN_SHARE * angle) ** 2)
    return float(precision / shown.rate), float(np.sqrt(smoothness / precision) * omega**3)


def _dynamic_error(
    error_body: Float[np.ndarray, "frames markers 3"], seen: Bool[np.ndarray, "frames markers"]
) -> float:
    """What the typical marker moves on its segment, per coordinate [m]."""
    count = seen.sum(axis=0)
    used = count >= 2
    if not used.any():
        return 0.0
    mean = np.where(seen[..., None], error_body, 0.0).sum(axis=0)[used] / count[used, None]
    apart = (error_body[:, used] - mean) ** 2
    squares = np.where(seen[:, used, None], apart, 0.0).sum(axis=(0, 2)) / count[used]
    return float(np.median(np.sqrt(squares / 3)))


def _white_noise(
    error_body: Float[np.ndarray, "frames markers 3"], seen: Bool[np.ndarray, "frames markers"], dofs: int
) -> float:
    """Of the typical marker, per coordinate [m]; zero where too little is seen.

    The pose of each frame has taken a share of it: as many of its coordinates as it has dofs.
    """
    known = np.where(seen[..., None], error_body, np.nan)
    of_marker = white_noise(known.reshape(len(known), -1)).reshape(-1, 3)
    of_marker = of_marker[np.isfinite(of_marker).all(axis=1)]
    if not len(of_marker):
        return 0.0
    left = 1 - dofs / max(3 * float(np.median(seen.sum(axis=1))), 2 * dofs)
    return float(np.median(np.sqrt((of_marker**2).mean(axis=1) / left)))


def _propagated(
    posterior: MarkerPosterior, jacobians: list[Float[np.ndarray, "frames 6 dofs"]], windows: Windows
) -> Float[np.ndarray, "rows rows"]:
    """Σ = J A⁻¹ Jᵀ, block by block of the band; a column lives for `memory_s` after its window."""
    basis, factor = posterior.basis, posterior.factor
    dofs, size = posterior.motion.q.shape[1], factor.L.shape[1]
    local, first = _local_rows(basis, jacobians, windows)
    reach = local.shape[1]
    memory = int(np.ceil(posterior.memory_s * basis.rate / (REACH * basis.spacing)))
    count = windows.count
    covariance = np.zeros((count, 6, count, 6))
    begin, end = first // REACH, (first + reach - 1) // REACH
    carried = np.zeros((size, 0))
    alive = np.zeros(0, dtype=int)
    for i in range(len(factor.L)):
        now = np.flatnonzero((begin <= i) & (i <= end + memory))
        local_right = np.zeros((REACH, dofs, len(now), 6))
        for j, w in enumerate(now):
            for a in range(max(0, REACH * i - first[w]), min(reach, REACH * (i + 1) - first[w])):
                local_right[first[w] + a - REACH * i, :, j] = local[w, a].T
        right = local_right.reshape(size, len(now), 6)
        kept = np.isin(alive, now)
        position = np.searchsorted(now, alive[kept])
        if i and len(position):
            right[:, position] -= carried.reshape(size, -1, 6)[:, kept]
        Y = solve_triangular(factor.L[i], right.reshape(size, -1), lower=True, check_finite=False)
        product = (Y.T @ Y).reshape(len(now), 6, len(now), 6)
        if len(now):
            covariance[now[0] : now[-1] + 1, :, now[0] : now[-1] + 1] += product
        alive = now
        carried = factor.G[i] @ Y if i + 1 < len(factor.L) else Y
    return covariance.reshape(6 * count, 6 * count)


def _local_rows(
    basis: SplineBasis, jacobians: list[Float[np.ndarray, "frames 6 dofs"]], windows: Windows
) -> tuple[Float[np.ndarray, "windows reach 6 dofs"], Int[np.ndarray, " windows"]]:
    """Each window's mean wrench by the coefficients that touch it, and the first of these."""
    first = basis.first[windows.start]
    last = basis.first[np.minimum(windows.start + windows.length - 1, basis.frames - 1)]
    reach = int((last - first).max(initial=0)) + ORDER
    dofs = jacobians[0].shape[2]
    local = np.zeros((windows.count, reach, 6, dofs))
    order = np.arange(windows.count)
    for k in range(windows.length):
        t = windows.start + k
        for o, J in enumerate(jacobians):
            for a in range(ORDER):
                weight = windows.weights[k] * basis.derivative[o][t, a]
                local[order, basis.first[t] - first + a] += weight[:, None, None] * J[t]
    return local, first


def _inner(
    left: Float[np.ndarray, "some markers 3 dofs"], right: Float[np.ndarray, "some markers 3 columns"]
) -> Float[np.ndarray, "some dofs columns"]:
    some, rows = len(left), 3 * left.shape[1]
    flat = left.reshape(some, rows, left.shape[3])
    return flat.transpose(0, 2, 1) @ right.reshape(some, rows, right.shape[3])


def _weighed(
    P: Float[np.ndarray, "some markers markers"], J: Float[np.ndarray, "some markers 3 dofs"]
) -> Float[np.ndarray, "some markers 3 dofs"]:
    return (P @ J.reshape(*J.shape[:2], 3 * J.shape[3])).reshape(J.shape)


@dataclass(frozen=True, eq=False)
class LongMarkerPosterior:
    """Mean trajectory; the factors of its precision are made again, one by one, when they are asked for."""

    track: MarkerTrack
    noise: MarkerNoise  # of the chosen smoothness
    parts: tuple[slice, ...]
    motion: Motion
    velocity: Float[np.ndarray, "frames dofs"]
    acceleration: Float[np.ndarray, "frames dofs"]
    coefficients: Float[np.ndarray, "coefficients dofs"]

    @property
    def smoothness(self) -> float:
        """That most of its parts chose."""
        return self.noise.smoothness[0]

    def wrench_covariance(
        self, measured_ground: Float[np.ndarray, "frames 6"], windows: Windows
    ) -> Float[np.ndarray, "rows rows"]:
        """Covariance of the required wrench's window means [N², N·N·m, (N·m)²].

        A pair of windows is told by the part in whose middle it lies; pairs that no part holds are farther
        apart than any marker's error lasts.

        Args:
            measured_ground: force [N] and moment about the ground origin [N·m].
            windows: what is averaged; rows are windows × six components.
        """
        covariance = np.zeros((windows.count, 6, windows.count, 6))
        ends = windows.start + windows.length
        borders = [(a.stop + b.start) / 2 for a, b in zip(self.parts[:-1], self.parts[1:], strict=True)]
        middles = (windows.centre[:, None] + windows.centre) / 2
        of_part = np.searchsorted(borders, middles, side="right")
        for k, part in enumerate(self.parts):
            inside = np.flatnonzero((windows.start >= part.start) & (ends <= part.stop))
            if not len(inside):
                continue
            own = Windows(part.stop - part.start, windows.start[inside] - part.start, windows.weights)
            found = self._made_again(part).wrench_covariance(measured_ground[part], own)
            found = found.reshape(len(inside), 6, len(inside), 6)
            six = np.arange(6)
            pairs = np.ix_(inside, six, inside, six)
            here = (of_part[np.ix_(inside, inside)] == k)[:, None, :, None]
            covariance[pairs] = np.where(here, found, covariance[pairs])
        return covariance.reshape(6 * windows.count, 6 * windows.count)

    def _made_again(self, part: slice) -> MarkerPosterior:
        first, frames = part.start // self.track.spacing, part.stop - part.start
        count = max(1, -(-(frames - 1) // self.track.spacing)) + DEGREE
        once = replace(self.noise, iterations=1)
        begin = self.coefficients[first : first + count]
        return posterior_of(self.track.part(part.start, part.stop), once, begin)


def trial_posterior(
    skeleton: Skeleton,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    start: Motion,
    noise: MarkerNoise,
    settings: TrajectorySettings,
) -> MarkerPosterior | LongMarkerPosterior:
    """Of a trial of any length; arguments as of `marker_posterior`."""
    track = MarkerTrack(skeleton, observed_ground, start, noise, settings)
    parts = overlapping(
        start.frames,
        most=settings.whole_frames,
        window=settings.window_frames,
        shared=settings.overlap_frames,
        align=track.spacing,
    )
    if len(parts) == 1:
        return posterior_of(track, noise)
    found = [_spline(track.part(part.start, part.stop), noise) for part in parts]
    choices = sorted(smoothness for _, smoothness in found)
    chosen = replace(noise, smoothness=(choices[len(choices) // 2],))
    splines = [
        c if own == chosen.smoothness[0] else _spline(track.part(part.start, part.stop), chosen)[0]
        for (c, own), part in zip(found, parts, strict=True)
    ]
    c = joined(splines, [part.start // track.spacing for part in parts])
    basis = spline_basis(start.frames, start.rate, track.spacing)
    q, velocity, acceleration = (basis.evaluate(c, order) for order in range(3))
    return LongMarkerPosterior(track, chosen, tuple(parts), replace(start, q=q), velocity, acceleration, c)


def _spline(track: MarkerTrack, noise: MarkerNoise) -> tuple[Float[np.ndarray, "coefficients dofs"], float]:
    """Coefficients and smoothness; the factor is gone."""
    found = posterior_of(track, noise)
    return found.coefficients, found.smoothness
