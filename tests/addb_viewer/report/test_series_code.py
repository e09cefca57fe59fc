"""Series survive being packed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from addb_viewer.report.scene_data import packed, unpacked

NUMBERS = st.floats(-30.0, 30.0) | st.just(float("nan"))


@given(arrays(float, array_shapes(min_dims=2, max_dims=3, max_side=7), elements=NUMBERS))
def test_every_number_comes_back_within_half_a_step_and_nan_stays_nan(values):
    series = packed(values, 1e-3)
    back = unpacked(series, len(values)).reshape(values.shape)
    np.testing.assert_array_equal(np.isnan(back), np.isnan(values))
    known = np.isfinite(values)
    assert np.abs(back[known] - values[known]).max(initial=0.0) <= 0.5 * series.step * (1 + 1e-9)


@pytest.mark.parametrize("highest", [1, 2, 7, 9000, 60000])
def test_whole_numbers_come_back_exactly(highest):
    indices = np.array([[0.0, highest], [highest // 2, highest - 1]])
    np.testing.assert_array_equal(unpacked(packed(indices, 1.0), 2), indices)


def test_the_step_grows_only_where_so_many_would_not_reach():
    assert packed(np.array([[-10.0], [10.0]]), 1e-3).step == 1e-3
    wide = packed(np.array([[-100.0], [100.0]]), 1e-3)
    assert 200 / 65536 <= wide.step < 200 / 65000


def test_a_smooth_motion_is_small():
    t = np.linspace(0, 20, 2000)
    positions = np.sin(np.outer(t, np.linspace(1, 3, 60)))
    assert len(packed(positions, 5e-4).data) < 2000 * 60 * 1.5  # as doubles in base64: 10.7 a number
