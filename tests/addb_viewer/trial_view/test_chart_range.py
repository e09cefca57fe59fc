"""Axes hold what counts; the rest may run off, and is found."""

import numpy as np
import pytest

from addb_viewer.trial_view.chart_range import peaks_beyond, value_range
from addb_viewer.trial_view.charts import Chart, Line
from addb_viewer.trial_view.palette import BLUE, GREY

FRAMES = 100
AIR, HEADROOM = 1.06, 1.25
EARLY = np.arange(FRAMES) < 50


def chart(*lines, shaded=None, runs_off=True):
    return Chart("Residual force", "N", lines, shaded, runs_off)


def own(values):
    return Line("size", np.broadcast_to(np.asarray(values, float), FRAMES), BLUE)


def before(values):
    return Line("before", np.broadcast_to(np.asarray(values, float), FRAMES), GREY, dotted=True)


def bound(value):
    return Line("bound", np.full(FRAMES, float(value)), GREY, dashed=True)


def top(made, rows=slice(0, FRAMES)):
    """Up to where an axis goes, its air aside: more of it where marks need room."""
    high = value_range(made, rows)[1]
    return high / (HEADROOM if peaks_beyond(made, rows, high) else AIR)


@pytest.mark.parametrize(
    ("values", "lowest", "highest"), [([0, 10], 0.0, 10.6), ([-10, 10], -11.2, 11.2), ([0, 0], 0.0, 1.0)]
)
def test_axes_hold_all_values_and_zero_where_nothing_may_run_off(values, lowest, highest):
    line = Line("force", np.array(values, float), BLUE)
    found = value_range(chart(line, shaded=np.array([True, True]), runs_off=False), slice(None))
    assert found == pytest.approx((lowest, highest))


def test_a_part_of_the_trial_is_scaled_to_itself():
    line = own(np.where(EARLY, 1000.0, 1.0))
    assert top(chart(line, runs_off=False), slice(50, 100)) == pytest.approx(1.0)
    assert top(chart(line), slice(50, 100)) == pytest.approx(1.0)


def test_frames_that_do_not_count_stretch_no_axis():
    line = own(np.where(EARLY, 800.0, 20.0))
    assert top(chart(line, bound(32.0), shaded=EARLY)) == pytest.approx(32.0)
    assert top(chart(line, bound(10.0), shaded=EARLY)) == pytest.approx(20.0)
    assert top(chart(line, bound(10.0))) == pytest.approx(800.0)


def test_where_none_of_the_frames_shown_counts_they_are_seen_all_the_same():
    line = own(np.where(EARLY, 800.0, 20.0))
    assert top(chart(line, bound(32.0), shaded=EARLY), slice(0, 50)) == pytest.approx(800.0)


def test_a_rare_peak_runs_off_and_a_frequent_one_does_not():
    rare, often = np.ones(FRAMES), np.ones(FRAMES)
    rare[40] = often[::10] = 500.0
    assert top(chart(own(rare))) == pytest.approx(3.0)
    assert top(chart(own(often))) == pytest.approx(500.0)


def test_another_fit_stretches_the_axis_to_a_few_bounds_and_no_farther():
    assert top(chart(before(50.0), own(2.0), bound(30.0))) == pytest.approx(50.0)
    assert top(chart(before(500.0), own(2.0), bound(30.0))) == pytest.approx(90.0)
    assert top(chart(before(500.0), own(200.0), bound(30.0))) == pytest.approx(200.0)
    assert top(chart(before(50.0), own(2.0))) == pytest.approx(50.0)


def test_where_all_that_counts_is_zero_the_rest_is_seen():
    assert top(chart(own(np.where(EARLY, 8.0, 0.0)), shaded=EARLY)) == pytest.approx(8.0)


def test_unknown_values_are_no_size():
    assert top(chart(own(np.nan), bound(30.0))) == pytest.approx(30.0)
    assert value_range(chart(own(np.nan)), slice(0, FRAMES)) == (0.0, 1.0)
    assert peaks_beyond(chart(own(np.nan)), slice(0, FRAMES), 1.0) == []


def test_peaks_close_together_have_one_mark_at_the_higher_one():
    values = np.zeros(FRAMES)
    values[[20, 22, 60]] = 5.0, 9.0, 6.0
    values[21] = np.nan
    made = chart(own(values), bound(30.0))

    def found(rows, high):
        return [(peak.frame, peak.value) for peak in peaks_beyond(made, rows, high)]

    assert found(slice(0, FRAMES), 4.0) == [(22, 9.0), (60, 6.0)]
    assert found(slice(50, FRAMES), 4.0) == [(10, 6.0)]
    assert found(slice(0, FRAMES), 10.0) == []


def test_of_two_curves_the_farther_one_is_marked():
    made = chart(before(np.where(EARLY, 50.0, 0.0)), own(np.where(EARLY, 40.0, 90.0)))
    peaks = peaks_beyond(made, slice(0, FRAMES), 30.0)
    assert [(peak.value, peak.line.label) for peak in peaks] == [(90.0, "size")]
    (first,) = peaks_beyond(made, slice(0, 50), 30.0)
    assert (first.value, first.line.label) == (50.0, "before")
