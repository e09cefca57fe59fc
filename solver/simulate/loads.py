"""Forces and torques that act on a segment from outside: a handrail, a harness, a rubber band, the air."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.simulate.spline_motion import SplineMotion
from solver.skeleton.forward import ForwardKinematics, cross
from solver.skeleton.skeleton import Skeleton

STENCIL_STEP = 1e-3  # [s] of the differences of exact positions; their error grows with its fourth power

Waves = tuple[tuple[float, float, float], ...]
Series = Float[np.ndarray, "times 3"]
ForceLaw = Callable[[Float[np.ndarray, " times"], Series, Series], Series]
"""Force [N] from times [s], position [m] and velocity [m/s] of the point it acts at; ground frame."""


@dataclass(frozen=True)
class BodyPoint:
    """A point fixed in a segment."""

    skeleton: Skeleton
    body: str
    point_body: Float[np.ndarray, "3"]  # [m]

    def position(self, motion: SplineMotion, times: Float[np.ndarray, " times"]) -> Series:
        """Where it is, ground frame [m]."""
        poses = ForwardKinematics(self.skeleton).poses(motion.derivative(times, 0))
        body = self.skeleton.body_index(self.body)
        return poses.p_ground_body[:, body] + poses.R_ground_body[:, body] @ self.point_body

    def velocity(self, motion: SplineMotion, times: Float[np.ndarray, " times"]) -> Series:
        """How fast it moves [m/s]: fourth-order central differences."""
        far, near = (
            self.position(motion, times + k * STENCIL_STEP) - self.position(motion, times - k * STENCIL_STEP)
            for k in (2, 1)
        )
        return (8 * near - far) / (12 * STENCIL_STEP)

    def acceleration(self, motion: SplineMotion, times: Float[np.ndarray, " times"]) -> Series:
        """Its acceleration [m/s²]: fourth-order central differences."""
        far, near = (
            self.position(motion, times + k * STENCIL_STEP) + self.position(motion, times - k * STENCIL_STEP)
            for k in (2, 1)
        )
        return (16 * near - far - 30 * self.position(motion, times)) / (12 * STENCIL_STEP**2)


@dataclass(frozen=True)
class PointForce:
    """A force at a point of a segment, by some law."""

    point: BodyPoint
    law: ForceLaw

    def force(self, motion: SplineMotion, times: Float[np.ndarray, " times"]) -> Series:
        """On the person, ground frame [N]."""
        return self.law(times, self.point.position(motion, times), self.point.velocity(motion, times))

    def __call__(
        self, motion: SplineMotion, times: Float[np.ndarray, " times"]
    ) -> Float[np.ndarray, "times 6"]:
        """Force [N] and moment about the ground origin [N·m]."""
        force = self.force(motion, times)
        return np.concatenate([force, cross(self.point.position(motion, times), force)], axis=1)


@dataclass(frozen=True)
class BodyTorque:
    """A pure torque, given over time in a segment's own axes or in the ground's."""

    skeleton: Skeleton
    body: str
    time_history: Callable[[Float[np.ndarray, " times"]], Series]  # [N·m]
    turns_with_body: bool

    def __call__(
        self, motion: SplineMotion, times: Float[np.ndarray, " times"]
    ) -> Float[np.ndarray, "times 6"]:
        """Force (none) and moment [N·m]."""
        torque = self.time_history(times)
        if self.turns_with_body:
            R = body_rotation(self.skeleton, self.body, motion, times)
            torque = (R @ torque[..., None])[..., 0]
        return np.concatenate([np.zeros_like(torque), torque], axis=1)


def body_rotation(
    skeleton: Skeleton, body: str, motion: SplineMotion, times: Float[np.ndarray, " times"]
) -> Float[np.ndarray, "times 3 3"]:
    """Orientation of a segment in the ground frame."""
    poses = ForwardKinematics(skeleton).poses(motion.derivative(times, 0))
    return poses.R_ground_body[:, skeleton.body_index(body)]


def constant(force_ground: Float[np.ndarray, "3"]) -> ForceLaw:
    """The same force throughout [N]."""
    return lambda times, position, velocity: np.tile(force_ground, (len(times), 1))


def ease(
    force_ground: Float[np.ndarray, "3"], since: float, until: float, ramp: float, waves: Waves = ()
) -> ForceLaw:
    """A push from `since` to `until` [s], eased in and out over `ramp` [s].

    Args:
        force_ground: at its height [N].
        since: first time [s].
        until: last time [s].
        ramp: [s].
        waves: relative amplitude, frequency [Hz] and phase [rad] of each swelling of the push.
    """

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        edge = np.clip(np.minimum(times - since, until - times) / ramp, 0.0, 1.0)
        time_history = edge * edge * (3 - 2 * edge)
        for amplitude, frequency, phase in waves:
            time_history = time_history * (1 + amplitude * np.sin(2 * np.pi * frequency * times + phase))
        return time_history[:, None] * force_ground

    return law


def spring(anchor_ground: Float[np.ndarray, "3"], stiffness: float, rest_length: float) -> ForceLaw:
    """A band that pulls towards its anchor when longer than its rest length [N/m, m], and never pushes."""

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        towards = anchor_ground - position
        length = np.linalg.norm(towards, axis=1, keepdims=True)
        return stiffness * np.maximum(length - rest_length, 0.0) * towards / length

    return law


def drag(coefficient: float, exponent: float = 1.0) -> ForceLaw:
    """Against the velocity: coefficient × speed^exponent [N/(m/s)^exponent]."""

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        return -coefficient * speed ** (exponent - 1) * velocity

    return law
