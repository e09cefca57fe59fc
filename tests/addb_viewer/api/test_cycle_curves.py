"""Curves over the gait cycle, against a slow statement; and what a foot out of sight cannot tell."""

from types import SimpleNamespace

import numpy as np
import pytest

from addb_viewer import Series
from addb_viewer.api.cycle_curves import curves, foot_of
from addb_viewer.api.labelled import UnknownNameError
from solver.gait.cycles import Cycle

RATE = 100.0


def trial(used=slice(None), name="walk"):
    times = 3.0 + np.arange(301) / RATE
    knee = 40 * np.sin(2 * np.pi * times / 1.1)
    values = np.column_stack([np.zeros(301), knee])
    counted = np.zeros(301, dtype=bool)
    counted[used] = True
    series = Series(values, ("hip_flexion_r", "knee_angle_r"), ("Nm", "Nm"), times)
    return SimpleNamespace(
        name=name, times=times, frames=301, used=counted, torques=series, coordinates=series
    )


def cycle(start, end):
    return Cycle(0, start, start + 0.6, end, 1.4, 0.7, 0.1)


def test_a_curve_is_the_quantity_at_shares_of_its_cycle():
    walk = trial()
    found = curves(
        [(walk, cycle(3.2, 4.3)), (walk, cycle(4.3, 5.42))],
        "torques",
        "knee_angle_r",
        points=101,
        measured_only=True,
    )
    assert found.values.shape == (2, 101)
    assert found.unit == "Nm"
    assert found.trials == ("walk", "walk")
    for row, (start, end) in zip(found.values, ((3.2, 4.3), (4.3, 5.42)), strict=True):
        for percent, value in zip(found.percent, row, strict=True):
            time = start + percent / 100 * (end - start)
            assert value == pytest.approx(40 * np.sin(2 * np.pi * time / 1.1), abs=0.05)
    assert found.mean[30] == pytest.approx((found.values[0, 30] + found.values[1, 30]) / 2)
    assert found.std[30] == pytest.approx(abs(found.values[0, 30] - found.values[1, 30]) / np.sqrt(2))


def test_what_rests_on_forces_has_no_value_where_they_do_not_count():
    walk = trial(used=slice(50, 301))  # from 3.5 s on
    one = [(walk, cycle(3.2, 4.2))]
    torque = curves(one, "torques", "knee_angle_r", points=11, measured_only=True).values[0]
    assert np.flatnonzero(np.isfinite(torque)).tolist() == list(range(3, 11))
    everything = curves(one, "torques", "knee_angle_r", points=11, measured_only=False)
    angle = curves(one, "coordinates", "knee_angle_r", points=11, measured_only=True)
    assert np.isfinite(everything.values).all()
    assert np.isfinite(angle.values).all()


def test_no_cycle_is_no_curve_and_no_warning():
    none = curves([], "torques", "knee_angle_r", points=11, measured_only=True)
    assert len(none) == 0
    assert np.isnan(none.mean).all()


def test_the_side_in_a_name_tells_the_foot():
    feet = ("calcn_r", "calcn_l")
    assert foot_of("knee_angle_l", feet) == "calcn_l"
    with pytest.raises(UnknownNameError, match="no foot for 'lumbar_extension'"):
        foot_of("lumbar_extension", feet)
