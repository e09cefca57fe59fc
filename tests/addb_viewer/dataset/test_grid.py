"""Values on the release's grid against slow statements, frame by frame, and polynomials that are exact."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import butter, freqz

from addb_viewer.dataset.grid import cuts_of, grid_of
from addb_viewer.dataset.ground_forces import (
    Surfaces,
    contacts_on_grid,
    free_moments,
    mask_on_grid,
    with_pressure_points,
)
from solver.common.filters import low_pass
from solver.contact.wrenches import FrameMask
from solver.dynamics.trajectory.spline_basis import spline_at, spline_basis
from solver.kinematics.motion import Motion, resampled
from tests.contacts import contacts_of

RATES = (60.0, 120.0, 200.0, 250.0)


def cubic(times):
    return np.column_stack([1 + times, 2 * times**2 - times, times**3 - 3 * times])


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("frames", [2, 13, 97])
def test_the_grid_begins_with_the_trial_and_ends_within_it(rate, frames):
    grid = grid_of(frames, rate, 3.25, 100.0)
    last = (frames - 1) / rate
    expected = [k / 100 for k in range(10_000) if k / 100 <= last + 1e-8]
    np.testing.assert_allclose(grid.seconds, expected, atol=1e-12)
    assert grid.times[0] == 3.25
    for k, second in enumerate(expected):
        place = min(second * rate, frames - 1)
        assert grid.before[k] == int(place + 1e-6)
        assert abs(grid.nearest[k] - place) <= 0.5 + 1e-6
        assert grid.after[k] - grid.before[k] == (abs(place - round(place)) > 1e-6)


@pytest.mark.parametrize("rate", [100.0, 100.000001])
def test_a_recording_at_the_releases_rate_passes_bit_by_bit(rate):
    rng, grid = np.random.default_rng(1), grid_of(300, rate, 0.0, 100.0)
    assert grid.is_native
    assert grid.frames == 300
    values = rng.normal(size=(300, 4, 3))
    values[17:30, 2] = np.nan
    for taken in (grid.interpolated(values[:, :2]), grid.interpolated_where_seen(values)):
        assert np.array_equal(taken, values[:, : taken.shape[1]], equal_nan=True)
    flags = rng.random((300, 2)) > 0.5
    for taken in (grid.at_both(flags), grid.at_either(flags), grid.at_nearest(flags)):
        assert np.array_equal(taken, flags)


@pytest.mark.parametrize("rate", RATES)
def test_a_marker_is_there_only_between_two_frames_that_show_it(rate):
    frames = 90
    times = np.arange(frames) / rate
    native = np.stack([cubic(times), cubic(times) + 1], axis=1)
    rng = np.random.default_rng(2)
    native[rng.random(frames) < 0.2, 0] = np.nan
    native[40:55, 1] = np.nan
    grid = grid_of(frames, rate, 0.0, 100.0)
    got = grid.interpolated_where_seen(native)
    seen = np.isfinite(native).all(axis=2)
    for marker in range(2):
        for k, place in enumerate(grid.seconds * rate):
            low, high = int(place + 1e-6), int(np.ceil(place - 1e-6))
            expected = seen[low, marker] and seen[high, marker]
            assert np.isfinite(got[k, marker]).all() == expected, (marker, k)
    alone = got[:, 1]
    there = np.isfinite(alone).all(axis=1)
    np.testing.assert_allclose(alone[there], (cubic(grid.seconds) + 1)[there], atol=1e-10)


@pytest.mark.parametrize("rate", RATES)
def test_the_markers_motion_is_its_natural_spline_with_that_splines_derivatives(rate):
    times = np.arange(80) / rate
    parabola = Motion(("a", "b"), np.column_stack([times**2, 1 - times]), rate, 2.0)
    grid = grid_of(80, rate, 2.0, 100.0)
    got, t = resampled(parabola, grid.rate, grid.frames), grid.seconds
    np.testing.assert_allclose(got.q, np.column_stack([t**2, 1 - t]), atol=1e-11)
    np.testing.assert_allclose(got.velocity, np.column_stack([2 * t, -np.ones_like(t)]), atol=1e-8)
    np.testing.assert_allclose(got.acceleration, np.column_stack([np.full_like(t, 2), 0 * t]), atol=1e-5)


def de_boor(x, knots, coefficients, degree):
    k = min(int(np.searchsorted(knots, x, side="right")) - 1, len(coefficients) - 1)
    d = [coefficients[j + k - degree] for j in range(degree + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            low = knots[j + k - degree]
            a = (x - low) / (knots[j + 1 + k - r] - low)
            d[j] = (1 - a) * d[j - 1] + a * d[j]
    return d[degree]


def test_the_fitted_spline_at_any_time_is_de_boors():
    basis = spline_basis(41, 60.0, 2)
    c, width = np.random.default_rng(3).normal(size=(basis.coefficients, 2)), 2 / 60.0
    np.testing.assert_allclose(spline_at(c, width, np.arange(41) / 60.0), basis.evaluate(c), atol=1e-12)
    times = np.linspace(0, 40 / 60.0, 57)
    knots = [(i - 5) * width for i in range(len(c) + 6)]
    expected = [de_boor(t, knots, c, 5) for t in times]
    np.testing.assert_allclose(spline_at(c, width, times), expected, atol=1e-10)
    step = 1e-5
    inner = times[1:-1]
    slope = (spline_at(c, width, inner + step) - spline_at(c, width, inner - step)) / (2 * step)
    np.testing.assert_allclose(spline_at(c, width, inner, 1), slope, rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize("rate", RATES)
def test_wrenches_are_splines_and_zero_between_zeros(rate):
    frames = 100
    times = np.arange(frames) / rate
    time_history = np.hstack([cubic(times) + 5, cubic(times) - 5])
    wrench = np.stack([time_history, np.where((np.arange(frames) >= 50)[:, None], time_history, 0.0)], axis=1)
    grid = grid_of(frames, rate, 0.0, 100.0)
    given = contacts_of(("r", "l"), wrench, plate=np.zeros((frames, 1), int))
    got = contacts_on_grid(given, grid).wrench_ground
    expected = np.hstack([cubic(grid.seconds) + 5, cubic(grid.seconds) - 5])
    np.testing.assert_allclose(got[:, 0], expected, atol=1e-9)
    for k, place in enumerate(grid.seconds * rate):
        is_zero = int(np.ceil(place - 1e-6)) < 50
        assert (got[k, 1] == 0.0).all() == is_zero, k
    parts = contacts_of(("r", "l"), wrench[:, :1] * [[[0.25]]], plate=given.plate)
    rest = contacts_of(("r", "l"), wrench[:, :1] * [[[0.75]]], plate=given.plate)
    total = contacts_on_grid(parts, grid).wrench_ground + contacts_on_grid(rest, grid).wrench_ground
    np.testing.assert_allclose(total, got[:, :1], atol=1e-9)  # no force is made or lost


def test_pressure_points_are_where_the_moment_is_along_the_normal():
    rng = np.random.default_rng(4)
    normal = np.array([0.1, 0.97, -0.05])
    normal /= np.linalg.norm(normal)
    place = np.array([0.3, 0.05, -0.2])
    tangents = np.linalg.svd(normal[None])[2][1:]
    frames = 40
    force = rng.normal(size=(frames, 3)) * 30 + 400 * normal
    force[:5] = 19.0 * normal
    point = place + (rng.normal(size=(frames, 2)) * 0.1) @ tangents
    free = rng.normal(size=frames) * 5
    moment = np.array([np.cross(p, f) + m * normal for p, f, m in zip(point, force, free, strict=True)])
    given = contacts_of(("r", "l"), np.hstack([force, moment])[:, None], plate=np.zeros((frames, 1), int))
    surfaces = Surfaces(np.tile(place, (frames, 1, 1)), np.tile(normal, (frames, 1, 1)))
    got = with_pressure_points(given, surfaces, 20.0)
    assert np.isnan(got.cop_ground[:5]).all()
    np.testing.assert_allclose(got.cop_ground[5:, 0], point[5:], atol=1e-9)
    np.testing.assert_allclose(free_moments(got, surfaces)[5:, 0], free[5:], atol=1e-8)


@pytest.mark.parametrize("rate", RATES)
def test_a_foot_counts_between_two_frames_on_which_it_does(rate):
    frames = 120
    counts = np.random.default_rng(5).random((frames, 2)) > 0.3
    mask = FrameMask(
        counts, ((10, 11, None, "erroneous"), (20, 40, "r", "why")), sources=("review", "review")
    )
    grid = grid_of(frames, rate, 0.0, 100.0)
    got = mask_on_grid(mask, grid)
    for k, place in enumerate(grid.seconds * rate):
        low, high = int(place + 1e-6), int(np.ceil(place - 1e-6))
        assert (got.counts[k] == (counts[low] & counts[high])).all()
    start, end = got.reasons[-1][:2]
    inside = [k for k in range(grid.frames) if 20 <= grid.nearest[k] < 40]
    assert (start, end) == (inside[0], inside[-1] + 1)


@pytest.mark.parametrize(("rate", "cutoff"), [(100.0, 30.0), (200.0, 30.0), (60.0, 24.0)])
def test_the_filter_halves_its_corner_and_both_passes_together_do(rate, cutoff):
    b, a = butter(3, cutoff / (rate / 2))
    single = abs(freqz(b, a, [2 * np.pi * cutoff / rate])[1][0])
    assert single**2 == pytest.approx(0.5, abs=1e-3)
    times = np.arange(4000) / rate
    got = low_pass(np.sin(2 * np.pi * cutoff * times), rate, cutoff)[1000:-1000]
    wave = np.exp(-2j * np.pi * cutoff * times[1000:-1000])
    assert abs(2 * np.mean(got * wave)) == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    ("frames", "sizes", "left"),
    [
        (11, [], [11]),
        (12, [12], []),
        (2000, [2000], []),
        (2001, [1001, 1000], []),
        (4001, [1334, 1334, 1333], []),
    ],
)
def test_a_span_is_cut_evenly_and_a_short_one_is_left_out(frames, sizes, left):
    cuts = cuts_of(np.zeros(frames, bool))
    assert [segment.frames for segment in cuts.kept] == sizes
    assert [segment.frames for segment in cuts.too_short] == left
    borders = [(segment.start, segment.end) for segment in (*cuts.kept, *cuts.too_short)]
    assert borders[0][0] == 0
    assert borders[-1][1] == frames
    assert all(one[1] == next_one[0] for one, next_one in pairwise(borders))


def test_segments_end_at_erroneous_stretches():
    erroneous = np.zeros(3000, bool)
    erroneous[5:20] = erroneous[100:110] = erroneous[-3:] = True
    cuts = cuts_of(erroneous)
    assert [(s.start, s.end) for s in cuts.too_short] == [(0, 5)]
    assert [(s.start, s.end) for s in cuts.erroneous] == [(5, 20), (100, 110), (2997, 3000)]
    assert [(s.start, s.end) for s in cuts.kept] == [(20, 100), (110, 1554), (1554, 2997)]
    number = cuts.number(3000)
    for k in range(3000):
        inside = [i for i, s in enumerate(cuts.kept) if s.start <= k < s.end]
        assert number[k] == (inside[0] if inside else -1)
    assert ((number >= 0) | erroneous | (np.arange(3000) < 5)).all()
