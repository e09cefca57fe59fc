"""From recorded plates to wrenches on the markers' clock."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import ForcePlate
from solver.capture.formats.storage import read_storage
from solver.capture.formats.trc import read_trc
from solver.capture.plates.conditioning import condition, fill_gaps, resample_plate, shared_cutoff
from solver.capture.plates.force_settings import ConditioningSettings
from solver.capture.plates.moment_convention import plates_from_storage
from solver.common.filters import low_pass

RATE = 1000
HEIGHT = 0.02
TIMES = np.arange(250) / 100  # the markers'


def stance(samples=3000, noise=0.0, start=600, length=900):
    """One step on a plate whose surface lies 2 cm high: heel to toe, with shear and a free moment."""
    phase = np.arange(length) / length
    bell = np.sin(np.pi * phase)
    force, cop, free = np.zeros((samples, 3)), np.full((samples, 3), np.nan), np.zeros((samples, 3))
    during = slice(start, start + length)
    force[during] = np.column_stack([-120 * np.sin(2 * np.pi * phase) * bell, 850 * bell, 30 * bell])
    cop[during] = np.column_stack([1.0 + 0.25 * phase, np.full(length, HEIGHT), 0.4 - 0.03 * bell])
    free[during, 1] = 8 * bell * np.cos(3 * phase)
    moment = np.cross(np.nan_to_num(cop), force) + free
    force = force + np.random.default_rng(0).normal(0, noise, force.shape) if noise else force
    return ForcePlate("fp1", force, moment, cop, RATE)


def at_markers(values, times=TIMES, rate=RATE):
    return values[np.round(times * rate).astype(int)]


def free_moment(conditioned):
    return conditioned.moment_ground - np.cross(conditioned.cop_ground, conditioned.force_ground)


def test_a_step_comes_through():
    plate = stance()
    result = condition(plate, TIMES)
    assert result.notes == ()
    assert result.observed.all()
    middle = slice(70, 140)
    np.testing.assert_allclose(result.force_ground[middle], at_markers(plate.force_ground)[middle], atol=2)
    np.testing.assert_allclose(result.moment_ground[middle], at_markers(plate.moment_ground)[middle], atol=2)
    np.testing.assert_allclose(result.cop_ground[middle], at_markers(plate.cop_ground)[middle], atol=1e-3)
    assert result.loaded[62:148].all()
    assert not result.loaded[:57].any()
    assert not result.loaded[153:].any()


def test_force_moment_and_centre_of_pressure_stay_consistent():
    result = condition(stance(noise=5.0), TIMES)
    np.testing.assert_array_equal(np.isfinite(result.cop_ground).all(axis=1), result.loaded)
    left = free_moment(result)[result.loaded]
    np.testing.assert_allclose(left[:, [0, 2]], 0, atol=1e-9)
    assert np.abs(left[:, 1]).max() < 12
    np.testing.assert_allclose(result.cop_ground[result.loaded, 1], HEIGHT, atol=1e-12)


def test_the_filter_is_the_shared_low_pass_of_force_and_moment_after_masking():
    plate = stance()
    result = condition(plate, TIMES)
    masked = np.where(
        plate.force_ground[:, [1]] >= 20, np.hstack([plate.force_ground, plate.moment_ground]), 0
    )
    expected = at_markers(low_pass(masked, RATE, 30, 3))
    np.testing.assert_allclose(np.hstack([result.force_ground, result.moment_ground]), expected, atol=1e-3)


def test_a_sine_well_below_the_cutoff_is_unchanged():
    own = np.arange(3000) / RATE
    force = np.column_stack([50 * np.sin(12 * own), 700 + 100 * np.sin(25 * own), 20 * np.cos(12 * own)])
    cop = np.column_stack([1 + 0.02 * np.sin(6 * own), np.zeros(3000), 0.1 * np.cos(5 * own)])
    plate = ForcePlate("fp1", force, np.cross(cop, force), cop, RATE)
    result = condition(plate, TIMES)
    inside = slice(10, -10)
    np.testing.assert_allclose(result.force_ground[inside], at_markers(force)[inside], atol=0.5)
    np.testing.assert_allclose(result.cop_ground[inside], at_markers(cop)[inside], atol=2e-4)
    assert result.loaded.all()


def test_noise_above_the_markers_nyquist_frequency_does_not_fold_down():
    plate = stance()
    own = np.arange(3000) / RATE
    loaded = plate.force_ground[:, [1]] > 200
    hum = plate.force_ground + loaded * np.sin(2 * np.pi * 95 * own)[:, None] * [0, 40, 0]
    quiet, humming = condition(plate, TIMES), condition(replace(plate, force_ground=hum), TIMES)
    middle = slice(75, 135)
    assert np.ptp(at_markers(hum - plate.force_ground)[middle, 1]) > 70
    assert np.abs(humming.force_ground - quiet.force_ground)[middle].max() < 1
    assert np.abs(humming.force_raw_ground - quiet.force_raw_ground)[middle].max() < 1


def test_an_untared_plate_gives_the_tared_one():
    clean = stance(noise=1.0)
    offset = np.array([5.0, 14.0, -3.0])
    untared = replace(
        clean,
        force_ground=clean.force_ground + offset,
        moment_ground=clean.moment_ground + np.cross([1.1, 0, 0.4], offset),
    )
    expected, result = condition(clean, TIMES), condition(untared, TIMES)
    np.testing.assert_allclose(result.force_ground, expected.force_ground, atol=0.5)
    np.testing.assert_allclose(result.force_raw_ground, expected.force_raw_ground, atol=0.5)
    both = expected.loaded & result.loaded
    assert (expected.loaded ^ result.loaded).sum() <= 2
    np.testing.assert_allclose(result.cop_ground[both], expected.cop_ground[both], atol=0.01)
    assert any("zero level" in note for note in result.notes)


def test_short_gaps_are_bridged_and_long_ones_not_observed():
    plate = stance()
    force = plate.force_ground.copy()
    force[1000:1010] = np.nan
    force[1200:1300, 1] = np.nan
    force[:55] = np.nan
    result = condition(replace(plate, force_ground=force), TIMES)
    lost = (TIMES < 0.055) | ((TIMES >= 1.2) & (TIMES < 1.3))
    np.testing.assert_array_equal(result.observed, ~lost)
    assert np.isnan(result.force_ground[lost]).all()
    assert np.isnan(result.force_raw_ground[lost]).all()
    assert not result.loaded[lost].any()
    whole = condition(plate, TIMES)
    np.testing.assert_allclose(result.force_ground[90:112], whole.force_ground[90:112], atol=2)
    assert any("10 missing samples interpolated" in note for note in result.notes)
    assert any("0.000 to 0.054 s, 1.200 to 1.299 s" in note for note in result.notes)


@pytest.mark.parametrize(("first", "end"), [(0, 1000), (900, 1200), (1100, 3000)])
def test_nothing_of_a_stretch_that_was_not_recorded_reaches_the_frames_beside_it(first, end):
    """As without it: within what a filter of 20 Hz can tell of the last samples of a step."""
    plate = stance()
    lost = plate.force_ground.copy()
    lost[first:end] = np.nan
    whole, result = condition(plate, TIMES), condition(replace(plate, force_ground=lost), TIMES)
    np.testing.assert_array_equal(
        ~result.observed, (first <= 10 * np.arange(250)) & (10 * np.arange(250) < end)
    )
    seen = result.observed
    np.testing.assert_allclose(result.force_ground[seen], whole.force_ground[seen], atol=12)
    np.testing.assert_array_equal(result.loaded[seen], whole.loaded[seen])


def test_a_force_that_nobody_exerts_is_a_gap():
    plate = stance()
    force = plate.force_ground.copy()
    force[1100, 1] = 1e5
    result = condition(replace(plate, force_ground=force), TIMES)
    expected = condition(plate, TIMES)
    np.testing.assert_allclose(result.force_ground, expected.force_ground, atol=2)
    np.testing.assert_array_equal(result.loaded, expected.loaded)
    assert any("1 samples above 20000 N" in note for note in result.notes)


def test_a_plate_without_a_single_number():
    plate = stance()
    result = condition(replace(plate, force_ground=np.full_like(plate.force_ground, np.nan)), TIMES)
    assert not result.observed.any()
    assert np.isnan(result.force_ground).all()


def test_a_whole_plate_is_not_copied_for_gaps():
    plate = stance()
    filled, recorded, notes = fill_gaps(plate)
    assert filled is plate
    assert recorded.all()
    assert notes == ()


@pytest.mark.parametrize("start", [-0.4033, 0.7017])
def test_clocks_that_start_at_different_times(start):
    plate = stance()
    late = replace(plate, start_time=start)
    times = TIMES + start + 0.2
    expected = condition(plate, times - start)
    result = condition(late, times)
    np.testing.assert_allclose(result.force_ground, expected.force_ground, atol=1e-6)
    np.testing.assert_array_equal(result.loaded, expected.loaded)


def test_forces_shorter_than_markers():
    plate = replace(stance(samples=1800), start_time=0.3)
    result = condition(plate, TIMES)
    np.testing.assert_array_equal(result.observed, (TIMES > 0.298) & (TIMES < 2.101))
    assert np.isnan(result.force_ground[~result.observed]).all()
    assert any(
        "69 marker frames are not observed (0.000 to 0.290 s, 2.110 to 2.490 s)" in n for n in result.notes
    )


def test_forces_of_another_day():
    result = condition(replace(stance(), start_time=500.0), TIMES)
    assert not result.observed.any()
    assert any("covers none of the marker frames" in note for note in result.notes)


def test_vibration_is_no_contact_and_a_low_threshold_keeps_more():
    plate = stance()
    force = plate.force_ground.copy()
    force[2000:2012, 1] = 45
    shaken = replace(plate, force_ground=force)
    assert not condition(shaken, TIMES).loaded[195:206].any()
    np.testing.assert_allclose(condition(shaken, TIMES).force_ground[195:206], 0, atol=0.1)
    assert condition(shaken, TIMES).force_raw_ground[195:206, 1].max() > 5
    assert condition(shaken, TIMES, ConditioningSettings(shortest_contact_s=0.0)).loaded[195:206].any()


def test_slow_markers_lower_the_cutoff_and_say_so():
    assert shared_cutoff(100) == 30
    assert shared_cutoff(60) == 24
    result = condition(stance(), np.arange(120) / 50)
    assert any("low-passed at 20 Hz instead of 30" in note for note in result.notes)


def test_resampled_keeps_the_wrench_and_says_what_it_covers():
    plate = replace(stance(), start_time=0.1)
    moved, observed = resample_plate(plate, TIMES)
    assert (moved.rate, moved.start_time) == (pytest.approx(100), 0)
    np.testing.assert_array_equal(observed, TIMES > 0.098)
    middle = slice(85, 140)
    np.testing.assert_allclose(
        moved.force_ground[middle], at_markers(plate.force_ground, TIMES[middle] - 0.1), atol=1
    )
    np.testing.assert_allclose(
        moved.cop_ground[middle], at_markers(plate.cop_ground, TIMES[middle] - 0.1), atol=1e-3
    )


TRIALS = {
    "walk_rajagopal2015": ("grf.mot", "markers.trc", 85.07),
    "walk_gait2354_subject01": ("subject01_walk1_grf.mot", "subject01_walk1.trc", 72.95),
    "walk_treadmill_stepwidth/example1": ("grf.mot", "markers.trc", 73.04),
    "run_treadmill_hamner2013_subject04/run400": ("grf.mot", "markers.trc", 81.6),
}


@pytest.mark.real
@pytest.mark.parametrize("folder", TRIALS)
def test_real_trials_keep_their_impulse_and_their_centres_of_pressure(real_data, folder):
    forces, markers, mass = TRIALS[folder]
    storage = read_storage(real_data / folder / forces)
    times = read_trc(real_data / folder / markers).markers.times
    total = np.zeros(len(times))
    for plate in plates_from_storage(storage)[0]:
        result = condition(plate, times)
        assert result.observed.all()
        recorded = np.interp(times, plate.times, plate.force_ground[:, 1])
        assert result.force_ground[:, 1].sum() == pytest.approx(recorded.sum(), rel=2e-3)
        nearest = np.clip(np.round((times - plate.start_time) * plate.rate).astype(int), 0, plate.samples - 1)
        known = result.loaded & (result.force_ground[:, 1] > 300)
        off = np.linalg.norm(result.cop_ground - plate.cop_ground[nearest], axis=1)[known]
        assert np.nanmedian(off) < 1e-3
        total += result.force_ground[:, 1]
    if "treadmill" in folder:
        assert total.mean() / 9.80665 == pytest.approx(mass, rel=0.01)


@pytest.mark.real
def test_a_real_plate_that_ends_before_the_markers(real_data):
    folder = real_data / "anomalies" / "tiziana2019_lencioni"
    times = read_trc(folder / "markers.trc").markers.times
    for plate in plates_from_storage(read_storage(folder / "grf.mot"))[0]:
        result = condition(plate, times)
        np.testing.assert_array_equal(result.observed, times < 2.168)
