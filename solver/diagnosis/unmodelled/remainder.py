"""Something pulls at a body and no cause says why: a force of unknown time history, body by body.

It is a Gaussian process in time, a constant and changes that last six hundredths of a second and more, or
swings evenly, as what a motor shakes. It acts near a body's centre of mass. Of all bodies the one is named
whose line of action fits. It competes with the catalogue on the same scale; its freedom costs it evidence.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline
from scipy.signal import zoom_fft

from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.body_masses import LIGHTEST_SHARE
from solver.diagnosis.causes.effect import Estimate, Eta, Fitted, InPieces, Signature
from solver.diagnosis.causes.observed_trial import Scene, force_at
from solver.skeleton.rotations import skew
from solver.skeleton.skeleton import Body

KNOTS_S = (0.06, 0.25)  # of courses that are tried; shorter ones look like the model's own errors
MOST_KNOTS = 60  # of one trial
SLOWEST_HZ = 1.0  # of a force that swings evenly; splines follow slower ones
FASTEST_HZ = 8.0  # likewise; faster ones look like the markers' noise
LEAST_PERIODS = 3  # in a trial: fewer are a time history like any other
SHARE_OF_DEMAND = 0.5  # at its frequency, of a force that swings evenly
FINER = 4  # than what a trial of that length tells apart
LEAST_EXPLAINED = 0.6  # share of a force from which on its dependence is stated
FORCE_SHARES = (0.005, 0.02, 0.08, 0.25, 0.8)  # of body weight: standard deviations that are tried
MOMENT_LEVERS_M = (0.002, 0.01, 0.04, 0.12, 0.4)  # of an unknown moment, times body weight
REACH = 1.0  # radii of gyration: how far from the body's centre of mass it may act
LEAST_RADIUS_M = 0.03
OWN_BONUS = 0.3  # radii of gyration, in favour of the body in whose frame the point was found
POINT_PULL = 0.1  # towards the centre of mass, where the moments say little
LEAST_DIRECTION = 0.05  # of the strongest axis


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


@dataclass(frozen=True)
class Unknown(InPieces):
    """Something of any time history that acts in one trial."""

    trial: str
    knot_s: float = KNOTS_S[0]  # of its time history
    frequency_Hz: float | None = field(default=None, kw_only=True)  # of one that swings evenly instead

    sizes: ClassVar[tuple[float, ...]] = ()  # standard deviations of its changes that are tried

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Every size."""
        return tuple((size,) for size in self.sizes)

    def time_histories(self, scene: Scene) -> Float[np.ndarray, "frames time histories"]:
        """A constant, and splines or phases of a swing."""
        return time_histories_of(scene, self.knot_s, self.frequency_Hz)

    def scene(self, scenes: Sequence[Scene]) -> Scene:
        """Of its trial."""
        return next(scene for scene in scenes if scene.name == self.trial)

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Always: what counts is whether it is there."""
        return True

    def reach_cost(self, scenes: Sequence[Scene]) -> float:
        """What a point far from the body's centre of mass costs before the data [nats]."""
        return 0.0


@dataclass(frozen=True)
class UnknownForce(Unknown):
    """A force of any time history on a body in one trial: at a known point, else near its centre of mass."""

    point_body: tuple[float, float, float] | None = None  # [m]
    directions: tuple[float, float, float] = (1.0, 1.0, 1.0)  # how much of the size each axis may have

    about = About(
        "unexplained",
        sentence="Something acts on {target} that no known cause describes.",
        remedy="Look at the video and at what touches the person there.",
    )
    sizes = FORCE_SHARES

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Force splines at the point; without one, moments as far as `REACH` allows as well."""
        if scene.name != self.trial:
            return
        time_histories = self.time_histories(scene)
        each, place = np.full(time_histories.shape[1], eta[0] * scene.weight_N), self.place_ground(scene)
        for axis, size in enumerate(self.directions):
            if size:
                yield Signature(force_columns(place, time_histories, axis), size * each)
        if self.point_body is None:
            for axis in range(3):
                yield Signature(moment_columns(time_histories, axis, self.reach_m(scene)), each)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """Mean and RMS of the force."""
        force = self.force_ground(self.scene(scenes), fit.x)
        mean, rms = force.mean(axis=0), float(np.sqrt((force**2).sum(axis=1).mean()))
        std = float(np.sqrt(np.trace(fit.covariance) / len(fit.x)))
        names = ("mean_force_x_N", "mean_force_y_N", "mean_force_z_N")
        return {n: Estimate(float(m), std) for n, m in zip(names, mean, strict=True)} | {
            "rms_force_N": Estimate(rms, std)
        }

    def force_ground(
        self, scene: Scene, x: Float[np.ndarray, " parameters"]
    ) -> Float[np.ndarray, "frames 3"]:
        """Its time history [N]."""
        time_histories = self.time_histories(scene)
        force = np.zeros((scene.frames, 3))
        along = np.flatnonzero(self.directions)
        force[:, along] = time_histories @ x[: len(along) * time_histories.shape[1]].reshape(len(along), -1).T
        return force

    def along_an_axis(self, scene: Scene) -> "list[UnknownForce]":
        """The least free there is: along one axis, at its point or else at the centre of mass."""
        centre = scene.skeleton.bodies[scene.skeleton.body_index(self.target)].com_body
        point = self.point_body or tuple(centre.tolist())
        return [
            replace(self, point_body=point, directions=tuple(np.eye(3)[axis].tolist())) for axis in range(3)
        ]

    def at_its_point(self, scene: Scene, x: Float[np.ndarray, " parameters"]) -> "UnknownForce":
        """Along its own directions, at the point that its moments speak for (least squares)."""
        time_histories = self.time_histories(scene)
        width = 3 * time_histories.shape[1]
        force, reach_m = self.force_ground(scene, x), self.reach_m(scene)
        moment = reach_m * (time_histories @ x[width : 2 * width].reshape(3, -1).T)
        body = scene.skeleton.body_index(self.target)
        R = scene.R_ground_body[:, body]
        rows = -skew(force) @ R  # r × F = −F × r
        pull = POINT_PULL * np.sqrt((force**2).sum())
        A = np.concatenate([rows.reshape(-1, 3), pull * np.eye(3)])
        offset = np.linalg.lstsq(A, np.concatenate([moment.ravel(), np.zeros(3)]), rcond=None)[0]
        point = scene.skeleton.bodies[body].com_body + offset
        size = np.sqrt((force**2).mean(axis=0))
        directions = np.maximum(size / size.max(), LEAST_DIRECTION)
        return replace(self, point_body=tuple(point.tolist()), directions=tuple(directions.tolist()))

    def reach_cost(self, scenes: Sequence[Scene]) -> float:
        """What a point far from the body's centre of mass costs before the data [nats]."""
        if self.point_body is None:
            return 0.0
        scene = self.scene(scenes)
        centre = scene.skeleton.bodies[scene.skeleton.body_index(self.target)].com_body
        away_m = np.linalg.norm(np.array(self.point_body) - centre)
        return 0.5 * float(away_m / self.reach_m(scene)) ** 2

    def nearest_body(self, scene: Scene) -> str:
        """The body that the point lies in: least distance from its centre of mass, in radii of gyration."""
        if self.point_body is None:
            return self.target
        place = self.place_ground(scene)
        distances = {}
        for b in scene.skeleton.bodies_from_share(LIGHTEST_SHARE):
            body = scene.skeleton.bodies[b]
            away = np.linalg.norm(place - scene.point_ground(b, body.com_body), axis=1).mean()
            distances[body.name] = away / (LEAST_RADIUS_M + _radius_of_gyration_m(body))
        return min(distances, key=lambda name: distances[name] - (OWN_BONUS if name == self.target else 0.0))

    def reach_m(self, scene: Scene) -> float:
        """How far from the body's centre of mass it may act."""
        body = scene.skeleton.bodies[scene.skeleton.body_index(self.target)]
        return REACH * (LEAST_RADIUS_M + _radius_of_gyration_m(body))

    def place_ground(self, scene: Scene) -> Float[np.ndarray, "frames 3"]:
        """Its point, the body's centre of mass where none is known [m]."""
        body = scene.skeleton.body_index(self.target)
        point = self.point_body if self.point_body is not None else scene.skeleton.bodies[body].com_body
        return scene.point_ground(body, np.asarray(point))


def _radius_of_gyration_m(body: Body) -> float:
    return float(np.sqrt(np.trace(body.inertia_body) / 2 / body.mass))


@dataclass(frozen=True)
class UnknownMoment(Unknown):
    """A pure moment of any time history in one trial; the whole body's balance does not tell on which one."""

    about = About(
        "unexplained",
        sentence="A moment turns the body that no known cause describes.",
        remedy="Look for what spins or twists: a wheel, a handle, a plate whose moments are wrong.",
    )
    sizes = MOMENT_LEVERS_M

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Moment splines."""
        if scene.name == self.trial:
            time_histories = self.time_histories(scene)
            each = np.full(time_histories.shape[1], eta[0] * scene.weight_N)
            for axis in range(3):
                yield Signature(moment_columns(time_histories, axis), each)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """RMS of the moment."""
        moment = self.moment_ground(scenes, fit.x)
        std = float(np.sqrt(np.trace(fit.covariance) / len(fit.x)))
        return {"rms_moment_Nm": Estimate(float(np.sqrt((moment**2).sum(axis=1).mean())), std)}

    def moment_ground(
        self, scenes: Sequence[Scene], x: Float[np.ndarray, " parameters"]
    ) -> Float[np.ndarray, "frames 3"]:
        """Its time history [N·m]."""
        return self.time_histories(self.scene(scenes)) @ x.reshape(3, -1).T


def unknown_forces(scenes: Sequence[Scene]) -> list[Unknown]:
    """In each trial a force on each body that is heavy enough to be told apart, and a moment."""
    found: list[Unknown] = []
    for scene in scenes:
        heavy = [scene.skeleton.body_names[b] for b in scene.skeleton.bodies_from_share(LIGHTEST_SHARE)]
        finest = {pieces_of(scene, knot_s): knot_s for knot_s in reversed(KNOTS_S)}
        time_histories: list[tuple[float, float | None]] = [
            (knot_s, None) for knot_s in reversed(finest.values())
        ]
        if (swing_Hz := strongest_frequency_Hz(scene)) is not None:
            time_histories.append((KNOTS_S[0], swing_Hz))
        for knot_s, frequency_Hz in time_histories:
            found += [UnknownForce(name, scene.name, knot_s, frequency_Hz=frequency_Hz) for name in heavy]
            found.append(UnknownMoment("", scene.name, knot_s, frequency_Hz=frequency_Hz))
    return found
