"""Time histories that a force or moment may take over a trial without any cause that would say how.

A constant and changes that last six hundredths of a second and more, or an even swing, as what a motor
shakes.
"""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline
from scipy.signal import zoom_fft

from solver.diagnosis.causes.scene import Scene, force_at

KNOTS_S = (0.06, 0.25)  # of courses that are tried; shorter ones look like the model's own errors
MOST_KNOTS = 60  # of one trial
SLOWEST_HZ = 1.0  # of a force that swings evenly; splines follow slower ones
FASTEST_HZ = 8.0  # likewise; faster ones look like the markers' noise
LEAST_PERIODS = 3  # in a trial: fewer are a time history like any other
SHARE_OF_DEMAND = 0.5  # at its frequency, of a force that swings evenly
FINER = 4  # than what a trial of that length tells apart
LEAST_EXPLAINED = 0.6  # share of a force from which on its dependence is stated


def time_histories_of(
    scene: Scene, knot_s: float, frequency_Hz: float | None = None
) -> Float[np.ndarray, "frames time histories"]:
    """A constant, and histories that sum to one: cubic B-splines through the trial, or phases of a swing.

    Args:
        scene: of the trial.
        knot_s: between knots of the splines [s].
        frequency_Hz: of the swing; None for splines.
    """
    time_s = scene.times
    if frequency_Hz is not None:
        phase = 2 * np.pi * (frequency_Hz * time_s[:, None] + np.arange(3) / 3)
        return np.concatenate([np.ones((scene.frames, 1)), (1 + np.cos(phase)) / 3], axis=1)
    pieces = pieces_of(scene, knot_s)
    inner = np.linspace(0, time_s[-1], pieces + 1)
    step = inner[1]
    knots = np.concatenate([-step * np.arange(3, 0, -1), inner, time_s[-1] + step * np.arange(1, 4)])
    splines = BSpline.design_matrix(time_s, knots, 3, extrapolate=True).toarray()
    return np.concatenate([np.ones((scene.frames, 1)), splines], axis=1)


def pieces_of(scene: Scene, knot_s: float) -> int:
    """Of a spline through the trial; in a long one they are longer than was asked for."""
    return int(np.clip(round(scene.times[-1] / knot_s), 4, MOST_KNOTS))


def force_columns(
    point_ground: Float[np.ndarray, "frames 3"],
    time_histories: Float[np.ndarray, "frames time histories"],
    axis: int,
) -> Float[np.ndarray, "frames 6 time histories"]:
    """Forces of these time histories at a point [m] along one axis, about the ground origin."""
    along = force_at(np.eye(3)[axis], point_ground)
    return np.asarray(along[:, :, None] * time_histories[:, None, :])


def moment_columns(
    time_histories: Float[np.ndarray, "frames time histories"], axis: int, lever_m: float = 1.0
) -> Float[np.ndarray, "frames 6 time histories"]:
    """Moments of these time histories about one axis.

    Args:
        time_histories: of a force on the lever.
        axis: of the ground.
        lever_m: its length.
    """
    columns = np.zeros((len(time_histories), 6, time_histories.shape[1]))
    columns[:, 3 + axis] = lever_m * time_histories
    return columns


def strongest_frequency_Hz(scene: Scene) -> float | None:
    """At which what the motion demands differs most from what was recorded, in newtons.

    Only where the difference is a large share of the demand itself: what swings with the steps and is small
    beside their forces is what model and skin are off by. None where it is so nowhere, or most at either end
    of the range: that is the flank of something else.
    """
    slowest_Hz = max(SLOWEST_HZ, LEAST_PERIODS * scene.rate / scene.frames)
    tried = np.arange(slowest_Hz, FASTEST_HZ, scene.rate / scene.frames / FINER)
    if not (scene.counts.any() and len(tried)):
        return None
    band_Hz = tried[0], tried[0] + len(tried) * scene.rate / scene.frames / FINER

    def power(force: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, " tried"]:
        changing = (force - force[scene.counts].mean(axis=0)) * scene.counts[:, None]
        tapered = changing * np.hanning(scene.frames)[:, None]  # or what is slow would ripple into the range
        swings = zoom_fft(tapered, band_Hz, len(tried), fs=scene.rate, axis=0)
        return np.asarray((np.abs(swings) ** 2).sum(axis=1))

    required = scene.required_ground[:, :3]
    missing, whole = power(required - scene.measured_ground[:, :3]), power(required)
    missing = np.where(missing > SHARE_OF_DEMAND**2 * whole, missing, 0.0)
    peak = np.argmax(missing)
    return float(tried[peak]) if missing[peak] and 0 < peak < len(tried) - 1 else None


def mostly_swings(time_history: Float[np.ndarray, "frames 3"]) -> bool:
    """Whether it changes more than it lasts along any axis."""
    return bool(time_history.std(axis=0).max() > np.abs(time_history.mean(axis=0)).max())


def constant_share(force: Float[np.ndarray, "frames 3"]) -> float:
    """Of a force's mean square, what its mean has."""
    total = float((force**2).mean(axis=0).sum())
    return float((force.mean(axis=0) ** 2).sum()) / total if total else 0.0


def dependence(
    scene: Scene, force: Float[np.ndarray, "frames 3"], body: int, frequency_Hz: float | None = None
) -> str:
    """On what the force depends most: nothing, place, velocity, its square, acceleration; in words.

    One that swings evenly depends on the time alone, whatever the body does.
    """
    if frequency_Hz is not None:
        return f"time: it swings {frequency_Hz:.1f} times a second"
    point = scene.skeleton.bodies[body].com_body
    place = scene.point_ground(body, point)
    velocity = scene.point_velocity_ground(body, point)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    acceleration = np.gradient(velocity, 1 / scene.rate, axis=0)
    total = (force**2).sum()
    explained = {"constant": constant_share(force)}
    for name, regressor in (
        ("position", place - place.mean(axis=0)),
        ("velocity", velocity),
        ("velocity squared", speed * velocity),
        ("acceleration", acceleration),
    ):
        A = np.concatenate([np.ones((len(force), 1)), regressor], axis=1)
        rest = force - A @ np.linalg.lstsq(A, force, rcond=None)[0]
        explained[name] = 1 - (rest**2).sum() / total if total else 0.0
    best = max(explained, key=lambda n: explained[n] + (0.1 if n == "constant" else 0.0))
    if explained[best] < LEAST_EXPLAINED:
        return "none of: constant, position, velocity, acceleration"
    return f"{best} ({100 * explained[best]:.0f} % of it)"
