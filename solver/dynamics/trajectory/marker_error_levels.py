"""How large a trial's marker errors are and how fast they change, by segments, as its marker fit shows.

Markers ride on skin. Their errors e(t) in the segment's frame are told apart by how long they last: slow ones
have a size, their scatter about the mean; fast ones grow like a random walk, E‖e(t + L) − e(t)‖² = 3 D L per
marker, at the periods in which motion and noise part. D comes from second differences over a lag, in which
slow movement of skin with the joints' angles does not show. Cameras' white noise counts for as much as it
does at that period. The fit itself has taken a share of the errors, which is given back by counting.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.frames_at_once import by_frames, spans
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion
from solver.markers.label_families import seen_as_poses
from solver.skeleton.forward import ForwardKinematics

# [s] over which the fast part of marker errors is told from the marker fit: periods of a tenth of a second,
# where motion ends and noise begins
MARKER_ERROR_LAG_S = 0.05
SEGMENT_PRIOR_MARKERS = 3.0  # [markers] of the trial's mean count beside a segment's own: three hold its pose
USUAL_MARKER_SLOW_M = 0.004  # [m] of skin, where a trial is too short to tell; walks and runs have 3 to 6 mm
USUAL_MARKER_GROWTH_M = 0.01  # [m/√s] likewise: 1 mm from frame to frame at 100 Hz
# [m] of points of poses: angles of walks are off by 1.3° to 3.5° then; a markerless system's sessions differ
# by less than 3° (Augustine et al. 2025, 10.7717/peerj.18613)
POSE_SLOW_M = 0.010

FEWEST_FRAMES = 10  # frames, or second differences, from which on a marker tells anything
LEAST_LEFT = 0.25  # of the errors' squares after the fit: with few markers the count of dofs means little


@dataclass(frozen=True)
class MarkerErrorLevels:
    """Standard deviations per coordinate; all markers of a segment have the same."""

    slow_m: Float[np.ndarray, " markers"]  # [m] about the mean
    growth_m: Float[np.ndarray, " markers"]  # [m/√s] √D

    @property
    def lasts_s(self) -> float:
        """Of all markers: ℓ of errors whose correlation is ρ(t) = exp(−(t/ℓ)²/2), as growth and size have it.

        Second differences over a lag are then 3 − 4ρ + ρ⁴ times twice the size's square, with ρ of the lag.
        """
        growth, slow = np.mean(self.growth_m**2), np.mean(self.slow_m**2)
        rho = np.linspace(0.01, 0.99, 99)
        nearest = np.argmin(np.abs(3 - 4 * rho + rho**4 - growth * MARKER_ERROR_LAG_S / slow))
        return float(MARKER_ERROR_LAG_S / np.sqrt(-2 * np.log(rho[nearest])))

    def of_poses(self) -> "MarkerErrorLevels":
        """As fast as they seem, and as large as a markerless system's, whose own skeleton hides them."""
        hidden = max(1.0, POSE_SLOW_M / float(np.sqrt(np.mean(self.slow_m**2))))
        return MarkerErrorLevels(hidden * self.slow_m, hidden * self.growth_m)


def marker_error_levels(
    kinematics: ForwardKinematics,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    start: Motion,
    settings: TrajectorySettings,
) -> MarkerErrorLevels:
    """Levels of one trial.

    Args:
        kinematics: of the skeleton whose markers were observed.
        observed_ground: NaN where unseen [m].
        start: the marker fit.
        settings: the lag, what a segment is believed to be before its markers are seen, and least levels.
    """
    seen = np.isfinite(observed_ground).all(axis=2)
    bodies = kinematics.marker_bodies

    def in_segments(
        q: Float[np.ndarray, "some dofs"], observed: Float[np.ndarray, "some markers 3"]
    ) -> Float[np.ndarray, "some markers 3"]:
        poses, shown = kinematics.poses(q), np.isfinite(observed).all(axis=2)
        error_ground = np.where(shown[:, :, None], kinematics.markers(poses) - observed, 0.0)
        return np.einsum("tmji,tmj->tmi", poses.R_ground_body[:, bodies], error_ground)

    error_body = by_frames(in_segments, start.q, observed_ground)
    squares = by_frames(lambda error: (error**2).sum(axis=2), error_body)
    trust = seen / (1 + squares / settings.marker_robust_scale_m**2)
    left = max(LEAST_LEFT, 1 - start.q.shape[1] / max(1.0, 3 * float(np.median(seen.sum(axis=1)))))
    lag = max(1, round(MARKER_ERROR_LAG_S * start.rate))
    slow = _scatter(error_body, trust) / left
    growth = _growth(error_body, trust, lag) * start.rate / lag / left
    few = SEGMENT_PRIOR_MARKERS
    levels = MarkerErrorLevels(
        np.maximum(settings.least_marker_slow_m, _by_segment(slow, bodies, few, USUAL_MARKER_SLOW_M)),
        np.maximum(settings.least_marker_growth_m, _by_segment(growth, bodies, few, USUAL_MARKER_GROWTH_M)),
    )
    return levels.of_poses() if seen_as_poses(kinematics.skeleton.marker_names) else levels


def _scatter(
    error_body: Float[np.ndarray, "frames markers 3"], trust: Float[np.ndarray, "frames markers"]
) -> Float[np.ndarray, " markers"]:
    """Mean square about each marker's mean, per coordinate [m²]; NaN of markers that were hardly seen."""
    total = trust.sum(axis=0)
    known = (trust > 0).sum(axis=0) >= FEWEST_FRAMES
    weight = trust / np.where(known, total, 1.0)
    mean = np.einsum("tm,tmc->mc", weight, error_body)
    squares = np.zeros(len(total))
    for some in spans(len(error_body)):
        squares += np.einsum("tm,tmc->m", weight[some], (error_body[some] - mean) ** 2)
    return np.where(known, squares / 3, np.nan)


def _growth(
    error_body: Float[np.ndarray, "frames markers 3"], trust: Float[np.ndarray, "frames markers"], lag: int
) -> Float[np.ndarray, " markers"]:
    """Half the mean square of second differences, per coordinate [m²]: a random walk's growth in a lag."""
    if len(error_body) <= 2 * lag:
        return np.full(error_body.shape[1], np.nan)
    weight = np.minimum(np.minimum(trust[2 * lag :], trust[lag:-lag]), trust[: -2 * lag])
    known = (weight > 0).sum(axis=0) >= FEWEST_FRAMES
    total = np.where(known, weight.sum(axis=0), 1.0)
    squares = np.zeros(len(total))
    for some in spans(len(weight)):
        first, middle, last = (error_body[some.start + k * lag : some.stop + k * lag] for k in range(3))
        bent = last - 2 * middle + first
        squares += np.einsum("tm,tmc->m", weight[some], bent**2)
    return np.where(known, squares / total / 6, np.nan)


def _by_segment(
    squares: Float[np.ndarray, " markers"], bodies: Int[np.ndarray, " markers"], few: float, usual: float
) -> Float[np.ndarray, " markers"]:
    """Root of the mean over a segment's markers and a `few` of the trial's mean, or of what is usual."""
    known: Bool[np.ndarray, " markers"] = np.isfinite(squares)
    of_trial = float(squares[known].mean()) if known.any() else usual**2
    of_segment = np.empty(len(squares))
    for body in np.unique(bodies):
        own = squares[known & (bodies == body)]
        of_segment[bodies == body] = (own.sum() + few * of_trial) / (len(own) + few)
    return np.sqrt(of_segment)
