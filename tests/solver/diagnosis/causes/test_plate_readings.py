"""A plate with a wrong gain, a constant in all it reads, or something that stands on it."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.gravity import GRAVITY
from solver.diagnosis.causes.effect import Estimate, Fitted
from solver.diagnosis.causes.gross_cause import with_samples
from solver.diagnosis.causes.plate_readings import (
    FORCES,
    MOMENTS,
    ObjectOnPlate,
    PlateBias,
    PlateBiasTakenOff,
    PlateGain,
    ZeroLevel,
    level_taken_off,
)


def recorded(capture, gain_error, k=1):
    plates = list(capture.plates)
    wrong = 1 + gain_error
    plates[k] = replace(
        plates[k], force_ground=wrong * plates[k].force_ground, moment_ground=wrong * plates[k].moment_ground
    )
    return replace(capture, plates=tuple(plates))


@pytest.mark.parametrize("gain_error", [0.04, -0.2])
def test_the_true_wrench_comes_back_at_any_size_while_the_plate_stands_alone(crisp, seen, gain_error):
    """Within what unloaded plates read; but for a share of the error while another carries some weight."""
    exact = seen(crisp)
    exact = replace(exact, required_ground=exact.measured_ground)
    scene = replace(seen(recorded(crisp, gain_error)), required_ground=exact.measured_ground)
    candidate, x = PlateGain("plate_2"), np.array([gain_error])
    told = candidate.signature(scene, ()).columns @ x
    error = exact.measured_ground - scene.measured_ground
    others = np.any([p.loaded for p in scene.plates if p.target != "plate_2"], axis=0)
    alone = scene.plates[1].loaded & ~others
    assert alone.sum() > 20
    np.testing.assert_allclose(told[alone], error[alone], atol=0.01 * np.abs(error).max())
    assert np.abs(told[~scene.plates[1].loaded]).max() < 0.01 * np.abs(error).max()
    with_others = scene.plates[1].loaded & others
    assert np.abs((told - error)[with_others]).max() <= abs(gain_error) * np.abs(error).max()
    estimate = candidate.estimates([scene], Fitted((), (), x, np.array([[0.01**2]])))["gain_error"]
    assert (estimate.value, estimate.std) == (gain_error, pytest.approx(0.01))


def test_noise_of_the_plates_alone_makes_no_gain(crisp, seen):
    """What the fitted motion does not tell is part of what plates record, and has nothing to do with it."""
    exact = seen(crisp)
    rng = np.random.default_rng(3)
    factors = []
    for _ in range(40):
        noise = 60.0 * rng.standard_normal((exact.frames, 6)) * exact.plates[1].loaded[:, None]
        plates = list(exact.plates)
        plates[1] = replace(plates[1], wrench_ground=plates[1].wrench_ground + noise)
        scene = replace(exact, plates=tuple(plates), required_ground=exact.measured_ground)
        column = PlateGain("plate_2").signature(scene, ()).columns[:, :3, 0].ravel()
        left = (scene.required_ground - scene.measured_ground)[:, :3].ravel()
        factors.append(-column @ left / (column @ column))
    spread = np.std(factors) / np.sqrt(len(factors))
    assert abs(np.mean(factors)) < 3 * spread


def test_a_force_that_something_else_took_is_not_counted_as_the_plates(crisp, seen):
    """Where hardly anything of the demand was recorded, the record is as good."""
    exact = seen(crisp)
    lost = replace(exact, required_ground=2.5 * exact.measured_ground)
    own = PlateGain("plate_2").signature(lost, ()).columns[:, :, 0]
    np.testing.assert_allclose(own, -lost.plates[1].wrench_ground)


K, TARGET = 1, "plate_2"
BIAS = np.array([6.0, -12.0, 7.0])


def biased(capture, bias, *, while_unloaded):
    plate = capture.plates[K]
    centre = plate.corners_ground.mean(axis=0)
    where = np.ones(plate.samples) if while_unloaded else plate.force_ground[:, 1] > 0
    plates = list(capture.plates)
    plates[K] = replace(
        plate,
        force_ground=plate.force_ground + where[:, None] * bias,
        moment_ground=plate.moment_ground + where[:, None] * np.cross(centre, bias),
    )
    return replace(capture, plates=tuple(plates))


@pytest.mark.parametrize("bias", [BIAS, np.array([0.0, 60.0, 0.0])], ids=["small", "large"])
def test_a_bias_that_zeros_hide_comes_off(crisp, seen, bias):
    scene = seen(biased(crisp, bias, while_unloaded=False))
    assert [c.target for c in PlateBias.candidates([scene]) if isinstance(c, PlateBiasTakenOff)] == []
    columns = PlateBias(TARGET).signature(scene, ()).columns
    np.testing.assert_allclose(scene.measured_ground + columns @ bias, seen(crisp).measured_ground, atol=1e-8)


def test_a_bias_too_large_for_a_zero_level_loads_the_plate_all_the_time_and_comes_off(crisp, seen):
    bias = np.array([0.0, 55.0, 20.0])
    scene = seen(biased(crisp, bias, while_unloaded=True))
    assert level_taken_off(scene.plates[K]) is None
    assert scene.plates[K].loads.carrying.all()
    columns = PlateBias(TARGET).signature(scene, ()).columns
    np.testing.assert_allclose(scene.measured_ground + columns @ bias, seen(crisp).measured_ground, atol=1e-8)


@pytest.mark.parametrize("bias", [BIAS, np.array([0.0, 30.0, 0.0]), np.array([15.0, 0.0, 0.0])])
def test_a_bias_that_shows_is_taken_off_and_named(crisp, seen, bias):
    scene, true = seen(biased(crisp, bias, while_unloaded=True)), seen(crisp)
    centre = scene.plates[K].centre_ground
    np.testing.assert_allclose(
        level_taken_off(scene.plates[K]), np.concatenate([bias, np.cross(centre, bias)]), atol=1e-9
    )
    np.testing.assert_allclose(scene.measured_ground, true.measured_ground, atol=1e-8)
    (candidate,) = [c for c in PlateBias.candidates([scene]) if isinstance(c, PlateBiasTakenOff)]
    assert (candidate.id, candidate.target) == ("plate_bias", TARGET)
    signature = candidate.signature(scene, ())
    assert signature.columns.shape == (scene.frames, 6, 0)
    assert not signature.fixed.any()
    estimates = candidate.estimates([scene, scene], Fitted((), (), np.zeros(0), np.zeros((0, 0))))
    assert [estimates[f"bias_{axis}_N"].value for axis in "xyz"] == pytest.approx(bias.tolist())
    assert candidate.is_notable(estimates)


def test_without_the_correction_the_bias_would_be_in_the_balance(crisp, seen):
    """30 N are above the contact threshold: they would load the plate on every frame."""
    bias = np.array([0.0, 30.0, 4.0])
    scene = seen(biased(crisp, bias, while_unloaded=True))
    more = PlateBiasTakenOff(TARGET).uncorrected_ground(scene) - seen(crisp).measured_ground
    expected = np.concatenate([bias, np.cross(scene.plates[K].centre_ground, bias)])
    np.testing.assert_allclose(more, np.tile(expected, (scene.frames, 1)), atol=1e-8)


def test_an_unloaded_plate_in_noise_tells_its_level_within_the_deviation_it_states(crisp, seen):
    capture = biased(crisp, BIAS, while_unloaded=True)
    rng = np.random.default_rng(1)
    plates = list(capture.plates)
    noise = 2.0 * rng.standard_normal(plates[K].force_ground.shape)
    plates[K] = replace(plates[K], force_ground=plates[K].force_ground + noise)
    scene = seen(replace(capture, plates=tuple(plates)))
    candidate = PlateBiasTakenOff(TARGET)
    estimates = candidate.estimates([scene], Fitted((), (), np.zeros(0), np.zeros((0, 0))))
    for axis, bias in zip("xyz", BIAS, strict=True):
        estimate = estimates[f"bias_{axis}_N"]
        assert 0 < estimate.std < 1
        assert abs(estimate.value - bias) < 3 * estimate.std


def test_a_sound_plate_has_nothing_taken_off(crisp, seen):
    scene = seen(crisp)
    assert all(level_taken_off(plate) is None for plate in scene.plates)
    assert PlateBiasTakenOff(TARGET).signature(scene, ()) is None
    np.testing.assert_array_equal(PlateBiasTakenOff(TARGET).uncorrected_ground(scene), scene.measured_ground)


LEVEL, ASIDE_M = np.array([12.0, -180.0, 25.0]), np.array([0.1, 0.0, -0.15])


def tared_under_load(scene, k):
    """What stood aside of the middle is lacking in every loaded sample."""
    plate = scene.plates[k]
    loaded = plate.loads.carrying
    level = np.concatenate([LEVEL, np.cross(plate.centre_ground + ASIDE_M, LEVEL)])
    changed = with_samples(plate, plate.loads.wrench_ground + loaded[:, None] * level, loaded)
    return replace(scene, plates=(*scene.plates[:k], changed, *scene.plates[k + 1 :]))


def test_level_and_place_come_out_by_least_squares(scene, fitted):
    wrong = tared_under_load(scene, 1)
    candidate = ZeroLevel("plate_2")
    x, covariance = fitted(candidate, wrong, scene.measured_ground - wrong.measured_ground)
    found = candidate.estimates([wrong], Fitted((), (), x, covariance))
    assert [found[name].value for name in FORCES] == pytest.approx(LEVEL.tolist(), rel=0.01)
    about_middle = np.cross(ASIDE_M, LEVEL)
    assert [found[f"moment_{a}_Nm"].value for a in "xyz"] == pytest.approx(about_middle.tolist(), rel=0.02)
    assert candidate.is_notable(found)


def test_what_a_tared_plate_drifts_is_none(scene):
    small = {name: Estimate(20.0, 1.0) for name in FORCES} | {name: Estimate(1.0, 0.1) for name in MOMENTS}
    assert not ZeroLevel("plate_1").is_notable(small)


def test_a_plate_that_is_seen_empty_has_none(scene):
    assert all(plate.seen_empty for plate in scene.plates)
    assert ZeroLevel.candidates([scene]) == []
    wrong = tared_under_load(scene, 1)
    never = np.ones(len(wrong.plates[1].loads.carrying), dtype=bool)
    standing = with_samples(wrong.plates[1], wrong.plates[1].loads.wrench_ground, never)
    always = replace(wrong, plates=(wrong.plates[0], standing))
    assert [c.key for c in ZeroLevel.candidates([always])] == [("zero_level", "plate_2")]


MASS_KG, ASIDE_M_OBJECT = 8.0, (0.12, -0.2)


def with_a_box(scene, k):
    """Weight and moment of a box beside the middle, added to every sample; the plate is never empty."""
    plate = scene.plates[k]
    place = plate.centre_ground + np.array([ASIDE_M_OBJECT[0], 0.0, ASIDE_M_OBJECT[1]])
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
    x = weight_N * np.array([1.0, *ASIDE_M_OBJECT])
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
    assert (found["aside_x_m"].value, found["aside_z_m"].value) == pytest.approx(ASIDE_M_OBJECT, abs=0.005)
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
