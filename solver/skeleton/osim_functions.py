"""OpenSim's function elements as scalar functions."""

from collections.abc import Sequence

import numpy as np

from solver.skeleton.functions import (
    Constant,
    CubicSpline,
    Linear,
    PiecewiseLinear,
    Polynomial,
    ScalarFunction,
    Scaled,
)
from solver.skeleton.osim_document import Node, OsimDocument, children

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
