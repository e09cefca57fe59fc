import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from addb_viewer.app.charts import Chart, Line, bridged, charts_of, thinned
from addb_viewer.app.palette import BLUE


def chart(values, shaded=None):
    return Chart("Force", "N", (Line("left", np.asarray(values, float), BLUE),), shaded)


def test_a_fitted_trial_has_four_charts_with_units(make_replay):
    charts = charts_of(make_replay())
    assert [c.heading for c in charts] == [
        "Marker error [cm]", "Vertical force [N]", "Residual force [N]", "Residual moment [N·m]"
    ]  # fmt: skip
    errors, forces, residual, moment = charts
    np.testing.assert_allclose(errors.lines[0].values, 3.0)  # every model marker is 3 cm off
    np.testing.assert_allclose(errors.lines[1].values, 3.0)
    assert [line.label for line in forces.lines] == ["plate 1", "plate 2"]
    assert residual.lines[0].values[-1] == pytest.approx(100.0)
    assert residual.lines[1].values[0] == 35.0
    assert moment.lines[1].values[0] == 12.0
    np.testing.assert_array_equal(residual.shaded, np.arange(200) < 20)


def test_charts_without_data_are_left_out(make_replay):
    assert [c.title for c in charts_of(make_replay(fitted=False))] == ["Vertical force"]
    assert [c.title for c in charts_of(make_replay(fitted=False, plates=0))] == []
    assert "Vertical force" not in [c.title for c in charts_of(make_replay(plates=0))]


def test_no_nan_leaves(make_replay):
    replay = make_replay()
    for plate in replay.plates:
        plate.force[100:] = np.nan
    for c in charts_of(replay):
        for curve in thinned(c, replay.times).with_cursor(2.5):
            assert np.isfinite(curve).all(), c.title


def test_unknown_stretches_are_shaded(make_replay):
    replay = make_replay()
    for plate in replay.plates:
        plate.force[100:] = np.nan
    forces = charts_of(replay)[1]
    np.testing.assert_array_equal(forces.shaded, np.arange(200) >= 100)


def test_thinning_keeps_every_peak():
    times = np.arange(10_000) / 1000
    values = np.zeros(10_000)
    values[1234], values[7777] = 5.0, -3.0
    points = thinned(chart(values), times, most=200)
    assert len(points.times) == 200
    assert points.curves[0].max() == 5.0
    assert points.curves[0].min() == -3.0
    assert abs(points.times[points.curves[0].argmax()] - 1.234) < 0.1
    assert np.all(np.diff(points.times) > 0)


def test_one_shaded_frame_shades_its_stretch():
    shaded = np.zeros(10_000, dtype=bool)
    shaded[5000] = True
    points = thinned(chart(np.zeros(10_000), shaded), np.arange(10_000.0), most=200)
    assert points.shaded.sum() == 2


@given(st.floats(-1.0, 12.0), st.integers(2, 50))
def test_the_cursor_is_one_spike_at_its_time(time, frames):
    times = np.linspace(0, 10, frames)
    moved, curve, shading, spike = thinned(chart(times**2), times).with_cursor(time)
    assert np.all(np.diff(moved) >= 0)
    assert moved[spike == 1.0].tolist() == [time]
    assert spike.sum() == 1.0
    inside = np.interp(time, times, times**2)
    np.testing.assert_allclose(curve[spike == 1.0], inside)
    assert len(curve) == len(shading) == frames + 3


def test_gaps_are_bridged_and_nothing_known_is_zero():
    np.testing.assert_array_equal(bridged(np.array([np.nan, 1, np.nan, 3, np.nan])), [1, 1, 2, 3, 3])
    np.testing.assert_array_equal(bridged(np.full(3, np.nan)), [0, 0, 0])
