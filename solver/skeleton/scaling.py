"""Scaling as an immutable operation: a new skeleton at new proportions, with a new mass."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.skeleton.functions import Constant, Linear, Scaled
from solver.skeleton.skeleton import Axis, Body, Joint, Skeleton


def scaled(
    skeleton: Skeleton, factors: Float[np.ndarray, "bodies 3"], mass_kg: float | None
) -> Skeleton:
    """The skeleton with each body's lengths multiplied along the body's axes, as OpenSim's scale tool does.

    Joint locations, joint translations that follow another coordinate, centres of mass, markers and meshes
    scale; segment masses keep their shares.

    Args:
        skeleton: at any scale.
        factors: x, y, z factors of every body.
        mass_kg: total mass afterwards [kg]; None keeps it.
    """
    bodies = tuple(_body(b, f) for b, f in zip(skeleton.bodies, factors, strict=True))
    joints = tuple(
        _joint(j, factors[j.parent] if j.parent >= 0 else np.ones(3), f)
        for j, f in zip(skeleton.joints, factors, strict=True)
    )
    markers = tuple(replace(m, position_body=m.position_body * factors[m.body]) for m in skeleton.markers)
    resized = replace(skeleton, bodies=bodies, joints=joints, markers=markers)
    return resized if mass_kg is None else with_mass(resized, mass_kg)


def with_mass(skeleton: Skeleton, mass_kg: float) -> Skeleton:
    """The skeleton with another total mass [kg]; shares and shapes stay."""
    ratio = mass_kg / skeleton.mass
    bodies = tuple(
        replace(b, mass=b.mass * ratio, inertia_body=b.inertia_body * ratio) for b in skeleton.bodies
    )
    return replace(skeleton, bodies=bodies)


def with_offsets(skeleton: Skeleton, offsets_body: Float[np.ndarray, "markers 3"]) -> Skeleton:
    """The skeleton with its markers moved by `offsets_body` [m] in their bodies' frames."""
    return skeleton.with_markers(
        [
            replace(m, position_body=m.position_body + offset)
            for m, offset in zip(skeleton.markers, offsets_body, strict=True)
        ]
    )


def _body(body: Body, factors: Float[np.ndarray, "3"]) -> Body:
    second = 0.5 * np.trace(body.inertia_body) * np.eye(3) - body.inertia_body
    second = second * np.outer(factors, factors)
    return replace(
        body,
        com_body=body.com_body * factors,
        inertia_body=np.trace(second) * np.eye(3) - second,
        geometry=tuple(
            replace(g, scale=g.scale * factors, p_body_mesh=g.p_body_mesh * factors) for g in body.geometry
        ),
        scale=body.scale * factors,
    )


def _joint(joint: Joint, parent: Float[np.ndarray, "3"], child: Float[np.ndarray, "3"]) -> Joint:
    return replace(
        joint,
        p_parent_frame=joint.p_parent_frame * parent,
        p_child_frame=joint.p_child_frame * child,
        axes=tuple(_axis(a, parent, joint.R_parent_frame) for a in joint.axes),
    )


def _axis(axis: Axis, parent: Float[np.ndarray, "3"], R_parent_frame: Float[np.ndarray, "3 3"]) -> Axis:
    plain = isinstance(axis.function, Linear) and axis.coordinate is not None
    if axis.kind == "rotation" or plain or (isinstance(axis.function, Constant) and axis.function.value == 0):
        return axis
    factor = float(np.abs(axis.axis) @ parent)
    return replace(axis, function=Scaled(factor, axis.function))
