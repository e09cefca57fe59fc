"""A plate that lies beside its place."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.plate_geometry import PlatePosition


@pytest.mark.parametrize("shift", [(0.012, -0.005), (-0.1, 0.2)])
def test_the_true_wrench_comes_back_whatever_the_size(crisp, seen, refiled, shift):
    def moved(force, point, free):
        return force, point + np.array([shift[0], 0.0, shift[1]]), free

    plates = list(crisp.plates)
    plates[2] = refiled(plates[2], moved)
    scene = seen(replace(crisp, plates=tuple(plates)))
    signature = PlatePosition("plate_3").signature(scene, ())
    given = scene.measured_ground + signature.columns @ np.array(shift)
    np.testing.assert_allclose(given, seen(crisp).measured_ground, atol=1e-9)


def test_estimates_and_the_practical_minimum():
    candidate = PlatePosition("plate_1")
    covariance = np.array([[4e-6, 1e-6], [1e-6, 9e-6]])
    found = candidate.estimates([], Fitted((), (), np.array([0.012, -0.004]), covariance))
    assert [(name, e.value, e.std) for name, e in found.items()] == [
        ("shift_x_m", 0.012, pytest.approx(0.002)),
        ("shift_z_m", -0.004, pytest.approx(0.003)),
    ]
    assert candidate.is_notable(found)
    assert not candidate.is_notable(
        candidate.estimates([], Fitted((), (), np.array([0.003, 0.003]), covariance))
    )


def test_every_loaded_plate_is_a_candidate(crisp, seen):
    scene = seen(crisp)
    made = PlatePosition.candidates([scene, scene])
    assert [c.target for c in made] == [p.target for p in scene.plates for _ in range(2)]
    near, far = made[:2]
    assert far.prior_std_m > 5 * near.prior_std_m
    assert far.place_odds > near.place_odds == 0.0
    assert made[0].signature(replace(scene, plates=scene.plates[1:]), ()) is None
