"""Skin movement of the bench's own making: from joint angles and from impacts.

It has no part in common with the noise that the fit assumes (a Gauss-Markov process per coordinate), nor with
the soft tissue of `solver.simulate` (linear in the angles). Each marker moves in its segment's frame by

    Σ_j  a_j sin θ_j + b_j (1 − cos θ_j)     over the joints at both ends of the segment
    + d · ring of the leg's load              a damped oscillator of 7 to 13 Hz, without its slow part

Directions and sizes are drawn per marker, a part of them shared by the segment's markers. Thighs move most,
then shanks and arms, trunk and pelvis, feet least (Leardini A et al. Gait Posture 2005; 21: 212-225). The
result is scaled to a root mean square over all markers and frames, zero in the neutral pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.signal import lsim

from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

LOOSENESS = {"femur": 1.4, "tibia": 1.0, "humerus": 0.9, "torso": 0.8, "pelvis": 0.7}  # of others: 0.6
SHAKES = {"femur": 0.9, "tibia": 1.0, "pelvis": 0.4, "torso": 0.25, "calcn": 0.7}  # of others: 0.3


@dataclass(frozen=True)
class SkinSettings:
    """What the drawn directions are like."""

    shared: float = 0.3  # of the variance, by the markers of a segment: observed along a segment 0.2 to 0.4
    bulge: float = 1.5  # size of the (1 − cos θ) part against the sin θ part
    ring_per_body_weight: float = 4.0  # against the part by angles, per radian: errors then change from frame
    # to frame (0.4 mm at 100 Hz, 6 mm) and forget (0.77 after 50 ms) as recorded ones do in walking
    frequency_Hz: tuple[float, float] = (7.0, 13.0)
    damping_ratio: tuple[float, float] = (0.2, 0.4)
    fine_rate: float = 2000.0  # [Hz] of the oscillator's equation


def skin_movement(
    skeleton: Skeleton,
    marker_bodies: Sequence[int],
    q: Float[np.ndarray, "frames dofs"],
    *,
    times: Float[np.ndarray, " frames"],
    load: Float[np.ndarray, "frames 2"],
    rng: np.random.Generator,
    settings: SkinSettings | None = None,
) -> Float[np.ndarray, "frames markers 3"]:
    """Movement of each marker over the bone, ground frame, of root mean square 1.

    Args:
        skeleton: that moves.
        marker_bodies: index of the body under each marker.
        q: the true coordinates [rad or m].
        times: of the frames [s].
        load: vertical force under the right and the left foot [body weights].
        rng: the same state gives the same person's skin.
        settings: of the drawing.
    """
    of = settings or SkinSettings()
    moved = np.zeros((len(q), len(marker_bodies), 3))
    for body in sorted(set(marker_bodies)):
        own = [m for m, under in enumerate(marker_bodies) if under == body]
        kind = skeleton.bodies[body].name.removesuffix("_r").removesuffix("_l")
        by_angles = np.zeros((len(q), len(own), 3))
        for dof in _next_angles(skeleton, body):
            theta = q[:, skeleton.dofs.index(dof)]
            by_angles += np.sin(theta)[:, None, None] * _directions(len(own), of, rng)
            by_angles += of.bulge * (1 - np.cos(theta))[:, None, None] * _directions(len(own), of, rng)
        ring = _ring(times, _load_above(skeleton.bodies[body].name, load), of, rng)
        along = _directions(len(own), of, rng) * (0.4, 0.2, 0.2) + (0.0, 1.0, 0.0)
        shaken = of.ring_per_body_weight * SHAKES.get(kind, 0.3) * ring[:, None, None] * along
        moved[:, own] = LOOSENESS.get(kind, 0.6) * by_angles + shaken
    R_ground, _ = body_poses(skeleton, q)
    ground = (R_ground[:, list(marker_bodies)] @ moved[..., None])[..., 0]
    return ground / np.sqrt(np.mean((ground**2).sum(axis=2)))


def _next_angles(skeleton: Skeleton, body: int) -> list[str]:
    """Rotations of the joints at both ends of a segment; turning the whole body moves no skin."""
    near = [skeleton.joints[body], *(j for j in skeleton.joints if j.parent == body)]
    names = [a.coordinate for j in near if j.parent >= 0 for a in j.axes if a.kind == "rotation"]
    return list(dict.fromkeys(n for n in names if n is not None and n in skeleton.dofs))


def _directions(markers: int, of: SkinSettings, rng: np.random.Generator) -> Float[np.ndarray, "markers 3"]:
    together, alone = rng.standard_normal(3), rng.standard_normal((markers, 3))
    return np.sqrt(of.shared) * together + np.sqrt(1 - of.shared) * alone


def _load_above(body_name: str, load: Float[np.ndarray, "frames 2"]) -> Float[np.ndarray, " frames"]:
    """The load of the leg that a segment belongs to; of both for the rest of the body."""
    if body_name.endswith("_r"):
        return load[:, 0]
    return load[:, 1] if body_name.endswith("_l") else load.sum(axis=1)


def _ring(
    times: Float[np.ndarray, " frames"],
    load: Float[np.ndarray, " frames"],
    of: SkinSettings,
    rng: np.random.Generator,
) -> Float[np.ndarray, " frames"]:
    """What an oscillator under the load does beyond following it slowly."""
    omega, zeta = 2 * np.pi * rng.uniform(*of.frequency_Hz), rng.uniform(*of.damping_ratio)
    fine = np.linspace(times[0], times[-1], int((times[-1] - times[0]) * of.fine_rate) + 1)
    push = np.interp(fine, times, load)
    change = push - push[0]
    _, follows, _ = lsim(([omega**2], [1.0, 2 * zeta * omega, omega**2]), change, fine - fine[0])
    return np.interp(times, fine, follows - change)
