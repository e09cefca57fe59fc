"""Scaling a skeleton to a subject, with OpenSim's rules, and moving its markers."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.skeleton.functions import Linear, multiply_function
from solver.skeleton.skeleton import Axis, Body, Geometry, Joint, Skeleton

UNIFORM = 1e-13  # relative spread below which three factors count as one: rounding


def scaled(
    skeleton: Skeleton, factors: Float[np.ndarray, "bodies 3"], mass_kg: float | None = None
) -> Skeleton:
    """The skeleton at another size, as OpenSim's scale tool does it.

    Joint frames, centres of mass, markers and meshes follow the factors of their body; the translations of a
    joint follow those of its parent body, unless a coordinate is that translation itself. Masses keep their
    distribution.

    Args:
        skeleton: at any scale; its factors multiply with these.
        factors: along the axes of each body's frame, relative to the skeleton as it is.
        mass_kg: total mass afterwards [kg]; None leaves the masses as they are.

    Raises:
        ModelError: a factor is not positive, or the mass is not.
    """
    factors = np.asarray(factors, dtype=float)
    if factors.shape != (len(skeleton.bodies), 3) or not (np.isfinite(factors) & (factors > 0)).all():
        raise ModelError(f"{skeleton.name}: scale factors must be positive, three for each body.")
    resized = replace(
        skeleton,
        bodies=tuple(_body(body, f) for body, f in zip(skeleton.bodies, factors, strict=True)),
        joints=tuple(_joint(joint, i, factors) for i, joint in enumerate(skeleton.joints)),
        markers=tuple(replace(m, position_body=m.position_body * factors[m.body]) for m in skeleton.markers),
    )
    return resized if mass_kg is None else with_mass(resized, mass_kg)


def with_mass(skeleton: Skeleton, mass_kg: float) -> Skeleton:
    """The skeleton with another total mass [kg]; each body keeps its share, and inertias follow.

    Raises:
        ModelError: the mass is not positive, or the skeleton has none to distribute.
    """
    if not (np.isfinite(mass_kg) and mass_kg > 0):
        raise ModelError(
            f"{skeleton.name}: a body mass of {mass_kg:g} kg cannot be; give the subject's mass."
        )
    if skeleton.mass <= 0:
        raise ModelError(f"{skeleton.name}: no body of the model has a mass; there are no shares to keep.")
    ratio = mass_kg / skeleton.mass
    return replace(
        skeleton,
        bodies=tuple(
            replace(b, mass=b.mass * ratio, inertia_body=b.inertia_body * ratio) for b in skeleton.bodies
        ),
    )


def with_offsets(skeleton: Skeleton, offsets: Float[np.ndarray, "markers 3"]) -> Skeleton:
    """The skeleton with its markers moved.

    Args:
        skeleton: at any scale.
        offsets: of each marker in its body's frame [m].
    """
    pairs = zip(skeleton.markers, offsets, strict=True)
    return replace(
        skeleton,
        markers=tuple(replace(marker, position_body=marker.position_body + d) for marker, d in pairs),
    )


def scaled_inertia(
    inertia: Float[np.ndarray, "3 3"], mass: float, factors: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3 3"]:
    """Inertia [kg·m²] of a body stretched by `factors` at constant mass [kg].

    Exact for equal factors. Otherwise the moments are those of a cylinder about the axis of the smallest one,
    with the same mass and length, its section stretched by the geometric mean of the other two factors.
    Products follow the factors of their two axes.
    """
    if np.ptp(factors) <= UNIFORM * factors.max():
        return inertia * factors[0] ** 2
    if mass <= 0:
        return np.zeros((3, 3))
    axis = int(np.argmin(np.diag(inertia)))
    across = [i for i in range(3) if i != axis]
    radius_squared = max(0.0, 2 * inertia[axis, axis] / mass)
    length_squared = max(0.0, 12 * (inertia[across[0], across[0]] / mass - radius_squared / 4))
    radius_squared *= factors[across[0]] * factors[across[1]]
    length_squared *= factors[axis] ** 2
    stretched = inertia * np.outer(factors, factors)
    stretched[axis, axis] = mass * radius_squared / 2
    for i in across:
        stretched[i, i] = mass * (length_squared / 12 + radius_squared / 4)
    return stretched


def stretched_bone(body: Body, factors: Float[np.ndarray, "3"]) -> Body:
    """The body with its meshes, and what an export moves with them, at another size; its mass stays."""
    return replace(body, geometry=tuple(_mesh(m, factors) for m in body.geometry), scale=body.scale * factors)


def _body(body: Body, factors: Float[np.ndarray, "3"]) -> Body:
    return replace(
        stretched_bone(body, factors),
        com_body=body.com_body * factors,
        inertia_body=scaled_inertia(body.inertia_body, body.mass, factors),
    )


def _mesh(mesh: Geometry, factors: Float[np.ndarray, "3"]) -> Geometry:
    return replace(mesh, scale=mesh.scale * factors, p_body_mesh=mesh.p_body_mesh * factors)


def _joint(joint: Joint, body: int, factors: Float[np.ndarray, "bodies 3"]) -> Joint:
    parent = factors[joint.parent] if joint.parent >= 0 else np.ones(3)
    return replace(
        joint,
        p_parent_frame=joint.p_parent_frame * parent,
        p_child_frame=joint.p_child_frame * factors[body],
        axes=tuple(_axis(axis, parent) for axis in joint.axes),
    )


def _axis(axis: Axis, factors: Float[np.ndarray, "3"]) -> Axis:
    return replace(axis, function=multiply_function(axis.function, displacement_factor(axis, factors)))


def displacement_factor(axis: Axis, factors: Float[np.ndarray, "3"]) -> float:
    """Translations grow with the parent body, by its factors; one that is a coordinate itself does not."""
    if axis.kind == "rotation" or axis.function == Linear(1.0, 0.0):
        return 1.0
    return float(np.linalg.norm(axis.axis * factors) / np.linalg.norm(axis.axis))
