"""Force components with a wrong sign, or in each other's place."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.exchanged_forces import AxisConvention


def misread(capture, columns, signs, refiled):
    """All plates with their force columns in another order, or with other signs."""

    def wrong(force, point, free):
        return force[:, columns] * signs, point, free

    return replace(capture, plates=tuple(refiled(plate, wrong) for plate in capture.plates))


@pytest.mark.parametrize(
    ("target", "columns_signs"),
    [("x", ((0, 1, 2), (-1, 1, 1))), ("z", ((0, 1, 2), (1, 1, -1))), ("xz", ((2, 1, 0), (1, 1, 1)))],
)
def test_the_true_wrench_comes_back(crisp, seen, refiled, target, columns_signs):
    scene = seen(misread(crisp, *columns_signs, refiled))
    fixed = AxisConvention(target).signature(scene, ()).fixed
    true = seen(crisp).measured_ground
    assert np.abs(scene.measured_ground - true).max() > 50
    np.testing.assert_allclose(scene.measured_ground + fixed, true, atol=1e-8)


def test_a_wrong_vertical_sign_leaves_wrong_horizontal_ones_once_the_plate_is_upright(crisp, seen, refiled):
    without_free = replace(
        crisp, plates=tuple(refiled(p, lambda f, point, free: (f, point, 0 * free)) for p in crisp.plates)
    )
    down = misread(without_free, (0, 1, 2), (1, -1, 1), refiled)
    turned = replace(
        down,
        plates=tuple(
            replace(plate, force_ground=-plate.force_ground, moment_ground=-plate.moment_ground)
            for plate in down.plates
        ),
    )
    scene = seen(turned)
    fixed = AxisConvention("y").signature(scene, ()).fixed
    np.testing.assert_allclose(scene.measured_ground + fixed, seen(without_free).measured_ground, atol=1e-8)


def test_every_convention_is_a_candidate_where_anything_is_loaded(crisp, seen):
    scene = seen(crisp)
    made = AxisConvention.candidates([scene])
    assert {c.target for c in made} >= {"x", "z", "xz"}
    assert all(
        c.is_notable(c.estimates([scene], Fitted((), (), np.zeros(0), np.zeros((0, 0))))) for c in made
    )
    assert made[0].signature(replace(scene, plates=()), ()) is None
    assert AxisConvention.candidates([replace(scene, plates=())]) == []
