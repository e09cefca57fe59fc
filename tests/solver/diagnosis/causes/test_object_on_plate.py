"""A box on a plate, all through the trial."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.gravity import GRAVITY
from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.gross_cause import with_samples
from solver.diagnosis.causes.plate_readings import ObjectOnPlate

MASS_KG, ASIDE_M = 8.0, (0.12, -0.2)


def with_a_box(scene, k):
    """Weight and moment of a box beside the middle, added to every sample; the plate is never empty."""
    plate = scene.plates[k]
    place = plate.centre_ground + np.array([ASIDE_M[0], 0.0, ASIDE_M[1]])
    force = np.array([0.0, MASS_KG * GRAVITY, 0.0])
    samples = plate.loads.wrench_ground + np.concatenate([force, np.cross(place, force)])
    changed = with_samples(plate, samples, np.ones(len(samples), dtype=bool))
    plates = list(scene.plates)
    plates[k] = changed
    return replace(scene, plates=tuple(plates))


def test_the_true_wrench_comes_back(scene):
    boxed = with_a_box(scene, 1)
    signature = ObjectOnPlate("plate_2").signature(boxed, ())
    weight_N = MASS_KG * GRAVITY
    x = weight_N * np.array([1.0, *ASIDE_M])
    given = boxed.measured_ground + signature.columns @ x
    np.testing.assert_allclose(given, scene.measured_ground, atol=1e-6)
    assert np.abs(boxed.measured_ground - scene.measured_ground).max() > 0.9 * weight_N


def test_weight_and_place_come_out_by_least_squares(scene, fitted):
    boxed = with_a_box(scene, 1)
    candidate = ObjectOnPlate("plate_2")
    missing = scene.measured_ground - boxed.measured_ground
    x, covariance = fitted(candidate, boxed, missing)
    found = candidate.estimates([boxed], Fitted((), (), x, covariance))
    assert found["mass_kg"].value == pytest.approx(MASS_KG, rel=0.01)
    assert (found["aside_x_m"].value, found["aside_z_m"].value) == pytest.approx(ASIDE_M, abs=0.005)
    assert candidate.is_possible(found)
    assert candidate.is_notable(found)


def test_what_weighs_less_than_nothing_or_stands_elsewhere_is_no_object():
    candidate, covariance = ObjectOnPlate("plate_1"), np.eye(3)

    def told(*x):
        return candidate.estimates([], Fitted((), (), np.array(x), covariance))

    assert not candidate.is_possible(told(-60.0, 0.0, 0.0))
    assert not candidate.is_possible(told(60.0, 90.0, 0.0))
    assert candidate.is_possible(told(60.0, 6.0, -6.0))
    assert not candidate.is_notable(told(5.0, 0.0, 0.0))


def test_a_standard_deviation_by_division_matches_draws():
    x, covariance = np.array([80.0, 10.0, -16.0]), np.array([[4.0, 0.5, 0], [0.5, 1.0, 0], [0, 0, 2.0]])
    found = ObjectOnPlate("plate_1").estimates([], Fitted((), (), x, covariance))
    draws = np.random.default_rng(0).multivariate_normal(x, covariance, 20000)
    assert found["aside_x_m"].std == pytest.approx((draws[:, 1] / draws[:, 0]).std(), rel=0.03)
    assert found["aside_z_m"].std == pytest.approx((draws[:, 2] / draws[:, 0]).std(), rel=0.03)


def test_on_each_plate_in_all_trials_and_in_each(scene):
    other = replace(scene, name="other")
    loaded = [p.target for p in scene.plates if p.loaded.any()]
    found = ObjectOnPlate.candidates([scene, other])
    assert [(c.target, c.trial) for c in found] == [
        (target, trial) for trial in (None, scene.name, "other") for target in loaded
    ]
    assert found[-1].signature(scene, ()) is None
    assert found[-1].signature(other, ()) is not None


def test_on_a_plate_that_is_seen_empty_stands_nothing_heavy(scene):
    boxed = with_a_box(scene, 1)
    empty, always = (
        next(c for c in ObjectOnPlate.candidates([s]) if c.target == "plate_2") for s in (scene, boxed)
    )
    covariance = np.eye(3)
    box = empty.estimates([boxed], Fitted((), (), np.array([MASS_KG * GRAVITY, 0.0, 0.0]), covariance))
    shoe = empty.estimates([boxed], Fitted((), (), np.array([15.0, 0.0, 0.0]), covariance))
    assert (empty.is_possible(box), always.is_possible(box)) == (False, True)
    assert empty.is_possible(shoe)
