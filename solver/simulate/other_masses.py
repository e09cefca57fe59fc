"""A body that weighs otherwise than the one whose motion is known: loads carried, segments heavier."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm

from solver.simulate.loads import BodyPoint
from solver.simulate.spline_motion import SplineMotion
from solver.skeleton.forward import cross
from solver.skeleton.skeleton import Body, Skeleton

SWING_STEPS_HZ = 2000.0  # [Hz] steps of a wobbling mass's equation
SWING_IN_S = 0.25  # [s] before the first time, in which it swings in


def with_carried_mass(
    skeleton: Skeleton, body: str, mass_kg: float, offset_body: Float[np.ndarray, "3"]
) -> Skeleton:
    """The skeleton with a small heavy thing fixed to a segment at a point of its frame [m]."""
    index = skeleton.body_index(body)
    bodies = list(skeleton.bodies)
    bodies[index] = _join(bodies[index], mass_kg, offset_body)
    return replace(skeleton, bodies=tuple(bodies))


def with_segment_masses(skeleton: Skeleton, factors: dict[str, float]) -> Skeleton:
    """The skeleton with masses and inertias of some segments multiplied; their centres of mass stay."""
    for name in factors:
        skeleton.body_index(name)
    bodies = tuple(
        replace(b, mass=b.mass * factors[b.name], inertia_body=b.inertia_body * factors[b.name])
        if b.name in factors
        else b
        for b in skeleton.bodies
    )
    return replace(skeleton, bodies=bodies)


@dataclass(frozen=True)
class WobblingMass:
    """Part of a segment's mass on a spring and a damper: what its swinging does to the rest.

    The mass hangs in rest at its point when the segment rests; from there it is away by r, which obeys
    r̈ + 2ζω ṙ + ω² r = −p̈ with p the point's place. As an external wrench: what a mass fixed at the point
    would demand less what the swinging one demands.
    """

    point: BodyPoint
    mass_kg: float
    frequency_Hz: float
    damping_ratio: float

    def displacement(
        self, motion: SplineMotion, times: Float[np.ndarray, " times"]
    ) -> tuple[Float[np.ndarray, "times 3"], Float[np.ndarray, "times 3"]]:
        """R [m] and r̈ [m/s²] in the ground frame, from rest before the first time; times evenly spaced."""
        spacing = float(times[1] - times[0])
        finer = max(1, int(np.ceil(spacing * SWING_STEPS_HZ)))
        h = spacing / finer
        lead = int(np.ceil(SWING_IN_S / h))
        fine = times[0] + h * np.arange(-lead, finer * (len(times) - 1) + 1)
        push = -self.point.acceleration(motion, fine)
        omega = 2 * np.pi * self.frequency_Hz
        A = np.array([[0.0, 1.0], [-(omega**2), -2 * self.damping_ratio * omega]])
        state = np.zeros((2, 3))
        states = np.empty((len(fine), 2, 3))
        step, now, slope = _linear_hold(A, h)
        for k in range(len(fine)):
            states[k] = state
            if k + 1 < len(fine):
                state = step @ state + np.outer(now, push[k]) + np.outer(slope, push[k + 1] - push[k])
        kept = slice(lead, None, finer)
        r, rate = states[kept, 0], states[kept, 1]
        return r, push[kept] - 2 * self.damping_ratio * omega * rate - omega**2 * r

    def __call__(
        self, motion: SplineMotion, times: Float[np.ndarray, " times"]
    ) -> Float[np.ndarray, "times 6"]:
        """Force [N] and moment about the ground origin [N·m] on the body whose mass is all fixed."""
        r, swing = self.displacement(motion, times)
        p, p_dd = self.point.position(motion, times), self.point.acceleration(motion, times)
        gravity = self.point.skeleton.gravity
        fixed, moving = self.mass_kg * (p_dd - gravity), self.mass_kg * (p_dd + swing - gravity)
        return np.concatenate([fixed - moving, cross(p, fixed) - cross(p + r, moving)], axis=1)


def _join(body: Body, mass_kg: float, at_body: np.ndarray) -> Body:
    """A segment and a point mass as one (parallel axes)."""
    mass = body.mass + mass_kg
    com = (body.mass * body.com_body + mass_kg * at_body) / mass
    inertia = body.inertia_body.copy()
    for part, where in ((body.mass, body.com_body), (mass_kg, at_body)):
        d = where - com
        inertia = inertia + part * (d @ d * np.eye(3) - np.outer(d, d))
    return replace(body, mass=mass, com_body=com, inertia_body=inertia)


def _linear_hold(
    A: Float[np.ndarray, "2 2"], h: float
) -> tuple[Float[np.ndarray, "2 2"], Float[np.ndarray, "2"], Float[np.ndarray, "2"]]:
    """Exact step of ẋ = A x + (0, u) for u linear over the step: of x, of u at its start, of u's increase."""
    joined = np.zeros((4, 4))
    joined[:2, :2], joined[1, 2], joined[2, 3] = A, 1.0, 1.0 / h
    whole = expm(joined * h)
    return whole[:2, :2], whole[:2, 2], whole[:2, 3]
