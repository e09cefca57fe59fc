"""Skeletons as OpenSim 4 model files: bodies, joints, couplings, markers and meshes, without muscles."""

import re
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from jaxtyping import Float

from solver.capture.atomic import write_whole
from solver.capture.subject.measured_files import MARK
from solver.common.errors import ModelError
from solver.skeleton.functions import (
    Constant,
    CubicSpline,
    Linear,
    PiecewiseLinear,
    Polynomial,
    ScalarFunction,
    Scaled,
)
from solver.skeleton.osim_document import property_text
from solver.skeleton.rotations import body_fixed_angles, rotation_about
from solver.skeleton.skeleton import Axis, Body, Coordinate, Geometry, Joint, Marker, Skeleton

VERSION = "40000"  # OpenSim 4.0 and every later one read it
GROUND_PATH = "/ground"


def write_skeleton(skeleton: Skeleton, path: Path | str) -> None:
    """Write a model that OpenSim 4 opens and that moves, weighs and carries its markers as the skeleton does.

    Joints become custom or weld joints, since scaling can leave any joint in need of its own axes.

    Raises:
        ModelError: a function of the skeleton has no form in OpenSim.
        CaptureError: the file cannot be written.
    """
    write_whole(Path(path), skeleton_text(skeleton))


def skeleton_text(skeleton: Skeleton) -> str:
    """The model file that `write_skeleton` writes, for formats that carry it inside themselves.

    Raises:
        ModelError: a function of the skeleton has no form in OpenSim.
    """
    document = Element("OpenSimDocument", Version=VERSION)
    model = SubElement(document, "Model", name=component_name(skeleton.name))
    SubElement(model, "credits").text = MARK
    SubElement(model, "Ground", name="ground")
    _property(model, "gravity", skeleton.gravity)
    _property(model, "length_units", "meters")
    _property(model, "force_units", "N")
    bodies = _objects(model, "BodySet")
    for body in skeleton.bodies:
        _write_body(bodies, body)
    joints = _objects(model, "JointSet")
    for index in joint_order(skeleton):
        _write_joint(joints, skeleton, index)
    constraints = _objects(model, "ConstraintSet")
    for coordinate in skeleton.coordinates:
        _write_coupling(constraints, coordinate)
    markers = _objects(model, "MarkerSet")
    for marker in skeleton.markers:
        _write_marker(markers, marker, skeleton)
    indent(document, "\t")
    return tostring(document, encoding="UTF-8", xml_declaration=True).decode()


# ---- bodies and markers ---------------------------------------------------------------------------------


def _write_body(bodies: Element, body: Body) -> None:
    node = SubElement(bodies, "Body", name=body.name)
    if all(_is_identity(mesh.R_body_mesh, mesh.p_body_mesh) for mesh in body.geometry):
        _write_meshes(node, body.name, body.geometry)
    else:
        frames = SubElement(node, "components")
        for i, mesh in enumerate(body.geometry, start=1):
            name = f"{body.name}_geom_frame_{i}"
            frame = _write_frame(frames, name, _body_path(body.name), mesh.R_body_mesh, mesh.p_body_mesh)
            _write_meshes(frame, f"{body.name}_{i}", (mesh,))
    inertia = body.inertia_body
    _property(node, "mass", body.mass)
    _property(node, "mass_center", body.com_body)
    _property(node, "inertia", [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]])


def _write_meshes(owner: Element, prefix: str, meshes: tuple[Geometry, ...]) -> None:
    attached = SubElement(owner, "attached_geometry")
    for i, mesh in enumerate(meshes, start=1):
        node = SubElement(attached, "Mesh", name=f"{prefix}_geom_{i}")
        _property(node, "socket_frame", "..")
        _property(node, "scale_factors", mesh.scale)
        _property(node, "mesh_file", mesh.file)


def _write_marker(markers: Element, marker: Marker, skeleton: Skeleton) -> None:
    node = SubElement(markers, "Marker", name=component_name(marker.name))
    _property(node, "socket_parent_frame", _body_path(skeleton.bodies[marker.body].name))
    _property(node, "location", marker.position_body)
    _property(node, "fixed", marker.fixed)


def _write_frame(
    owner: Element, name: str, parent_path: str, R: Float[np.ndarray, "3 3"], p: Float[np.ndarray, "3"]
) -> Element:
    frame = SubElement(owner, "PhysicalOffsetFrame", name=name)
    _property(frame, "socket_parent", parent_path)
    _property(frame, "translation", p)
    _property(frame, "orientation", body_fixed_angles(R))
    return frame


# ---- joints ---------------------------------------------------------------------------------------------


def joint_order(skeleton: Skeleton) -> list[int]:
    """Joints in the order of their coordinates, since OpenSim lists coordinates joint by joint."""
    rank = {c.name: i for i, c in enumerate(skeleton.coordinates)}
    owned = [coordinate_names(joint) for joint in skeleton.joints]
    written = {name for names in owned for name in names}
    orphans = [name for name in rank if name not in written]
    if orphans:
        raise ModelError(f"{skeleton.name}: no joint uses coordinate '{orphans[0]}'; OpenSim cannot hold it.")
    return sorted(range(len(owned)), key=lambda i: min((rank[name] for name in owned[i]), default=-1))


def coordinate_names(joint: Joint) -> list[str]:
    """The joint's coordinates as OpenSim orders them: as its rotations, then its translations name them."""
    axes = [*_of_kind(joint, "rotation"), *_of_kind(joint, "translation")]
    return list(dict.fromkeys(axis.coordinate for axis in axes if axis.coordinate is not None))


def _of_kind(joint: Joint, kind: str) -> list[Axis]:
    return [axis for axis in joint.axes if axis.kind == kind]


def _write_joint(joints: Element, skeleton: Skeleton, index: int) -> None:
    joint, body = skeleton.joints[index], skeleton.bodies[index].name
    parent = skeleton.bodies[joint.parent].name if joint.parent >= 0 else None
    parent_frame, child_frame = f"{parent or 'ground'}_offset", f"{body}_offset"
    names = coordinate_names(joint)
    node = SubElement(joints, "CustomJoint" if names else "WeldJoint", name=joint.name)
    _property(node, "socket_parent_frame", parent_frame)
    _property(node, "socket_child_frame", child_frame)
    frames = Element("frames")
    R, p = (joint.R_parent_frame, joint.p_parent_frame) if names else _displaced(joint)
    _write_frame(frames, parent_frame, _body_path(parent), R, p)
    _write_frame(frames, child_frame, _body_path(body), joint.R_child_frame, joint.p_child_frame)
    if names:
        coordinates = SubElement(node, "coordinates")
        table = {c.name: c for c in skeleton.coordinates}
        for name in names:
            _write_coordinate(coordinates, table[name])
    node.append(frames)
    if names:
        _write_transform(node, skeleton, joint)


def _displaced(joint: Joint) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    """The parent frame, moved by axes that stand still."""
    R, p = joint.R_parent_frame, joint.p_parent_frame
    for axis in joint.axes:
        unit = axis.axis / np.linalg.norm(axis.axis)
        displacement = axis.function(np.zeros(1))[0]
        if axis.kind == "rotation":
            R = R @ rotation_about(unit, displacement)[0]
        else:
            p = p + R @ unit * displacement[0]
    return R, p


def _write_transform(node: Element, skeleton: Skeleton, joint: Joint) -> None:
    transform = SubElement(node, "SpatialTransform")
    for kind in ("rotation", "translation"):
        moving = _of_kind(joint, kind)
        if len(moving) > 3:
            raise ModelError(f"{skeleton.name}: joint '{joint.name}' has more than three axes of {kind}.")
        for i, direction in enumerate(_three_axes([axis.axis for axis in moving])):
            element = SubElement(transform, "TransformAxis", name=f"{kind}{i + 1}")
            axis = moving[i] if i < len(moving) else None
            _property(element, "coordinates", (axis.coordinate if axis else None) or "")
            _property(element, "axis", direction)
            _write_function(element, axis.function if axis else Constant(0.0), joint.name)


def _three_axes(axes: list[Float[np.ndarray, "3"]]) -> list[Float[np.ndarray, "3"]]:
    """The axes, followed by unit vectors across them to make three independent ones."""
    across = np.linalg.svd(np.reshape(axes, (-1, 3)))[2][len(axes) :]
    return [*axes, *across]


def _write_coordinate(coordinates: Element, coordinate: Coordinate) -> None:
    node = SubElement(coordinates, "Coordinate", name=coordinate.name)
    _property(node, "default_value", coordinate.default)
    _property(node, "range", coordinate.range)
    _property(node, "clamped", coordinate.clamped)
    _property(node, "locked", coordinate.locked)


def _write_coupling(constraints: Element, coordinate: Coordinate) -> None:
    if coordinate.coupling is None:
        return
    node = SubElement(constraints, "CoordinateCouplerConstraint", name=f"{coordinate.name}_coupling")
    _property(node, "isEnforced", True)
    _write_function(SubElement(node, "coupled_coordinates_function"), coordinate.coupling, coordinate.name)
    _property(node, "independent_coordinate_names", coordinate.coupled_to or "")
    _property(node, "dependent_coordinate_name", coordinate.name)
    _property(node, "scale_factor", 1.0)


# ---- functions and properties ---------------------------------------------------------------------------


def _write_function(owner: Element, function: ScalarFunction, user: str) -> None:
    match function:
        case Constant(value):
            _property(SubElement(owner, "Constant", name="function"), "value", value)
        case Linear(slope, intercept):
            _property(
                SubElement(owner, "LinearFunction", name="function"), "coefficients", (slope, intercept)
            )
        case Polynomial(coefficients):
            _property(SubElement(owner, "PolynomialFunction", name="function"), "coefficients", coefficients)
        case CubicSpline(x, y):
            _write_knots(SubElement(owner, "SimmSpline", name="function"), x, y)
        case PiecewiseLinear(x, y):
            _write_knots(SubElement(owner, "PiecewiseLinearFunction", name="function"), x, y)
        case Scaled(factor, inner):
            node = SubElement(owner, "MultiplierFunction", name="function")
            _write_function(SubElement(node, "function"), inner, user)
            _property(node, "scale", factor)
        case _:
            raise ModelError(
                f"'{user}' moves by a {type(function).__name__}, which OpenSim has no function for."
            )


def _write_knots(node: Element, x: tuple[float, ...], y: tuple[float, ...]) -> None:
    _property(node, "x", x)
    _property(node, "y", y)


def _objects(model: Element, tag: str) -> Element:
    return SubElement(SubElement(model, tag, name=tag.lower()), "objects")


def _property(owner: Element, tag: str, value: object) -> None:
    SubElement(owner, tag).text = property_text(value)


def component_name(name: str) -> str:
    """The name without the characters that OpenSim refuses in components' names."""
    return re.sub(r"[\\/*+\s]", "_", name)


def _body_path(name: str | None) -> str:
    return GROUND_PATH if name is None else f"/bodyset/{name}"


def _is_identity(R: Float[np.ndarray, "3 3"], p: Float[np.ndarray, "3"]) -> bool:
    return bool((np.eye(3) == R).all() and not p.any())
