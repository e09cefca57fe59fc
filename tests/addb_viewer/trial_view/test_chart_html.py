import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from addb_viewer.trial_view.chart_html import axis_html, chart_html, curve_path, nice_ticks, short_labels
from addb_viewer.trial_view.charts import Chart, Line
from addb_viewer.trial_view.palette import BLUE
from addb_viewer.trial_view.span import Span

SPITEFUL = "<script>alert(1)</script>"


def chart(values, shaded=None, label="left"):
    return Chart("Force", "N", (Line(label, np.asarray(values, float), BLUE),), shaded)


def points(path):
    numbers = [float(n) for n in re.findall(r"-?[0-9.]+", path.replace("h0.5", ""))]
    return np.array(numbers).reshape(-1, 2)


def test_thinning_keeps_every_peak():
    values = np.zeros(10_000)
    values[1234], values[7777] = 5.0, -3.0
    drawn = points(curve_path(values, -5.0, 5.0, most=200))
    assert len(drawn) <= 200
    highest, lowest = drawn[drawn[:, 1].argmin()], drawn[drawn[:, 1].argmax()]
    assert highest[1] == pytest.approx(0.0)
    assert highest[0] == pytest.approx(123.4, abs=10.0)
    assert lowest[1] == pytest.approx(80.0)
    assert np.all(np.diff(drawn[:, 0]) >= 0)


def test_gaps_stay_gaps_and_nothing_unknown_is_sent():
    values = np.array([np.nan, 1.0, 2.0, np.nan, 3.0, np.nan])
    path = curve_path(values, 0.0, 4.0)
    assert path.count("M") == 2
    assert "nan" not in path
    assert curve_path(np.full(5, np.nan), 0.0, 1.0) == ""
    assert "nan" not in chart_html(chart(np.full(5, np.nan)), Span(0, 4), 80)


def test_a_curve_that_runs_off_is_marked_at_its_peak_and_says_how_far_it_goes():
    values = np.where(np.arange(101) == 50, 812.0, 1.0)
    tame = chart_html(chart(values), Span(0, 100), 80)
    assert "▲" not in tame
    page = chart_html(replace(chart(values), runs_off=True), Span(0, 100), 80)
    assert page.count("▲ 812") == page.count("▲") == 1
    assert "left:50.00%;top:1px;transform:translateX(-50%)" in page
    part = chart_html(replace(chart(values), runs_off=True), Span(50, 100), 80)
    assert "left:0.00%;top:1px;transform:translateX(0%)" in part


@given(st.floats(-1e4, 1e4), st.floats(1e-3, 1e4), st.integers(2, 8))
def test_ticks_are_round_and_inside(low, width, about):
    ticks = nice_ticks(low, low + width, about)
    assert len(ticks) <= 2 * about + 2
    assert all(low - 1e-6 * width <= tick <= low + width * (1 + 1e-6) for tick in ticks)


def test_time_has_its_unit_and_every_chart_its_own():
    assert "time [s]" in axis_html(Span(0, 99), np.arange(100) / 100)
    assert "Force [N]" in chart_html(chart([1, 2]), Span(0, 1), 80)


@pytest.mark.parametrize(
    ("labels", "short"),
    [
        ([f"ground_force_{k}" for k in range(1, 9)], [str(k) for k in range(1, 9)]),
        (["FP10", "FP11", "FP12", "FP13"], ["FP10", "FP11", "FP12", "FP13"]),
        (["plate", "plate 1", "plate 2", "plate 3"], ["plate", "plate 1", "plate 2", "plate 3"]),
        (["plate 1", "plate 2", "plate 3", "plate"], ["plate 1", "plate 2", "plate 3", "plate"]),
        (["ground_force_1", "ground_force_2"], ["ground_force_1", "ground_force_2"]),
        (["right", "left", "right foot", "left foot"], ["right", "left", "right foot", "left foot"]),
    ],
)
def test_many_names_in_a_heading_lose_the_words_that_they_share(labels, short):
    assert short_labels(labels) == short


def test_names_from_files_stay_text():
    assert "<script>" not in chart_html(chart([1, 2], label=SPITEFUL), Span(0, 1), 80)
