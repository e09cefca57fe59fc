"""Joint elements of OpenSim models: which axes they move along, and their coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from solver.common.notes import Kind, Note
from solver.skeleton.functions import (
    Constant,
    CubicSpline,
    Linear,
    PiecewiseLinear,
    Polynomial,
    ScalarFunction,
    Scaled,
)
from solver.skeleton.osim_document import JointPart, Node, OsimDocument, children
from solver.skeleton.skeleton import Axis, Coordinate

AxisKind = Literal["rotation", "translation"]
Motion = Literal["rotation", "translation", "coupled"]

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
TURN_XYZ: tuple[tuple[AxisKind, tuple[float, float, float]], ...] = (
    ("rotation", X),
    ("rotation", Y),
    ("rotation", Z),
)

# One axis per coordinate, in the order of OpenSim's coordinates; child frame against parent frame.
STANDARD_JOINTS: dict[str, tuple[tuple[AxisKind, tuple[float, float, float]], ...]] = {
    "WeldJoint": (),
    "PinJoint": (("rotation", Z),),
    "SliderJoint": (("translation", X),),
    "UniversalJoint": (("rotation", X), ("rotation", Y)),
    "BallJoint": TURN_XYZ,
    "GimbalJoint": TURN_XYZ,
    "FreeJoint": (*TURN_XYZ, ("translation", X), ("translation", Y), ("translation", Z)),
    "PlanarJoint": (("rotation", Z), ("translation", X), ("translation", Y)),
}
CUSTOM_JOINT = "CustomJoint"

DEFAULT_RANGE = (-10.0, 10.0)  # [rad or m] what OpenSim takes when a coordinate names none
SPLINES = ("SimmSpline", "NaturalCubicSpline", "natCubicSpline")  # one spline under its names since SIMM
SUPPORTED = (
    "Constant",
    "LinearFunction",
    *SPLINES,
    "PiecewiseLinearFunction",
    "PolynomialFunction",
    "MultiplierFunction",
)


def find_function(owner: Node, wrapper: str) -> Node | None:
    """The function element that `owner` holds, inside a `wrapper` element or directly under it."""
    for holder in (*children(owner, wrapper), owner):
        for child in children(holder):
            if child.tag == "Constant" or child.tag.endswith(("Function", "Spline")):
                return child
    return None


def function_of(
    document: OsimDocument, node: Node, coordinates: Sequence[str]
) -> tuple[ScalarFunction, str | None]:
    """A function element of the named coordinates, as a function of one of them or of none.

    Raises:
        ModelError: the function is of a kind not supported, or depends on several coordinates.
    """
    if node.tag == "LinearFunction":
        return _linear(document, node, coordinates)
    function = _read(document, node)
    if isinstance(function, Constant):
        return function, None
    if len(coordinates) != 1:
        raise document.error(node, _wrong_number(coordinates))
    return function, coordinates[0]


def _linear(
    document: OsimDocument, node: Node, coordinates: Sequence[str]
) -> tuple[ScalarFunction, str | None]:
    *slopes, intercept = document.numbers(node, "coefficients", len(coordinates) + 1, default=(1.0, 0.0))
    driving = [(name, slope) for name, slope in zip(coordinates, slopes, strict=True) if slope != 0.0]
    if len(driving) > 1:
        raise document.error(node, _wrong_number([name for name, _ in driving]))
    if len(coordinates) == 1:
        return Linear(float(slopes[0]), float(intercept)), coordinates[0]
    if not driving:
        return Constant(float(intercept)), None
    name, slope = driving[0]
    return Linear(float(slope), float(intercept)), name


def _read(document: OsimDocument, node: Node) -> ScalarFunction:
    if node.tag == "Constant":
        return Constant(document.number(node, "value", 0.0))
    if node.tag == "LinearFunction":
        slope, intercept = document.numbers(node, "coefficients", 2, default=(1.0, 0.0))
        return Linear(float(slope), float(intercept))
    if node.tag in SPLINES:
        return CubicSpline(*_knots(document, node))
    if node.tag == "PiecewiseLinearFunction":
        return PiecewiseLinear(*_knots(document, node))
    if node.tag == "PolynomialFunction":
        return Polynomial(tuple(document.numbers(node, "coefficients").tolist()))
    if node.tag == "MultiplierFunction":
        return _multiplied(document, node)
    raise document.error(
        node, f"this kind of function is not supported; use one of {', '.join(SUPPORTED)} in its place."
    )


def _multiplied(document: OsimDocument, node: Node) -> ScalarFunction:
    inner_node = find_function(node, "function")
    if inner_node is None:
        raise document.error(node, "there is no function to multiply inside it.")
    factor = document.number(node, "scale", 1.0)
    inner = _read(document, inner_node)
    return Constant(factor * inner.value) if isinstance(inner, Constant) else Scaled(factor, inner)


def _knots(document: OsimDocument, node: Node) -> tuple[tuple[float, ...], tuple[float, ...]]:
    x, y = document.numbers(node, "x"), document.numbers(node, "y")
    if len(x) != len(y) or len(x) < 2:
        raise document.error(
            node, f"{len(x)} values in <x> and {len(y)} in <y>; it needs as many, at least two."
        )
    if (np.diff(x) <= 0).any():
        raise document.error(node, "the values in <x> must increase.")
    return tuple(x.tolist()), tuple(y.tolist())


def _wrong_number(coordinates: Sequence[str]) -> str:
    if not coordinates:
        return "it varies, but no coordinate drives it; name the coordinate or use a Constant."
    return (
        f"it depends on several coordinates ({', '.join(coordinates)}); "
        "only functions of a single coordinate are supported."
    )


@dataclass(frozen=True)
class JointMotion:
    """How a joint moves: translations first, then rotations, and its coordinates in OpenSim's order."""

    axes: tuple[Axis, ...]
    coordinates: tuple[Coordinate, ...]
    notes: tuple[Note, ...]


def joint_motion(document: OsimDocument, joint: JointPart) -> JointMotion:
    """Read a joint's axes and coordinates.

    Raises:
        ModelError: the joint's type or one of its functions is not supported.
    """
    if joint.node.tag == CUSTOM_JOINT:
        axes, names = _custom_axes(document, joint)
    elif joint.node.tag in STANDARD_JOINTS:
        axes, names = _standard_axes(document, joint)
    else:
        supported = ", ".join((*STANDARD_JOINTS, CUSTOM_JOINT))
        raise document.error(
            joint.node, f"joints of type {joint.node.tag} are not supported; supported are {supported}."
        )
    elements = {node.get("name"): node for node in joint.coordinates}
    coordinates = tuple(_coordinate(document, name, elements.get(name), axes) for name in names)
    notes = [
        Note(
            Kind.OTHER,
            f"coordinate '{node.get('name')}': its prescribed motion is ignored; it is solved for like "
            "any other",
        )
        for node in joint.coordinates
        if document.flag(node, "prescribed", False)
    ]
    driving = {axis.coordinate for axis in axes if not isinstance(axis.function, Constant)}
    notes += [
        Note(Kind.OTHER, f"coordinate '{c.name}' moves nothing; it stays locked")
        for c in coordinates
        if c.name not in driving
    ]
    coordinates = tuple(c if c.name in driving else replace(c, locked=True) for c in coordinates)
    moving = [axis for axis in axes if axis.coordinate or axis.function != Constant(0.0)]
    ordered = sorted(moving, key=lambda axis: axis.kind == "rotation")
    return JointMotion(axes=tuple(ordered), coordinates=coordinates, notes=tuple(notes))


def _standard_axes(document: OsimDocument, joint: JointPart) -> tuple[list[Axis], list[str]]:
    kinds = STANDARD_JOINTS[joint.node.tag]
    # OpenSim names unnamed coordinates so, before the joint has its own name.
    names = [node.get("name") or f"_coord_{i}" for i, node in enumerate(joint.coordinates)]
    names = names or [f"_coord_{i}" for i in range(len(kinds))]
    if len(names) != len(kinds):
        raise document.error(
            joint.node, f"it has {len(names)} coordinates; a {joint.node.tag} has {len(kinds)}."
        )
    axes = [
        Axis(kind, np.array(direction), Linear(1.0, 0.0), name)
        for (kind, direction), name in zip(kinds, names, strict=True)
    ]
    return axes, names


def _custom_axes(document: OsimDocument, joint: JointPart) -> tuple[list[Axis], list[str]]:
    """The six axes of a SpatialTransform, and the coordinates in the order in which the axes name them."""
    transform = document.property(joint.node, "SpatialTransform")
    if transform is None:
        raise document.error(joint.node, "it has no <SpatialTransform>, which says how a CustomJoint moves.")
    elements = {node.get("name"): node for node in transform if isinstance(node, Node)}
    axes: list[Axis] = []
    names: list[str] = []
    for kind in ("rotation", "translation"):
        for number, direction in enumerate((X, Y, Z), start=1):
            node = elements.get(f"{kind}{number}")
            if node is not None:
                axis, driving = transform_axis(document, node, kind, direction)
                axes.append(axis)
                names += [name for name in driving if name not in names]
    unused = [node for node in joint.coordinates if node.get("name") not in names]
    if unused:
        raise document.error(
            unused[0],
            f"no axis of joint '{joint.name}' uses it; name it in the SpatialTransform or remove it.",
        )
    return axes, names


def transform_axis(
    document: OsimDocument, node: Node, kind: AxisKind, default_axis: tuple[float, float, float]
) -> tuple[Axis, list[str]]:
    """An axis of a SpatialTransform, and the coordinates that it names."""
    driving = document.words(node, "coordinates")
    direction = document.numbers(node, "axis", 3, default=default_axis)
    if not direction.any():
        raise document.error(node, "its <axis> is zero; give it a direction.")
    function_node = find_function(node, "function")
    if function_node is None and driving:
        raise document.error(node, f"it names coordinate '{driving[0]}' but has no function of it.")
    if function_node is None:
        return Axis(kind, direction, Constant(0.0), None), driving
    function, coordinate = function_of(document, function_node, driving)
    if coordinate is None and driving:
        coordinate = driving[0]  # a constant of this coordinate: it moves nothing, but belongs to the joint
    return Axis(kind, direction, function, coordinate), driving


def _coordinate(document: OsimDocument, name: str, node: Node | None, axes: list[Axis]) -> Coordinate:
    motion = _motion_type(name, axes)
    if node is None:
        return Coordinate(name=name, motion=motion, default=0.0, range=DEFAULT_RANGE)
    low, high = document.numbers(node, "range", 2, default=DEFAULT_RANGE, infinite=True)
    if low > high:
        raise document.error(
            node, f"its <range> {low:g} {high:g} runs backwards; write the smaller number first."
        )
    return Coordinate(
        name=name,
        motion=motion,
        default=document.number(node, "default_value", 0.0),
        range=(float(low), float(high)),
        clamped=document.flag(node, "clamped", False),
        locked=document.flag(node, "locked", False),
    )


def _motion_type(name: str, axes: list[Axis]) -> Motion:
    """What the coordinate's value is: the displacement of the first axis that follows it one to one."""
    for axis in axes:
        if axis.coordinate == name and isinstance(axis.function, Linear) and abs(axis.function.slope) == 1.0:
            return axis.kind
    return "coupled"
