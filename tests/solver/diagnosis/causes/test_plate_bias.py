"""A constant force added to one plate: hidden by the file's zeros, or shown on the unloaded plate."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.plate_readings import PlateBias, PlateBiasTakenOff, level_taken_off

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


def test_estimates_and_the_practical_minimum():
    candidate = PlateBias(TARGET)
    found = candidate.estimates([], Fitted((), (), BIAS, np.diag([1.0, 4.0, 9.0])))
    assert [(e.value, e.std) for e in found.values()] == [(6.0, 1.0), (-12.0, 2.0), (7.0, 3.0)]
    assert list(found) == ["bias_x_N", "bias_y_N", "bias_z_N"]
    assert candidate.is_notable(found)
    assert not candidate.is_notable(candidate.estimates([], Fitted((), (), 0.2 * BIAS, np.eye(3))))
