"""OpenSim 2 and 3 documents: a body holds the joint to its parent, and things name bodies, not frames."""

import numpy as np
from jaxtyping import Float

from solver.skeleton.osim_document import Node, OsimDocument, children
from solver.skeleton.osim_parts import (
    GROUND,
    JointPart,
    MarkerPart,
    ModelParts,
    Placement,
    body_of,
    origin,
    required_name,
)
from solver.skeleton.skeleton import Geometry

INERTIA_TAGS = ("inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz")
ZERO = (0.0, 0.0, 0.0)


def read_parts(document: OsimDocument) -> ModelParts:
    """Bodies, joints and markers of a document of a version before 30500."""
    nodes = [
        node
        for node in document.members(document.model, "BodySet")
        if required_name(document, node).lower() != GROUND
    ]
    names = {required_name(document, node) for node in nodes}
    bodies = tuple(
        body_of(document, node, inertia=_inertia(document, node), geometry=_geometry(document, node))
        for node in nodes
    )
    joints = tuple(
        _joint(document, body, node, names)
        for body in nodes
        for holder in children(body, "Joint")
        for node in children(holder)
    )
    markers = tuple(
        MarkerPart(node=node, frame=origin(_body_name(document, node, "body", names)))
        for node in document.members(document.model, "MarkerSet")
        if node.tag == "Marker"
    )
    return ModelParts(bodies=bodies, joints=joints, markers=markers)


def _inertia(document: OsimDocument, node: Node) -> Float[np.ndarray, "6"]:
    default = None if document.number(node, "mass") > 0 else 0.0
    return _converted(
        np.array(
            [document.number(node, tag, default if i < 3 else 0.0) for i, tag in enumerate(INERTIA_TAGS)]
        )
    )


def _joint(document: OsimDocument, body: Node, node: Node, names: set[str]) -> JointPart:
    def numbers(tag: str) -> Float[np.ndarray, "3"]:
        return _converted(document.numbers(node, tag, 3, default=ZERO))

    own = required_name(document, body)
    base = origin(_body_name(document, node, "parent_body", names))
    parent = base.offset(numbers("location_in_parent"), numbers("orientation_in_parent"))
    child = origin(own).offset(numbers("location"), numbers("orientation"))
    reverse = document.flag(node, "reverse", False)
    return JointPart(
        node=node,
        name=node.get("name") or own,
        parent=child if reverse else parent,
        child=parent if reverse else child,
        coordinates=tuple(document.members(node, "CoordinateSet")),
    )


def _converted(values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Six significant digits: OpenSim 4 keeps no more of the joint frames and inertias of old documents.

    We follow it to the last digit, so that a motion means the same in both programs.
    """
    return np.array([float(f"{value:.6g}") for value in values])


def _body_name(document: OsimDocument, node: Node, tag: str, names: set[str]) -> str:
    name = document.word(node, tag)
    if name.lower() == GROUND:
        return GROUND
    if name not in names:
        raise document.error(
            node,
            f"<{tag}> names '{name}', which is no body of the model; its bodies: {', '.join(sorted(names))}.",
        )
    return name


def _geometry(document: OsimDocument, body: Node) -> tuple[Geometry, ...]:
    """The meshes of a body's VisibleObject, whose scale factors and transform apply on top of theirs."""
    meshes: list[Geometry] = []
    own = origin(required_name(document, body))
    for visible in children(body, "VisibleObject"):
        outer_frame = _transformed(document, visible, own)
        outer_scale = document.numbers(visible, "scale_factors", 3, default=(1.0, 1.0, 1.0))
        for item in document.members(visible, "GeometrySet"):
            frame = _transformed(document, item, outer_frame)
            scale = outer_scale * document.numbers(item, "scale_factors", 3, default=(1.0, 1.0, 1.0))
            meshes.append(Geometry(document.word(item, "geometry_file"), scale, frame.R, frame.p))
        for file in document.words(visible, "geometry_files"):
            meshes.append(Geometry(file, outer_scale, outer_frame.R, outer_frame.p))
    return tuple(meshes)


def _transformed(document: OsimDocument, node: Node, base: Placement) -> Placement:
    rotation_translation = document.numbers(node, "transform", 6, default=(0.0,) * 6)
    return base.offset(rotation_translation[3:], rotation_translation[:3])
