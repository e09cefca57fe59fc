"""Who is recorded: a body that differs from the tables as people do, its skin, and its markers."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.simulate.simulated_sole import Sole, sole_of
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.scaling import scaled, with_offsets
from solver.skeleton.segment_tables import Sex, lengths
from solver.skeleton.skeleton import Skeleton

FEET = ("talus", "calcn", "toes")


@dataclass(frozen=True)
class Person:
    """What is told about a person, and how far the person is from the tables (standard deviations)."""

    mass_kg: float = 71.0
    height_m: float = 1.74
    sex: Sex | None = None
    length_scatter: float = 0.02  # of each segment's length; feet keep theirs
    mass_scatter: float = 0.04  # of each segment's mass
    com_scatter_m: float = 0.004  # of each segment's centre of mass
    bony_scatter_m: float = 0.005  # of a marker on a bony landmark
    cluster_scatter_m: float = 0.015  # of a marker on soft parts, which nobody places twice alike
    bony_softness_m_per_rad: float = 0.005  # skin over bone moves this much a radian of the next joints
    cluster_softness_m_per_rad: float = 0.014
    segment_softness_m_per_rad: float = 0.0  # all markers of a segment together


@dataclass(frozen=True)
class TrueBody:
    """The person's skeleton; `softness[m, :, d]` moves marker m in its body's frame with dof d [m/rad]."""

    skeleton: Skeleton
    sole: Sole
    softness: Float[np.ndarray, "markers 3 dofs"]

    def markers(self, q: Float[np.ndarray, "frames dofs"]) -> Float[np.ndarray, "frames markers 3"]:
        """Where the markers are, skin and all, ground frame [m]."""
        kinematics = ForwardKinematics(self.skeleton)
        poses = kinematics.poses(q)
        shift = np.einsum("mid,td->tmi", self.softness, q)
        R_ground = poses.R_ground_body[:, kinematics.marker_bodies]
        return kinematics.markers(poses) + (R_ground @ shift[..., None])[..., 0]


def body_of(person: Person, rng: np.random.Generator) -> TrueBody:
    """Draw a person's body; left and right are alike but for the markers."""
    skeleton = default_skeleton(mass_kg=person.mass_kg, height_m=person.height_m, sex=person.sex)
    shape_rng, mass_rng, marker_rng, skin_rng, soft_tissue_rng = rng.spawn(5)
    skeleton = _with_lengths(skeleton, person, shape_rng)
    skeleton = _with_masses(skeleton, person, mass_rng)
    scatter = np.where([m.fixed for m in skeleton.markers], person.bony_scatter_m, person.cluster_scatter_m)
    skeleton = with_offsets(skeleton, scatter[:, None] * marker_rng.standard_normal((len(scatter), 3)))
    softness = _softness(skeleton, person, skin_rng) + _soft_tissue(skeleton, person, soft_tissue_rng)
    return TrueBody(skeleton, sole_of(person.height_m, person.sex), softness)


def _with_lengths(skeleton: Skeleton, person: Person, rng: np.random.Generator) -> Skeleton:
    draws = {name: float(np.exp(person.length_scatter * rng.standard_normal())) for name in _kinds(skeleton)}
    of = lengths(person.height_m, person.sex)
    upright = {"femur": of.thigh, "tibia": of.shank, "pelvis": of.navel_above_hips}
    upright["torso"] = of.stature - of.ankle_height - sum(upright.values())
    excess = sum(draws[name] * length for name, length in upright.items()) / (of.stature - of.ankle_height)
    for name in upright:  # the stature is measured
        draws[name] /= excess
    draws["patella"], draws["radius"] = draws["femur"], draws["ulna"]
    factors = [1.0 if _kind(name) in FEET else draws[_kind(name)] for name in skeleton.body_names]
    resized = scaled(skeleton, np.repeat(np.array(factors)[:, None], 3, axis=1), person.mass_kg)
    # stand on the soles again: the ankles keep their height
    ankle = skeleton.body_index("talus_r")
    heights = [
        ForwardKinematics(s).poses(skeleton.default_q[None]).p_ground_body[0, ankle, 1]
        for s in (skeleton, resized)
    ]
    lift = heights[0] - heights[1]
    coordinates = tuple(
        replace(c, default=c.default + lift) if c.name == "pelvis_ty" else c for c in resized.coordinates
    )
    return replace(resized, coordinates=coordinates)


def _with_masses(skeleton: Skeleton, person: Person, rng: np.random.Generator) -> Skeleton:
    ratios = {name: float(np.exp(person.mass_scatter * rng.standard_normal())) for name in _kinds(skeleton)}
    shifts = {name: person.com_scatter_m * rng.standard_normal(3) * (1, 1, 0) for name in _kinds(skeleton)}
    total = sum(body.mass * ratios[_kind(body.name)] for body in skeleton.bodies)
    bodies = []
    for body in skeleton.bodies:
        ratio = ratios[_kind(body.name)] * person.mass_kg / total
        small = 0.2 if _kind(body.name) in (*FEET, "patella") else 1.0
        bodies.append(
            replace(
                body,
                mass=body.mass * ratio,
                inertia_body=body.inertia_body * ratio,
                com_body=body.com_body + small * shifts[_kind(body.name)],
            )
        )
    return replace(skeleton, bodies=tuple(bodies))


def _softness(skeleton: Skeleton, person: Person, rng: np.random.Generator) -> np.ndarray:
    """Each marker follows the rotations of its own body's joint and of the joints that hang on that body."""
    softness = np.zeros((len(skeleton.markers), 3, len(skeleton.dofs)))
    for m, marker in enumerate(skeleton.markers):
        names = _next_angles(skeleton, marker.body)
        size = person.bony_softness_m_per_rad if marker.fixed else person.cluster_softness_m_per_rad
        for d, dof in enumerate(skeleton.dofs):
            if dof in names:
                softness[m, :, d] = size / np.sqrt(3) * rng.standard_normal(3)
    return softness


def _soft_tissue(skeleton: Skeleton, person: Person, rng: np.random.Generator) -> np.ndarray:
    """What moves a segment's markers together, as soft tissue slides over bone, with the same rotations."""
    softness = np.zeros((len(skeleton.markers), 3, len(skeleton.dofs)))
    if not person.segment_softness_m_per_rad:
        return softness
    for body in range(len(skeleton.bodies)):
        own = [m for m, marker in enumerate(skeleton.markers) if marker.body == body]
        names = _next_angles(skeleton, body)
        for d, dof in enumerate(skeleton.dofs):
            direction = rng.standard_normal(3)
            if dof in names:
                softness[own, :, d] = (
                    person.segment_softness_m_per_rad
                    * direction
                    / np.linalg.norm(direction)
                    / np.sqrt(len(names))
                )
    return softness


def _next_angles(skeleton: Skeleton, body: int) -> set[str | None]:
    """The rotations of a body's own joint and of those that hang on it; not the root's."""
    near = [skeleton.joints[body], *(j for j in skeleton.joints if j.parent == body)]
    return {axis.coordinate for j in near if j.parent >= 0 for axis in j.axes if axis.kind == "rotation"}


def _kind(body_name: str) -> str:
    return body_name[:-2] if body_name.endswith(("_r", "_l")) else body_name


def _kinds(skeleton: Skeleton) -> list[str]:
    return list(dict.fromkeys(_kind(name) for name in skeleton.body_names))
