"""Scalar functions: derivatives against finite differences, values against OpenSim."""

import numpy as np
import pytest

from solver.skeleton.functions import (
    Composed,
    Constant,
    CubicSpline,
    CubicTable,
    Linear,
    PiecewiseLinear,
    Polynomial,
    Scaled,
    multiply_function,
    simplified,
)

RNG = np.random.default_rng(5)
KNOTS = {n: tuple(np.sort(RNG.uniform(-2, 2, n))) for n in (2, 3, 4, 5, 12)}
HEIGHTS = {n: tuple(RNG.normal(size=n)) for n in KNOTS}
SPLINES = [CubicSpline(KNOTS[n], HEIGHTS[n]) for n in KNOTS]
SMOOTH = [
    Constant(0.7),
    Linear(-1.5, 0.2),
    Polynomial((0.3, -1.0, 0.5, 2.0)),
    Scaled(-2.5, Polynomial((1.0, 0.0, -1.0))),
    Composed(Polynomial((1.0, 0.0, 1.0)), Polynomial((0.2, 1.0, -0.5))),
    *SPLINES,
]


@pytest.mark.parametrize("function", SMOOTH, ids=lambda f: type(f).__name__)
def test_derivatives_match_finite_differences(function):
    x, step = np.random.default_rng(6).uniform(-4, 4, 200), 1e-6
    ahead, behind = function(x + step), function(x - step)
    smooth = np.abs(ahead[2] - behind[2]) < 1e-2  # no knot between the two points
    _, slope, curvature = function(x)
    np.testing.assert_allclose(
        slope[smooth], ((ahead[0] - behind[0]) / (2 * step))[smooth], rtol=1e-6, atol=1e-5
    )
    np.testing.assert_allclose(
        curvature[smooth], ((ahead[1] - behind[1]) / (2 * step))[smooth], rtol=1e-6, atol=1e-5
    )
    assert smooth.mean() > 0.9


@pytest.mark.parametrize("spline", SPLINES, ids=lambda s: f"{len(s.x)} knots")
def test_a_spline_passes_through_its_knots_and_goes_on_straight(spline):
    x, y = np.array(spline.x), np.array(spline.y)
    np.testing.assert_allclose(spline(x)[0], y, atol=1e-12)
    _, end_slope, _ = spline(x[-1:])
    value, slope, curvature = spline(x[-1:] + 3.0)
    np.testing.assert_allclose(value, y[-1] + 3.0 * end_slope, atol=1e-9)
    np.testing.assert_allclose(slope, end_slope)
    assert curvature == 0.0


def test_a_spline_through_a_cubic_is_the_cubic():
    cubic = Polynomial((0.5, -1.0, 0.3, 2.0))
    knots = np.array([-1.0, -0.2, 0.1, 0.9, 1.4, 2.0])
    spline = CubicSpline(tuple(knots), tuple(cubic(knots)[0]))
    x = np.linspace(-1, 2, 50)
    for ours, exact in zip(spline(x), cubic(x), strict=True):
        np.testing.assert_allclose(ours, exact, atol=1e-10)


def test_straight_lines_between_knots_extend_beyond_them():
    line = PiecewiseLinear((0.0, 1.0, 3.0), (0.0, 2.0, 1.0))
    value, slope, curvature = line(np.array([-1.0, 0.5, 2.0, 5.0]))
    np.testing.assert_allclose(value, [-2.0, 1.0, 1.5, 0.0])
    np.testing.assert_allclose(slope, [2.0, 2.0, -0.5, -0.5])
    np.testing.assert_allclose(curvature, 0.0)


def test_multiples_stay_single():
    assert multiply_function(Constant(2.0), 3.0) == Constant(6.0)
    assert multiply_function(Scaled(2.0, Linear(1.0, 0.0)), 3.0) == Scaled(6.0, Linear(1.0, 0.0))
    assert multiply_function(Linear(1.0, 0.0), 1.0) == Linear(1.0, 0.0)


@pytest.mark.opensim
@pytest.mark.parametrize("knots", KNOTS)
def test_splines_equal_opensims_inside_and_outside_the_knots(opensim, knots):
    theirs = opensim.SimmSpline()
    for x, y in zip(KNOTS[knots], HEIGHTS[knots], strict=True):
        theirs.addPoint(x, y)
    _assert_equal(opensim, CubicSpline(KNOTS[knots], HEIGHTS[knots]), theirs)


@pytest.mark.opensim
@pytest.mark.parametrize("knots", KNOTS)
def test_piecewise_lines_equal_opensims(opensim, knots):
    theirs = opensim.PiecewiseLinearFunction()
    for x, y in zip(KNOTS[knots], HEIGHTS[knots], strict=True):
        theirs.addPoint(x, y)
    _assert_equal(opensim, PiecewiseLinear(KNOTS[knots], HEIGHTS[knots]), theirs)


@pytest.mark.opensim
def test_polynomials_and_multiples_equal_opensims(opensim):
    coefficients = opensim.Vector(4, 0.0)
    for i, value in enumerate((0.3, -1.0, 0.5, 2.0)):
        coefficients.set(i, value)
    polynomial = opensim.PolynomialFunction()
    polynomial.setCoefficients(coefficients)
    _assert_equal(opensim, Polynomial((0.3, -1.0, 0.5, 2.0)), polynomial)
    line = opensim.LinearFunction(-1.5, 0.2)
    _assert_equal(opensim, Linear(-1.5, 0.2), line)


def _assert_equal(opensim, ours, theirs):
    first, second = (0,), (0, 0)  # no StdVectorInt: ezc3d's, when loaded first, is taken for OpenSim's
    points = np.random.default_rng(7).uniform(-4, 4, 100)
    vectors = [opensim.Vector(1, float(x)) for x in points]
    value, slope, curvature = ours(points)
    np.testing.assert_allclose(value, [theirs.calcValue(x) for x in vectors], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(
        slope, [theirs.calcDerivative(first, x) for x in vectors], rtol=1e-10, atol=1e-10
    )
    np.testing.assert_allclose(
        curvature, [theirs.calcDerivative(second, x) for x in vectors], rtol=1e-10, atol=1e-9
    )


def test_splines_at_once_are_each_by_itself():
    x = np.random.default_rng(7).uniform(-4, 4, (50, len(SPLINES)))
    each = [spline(column) for spline, column in zip(SPLINES, x.T, strict=True)]
    np.testing.assert_array_equal(CubicTable(SPLINES)(x), np.moveaxis(each, 0, -1))


@pytest.mark.parametrize(
    "function",
    [
        Composed(SPLINES[-1], Linear(1.0, 0.0)),
        Composed(Linear(2.0, 0.1), Linear(-0.5, 0.3)),
        Scaled(-0.3, SPLINES[2]),
        Composed(Polynomial((1.0, 2.0)), Linear(2.0, 0.0)),
    ],
)
def test_what_is_simplified_is_the_same_function(function):
    x = np.linspace(-4, 4, 30)
    np.testing.assert_allclose(simplified(function)(x), function(x), atol=1e-12)
