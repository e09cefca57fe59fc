import numpy as np
import pytest

from solver.skeleton.mass_elements import MassElement, box, ellipsoid, segment_element, together, without
from solver.skeleton.segment_tables import SegmentShape


def cloud_of(element, rng):
    """Eight equal point masses with the element's mass, centre and inertia."""
    second = np.trace(element.inertia) / 2 * np.eye(3) - element.inertia  # ∫ x xᵀ dm
    values, axes = np.linalg.eigh(second)
    arms = axes * np.sqrt(np.maximum(values, 0) / element.mass)
    signs = np.array([[a, b, c] for a in (1, -1) for b in (1, -1) for c in (1, -1)])
    return element.com + signs @ arms.T, np.full(8, element.mass / 8)


def of_points(points, masses):
    com = masses @ points / masses.sum()
    r = points - com
    inertia = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, r, strict=True))
    return masses.sum(), com, inertia


@pytest.fixture
def parts():
    rng = np.random.default_rng(0)
    return [
        ellipsoid(2.0, rng.normal(size=3), np.array([0.1, 0.3, 0.2])),
        box(1.5, rng.normal(size=3), np.array([0.4, 0.2, 0.6])),
    ]


def test_a_sum_is_what_point_masses_make_of_it(parts):
    rng = np.random.default_rng(1)
    clouds = [cloud_of(part, rng) for part in parts]
    mass, com, inertia = of_points(
        np.concatenate([c[0] for c in clouds]), np.concatenate([c[1] for c in clouds])
    )
    whole = together(parts)
    assert whole.mass == pytest.approx(mass)
    np.testing.assert_allclose(whole.com, com, atol=1e-12)
    np.testing.assert_allclose(whole.inertia, inertia, atol=1e-12)


def test_taking_a_part_away_undoes_adding_it(parts):
    left = without(together(parts), parts[1:])
    assert left.mass == pytest.approx(parts[0].mass)
    np.testing.assert_allclose(left.com, parts[0].com, atol=1e-12)
    np.testing.assert_allclose(left.inertia, parts[0].inertia, atol=1e-12)


def test_a_segment_lies_along_its_end_points():
    shape = SegmentShape(
        mass=0.1, com=0.4, radius_sagittal=0.3, radius_transverse=0.25, radius_longitudinal=0.1
    )
    start, end = np.array([0.1, 0.2, 0.3]), np.array([0.3, -0.4, 0.4])
    element = segment_element(shape, 70.0, start, end)
    length = np.linalg.norm(end - start)
    along = (end - start) / length
    assert element.mass == pytest.approx(7.0)
    np.testing.assert_allclose(element.com, start + 0.4 * (end - start), atol=1e-15)
    assert along @ element.inertia @ along == pytest.approx(7.0 * (0.1 * length) ** 2)
    moments = np.sqrt(np.linalg.eigvalsh(element.inertia) / 7.0) / length
    np.testing.assert_allclose(moments, [0.1, 0.25, 0.3], rtol=1e-9)


def test_moving_changes_the_inertia_about_a_fixed_point_only():
    element = MassElement(2.0, np.array([0.1, 0.0, 0.0]), np.eye(3))
    moved = element.moved(np.array([0.0, 0.3, 0.0]))
    np.testing.assert_array_equal(moved.inertia, element.inertia)
    assert moved.inertia_about(np.zeros(3))[2, 2] == pytest.approx(1 + 2 * (0.01 + 0.09))
