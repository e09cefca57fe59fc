"""Curves over the gait cycle, against strides whose shape is known."""

from itertools import pairwise

import numpy as np
import pytest

from solver.gait.cycles import Cycle
from solver.gait.stride_curves import POINTS, stride_curves

RATE = 200.0
TIMES = 5.0 + np.arange(1001) / RATE
STARTS = (5.3, 6.3, 7.5)  # of strides that last 1.0 and 1.2 s


def strides(*, off=0.6):
    return [
        Cycle(0, start, None if off is None else start + off * (end - start), end, 1.4, 0.7, 0.1)
        for start, end in pairwise(STARTS)
    ]


def phase(times):
    """Share of the stride that has passed."""
    return np.interp(times, STARTS, np.arange(len(STARTS)), left=np.nan, right=np.nan) % 1.0


def test_strides_of_unlike_length_have_one_shape():
    found = stride_curves(strides(), TIMES, np.nan_to_num(np.sin(2 * np.pi * phase(TIMES))))
    expected = np.sin(2 * np.pi * np.arange(POINTS) / 100)
    np.testing.assert_allclose(found.mean, expected, atol=1e-3)
    assert found.std.max() < 1e-3
    assert found.foot_off_share == pytest.approx(0.6)
    assert found.left_out == 0


def test_mean_and_deviation_are_of_the_sample():
    level = np.where(TIMES < 6.3 + 1e-9, 2.0, 5.0)
    found = stride_curves(strides(), TIMES, level)
    assert found.values[:, 50].tolist() == [2.0, 5.0]
    assert found.mean[50] == pytest.approx(3.5)
    assert found.std[50] == pytest.approx(3.0 / np.sqrt(2))


def test_within_a_stride_is_the_root_mean_square_of_the_strides_own():
    std = np.where(TIMES < 6.3 + 1e-9, 3.0, 4.0)
    found = stride_curves(strides(), TIMES, TIMES, None, std)
    assert found.within[50] == pytest.approx(np.sqrt(12.5))
    counts = TIMES > 6.0
    assert stride_curves(strides(), TIMES, TIMES, counts, std).within[50] == pytest.approx(4.0)
    assert stride_curves(strides(), TIMES, TIMES).within is None
    assert np.isnan(stride_curves([], TIMES, TIMES, None, std).within).all()


@pytest.mark.parametrize("frame_s", [5.3, 5.8, 6.3], ids=["first", "amid", "last"])
def test_a_stride_with_one_frame_that_does_not_count_is_left_out(frame_s):
    counts = np.abs(TIMES - frame_s) > 0.4 / RATE
    assert counts.sum() == len(TIMES) - 1
    found = stride_curves(strides(), TIMES, TIMES, counts)
    touched = 2 if frame_s == 6.3 else 1  # the second one begins there
    assert (len(found.cycles), found.left_out) == (2 - touched, touched)
    unknown = np.where(counts, TIMES, np.nan)
    assert stride_curves(strides(), TIMES, unknown).left_out == touched


def test_one_stride_has_no_deviation_and_none_has_no_mean():
    one = stride_curves(strides(off=None)[:1], TIMES, TIMES)
    assert one.std is None
    assert one.foot_off_share is None
    assert one.mean[-1] == pytest.approx(6.3)
    none = stride_curves([], TIMES, TIMES)
    assert none.mean is None
    assert none.values.shape == (0, POINTS)
