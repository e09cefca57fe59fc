"""What is shown as curves, as CSV files."""

from dataclasses import replace

import numpy as np
import pyarrow.csv
import pytest

from addb_viewer.app.curves.curves_controller import write_by_cycle, write_over_time
from addb_viewer.trial_view.by_cycle import CycledTrial
from addb_viewer.trial_view.trial_curves import TrialCurves
from solver.gait.cycles import Cycle
from solver.gait.trial_gait import Gait
from tests.made_std import made_std

CHOSEN = ("vertical force", "knee_angle angle", "knee_angle power", "pelvis_tx speed")


def test_over_time_a_row_a_frame_with_units_and_names(make_replay, tmp_path):
    replay = make_replay()
    replay.joints.position[7, 2] = np.nan
    rows = pyarrow.csv.read_csv(write_over_time(replay, CHOSEN, tmp_path / "curves" / "walk.csv")).to_pylist()
    assert len(rows) == replay.frames
    assert list(rows[0]) == [
        "frame", "time_s", "used", "vertical_force_right_N", "vertical_force_left_N", "pelvis_tx_m_s",
        "knee_angle_r_deg", "knee_angle_l_deg", "knee_angle_r_power_W", "knee_angle_l_power_W",
    ]  # fmt: skip
    assert (rows[30]["time_s"], rows[30]["vertical_force_right_N"]) == (2.3, 700.0)
    assert rows[30]["knee_angle_r_deg"] == pytest.approx(np.degrees(0.5 * np.sin(6 * 0.3)))
    assert rows[7]["knee_angle_l_deg"] is None
    assert [row["used"] for row in rows].index(True) == 20
    shared = write_over_time(replay, CHOSEN, tmp_path / "each.csv", per_kg=True)
    each = pyarrow.csv.read_csv(shared).to_pylist()[30]
    assert each["knee_angle_r_power_W_kg"] == pytest.approx(rows[30]["knee_angle_r_power_W"] / 80.0)
    assert each["knee_angle_r_deg"] == rows[30]["knee_angle_r_deg"]


def test_a_column_has_its_standard_deviations_behind_it(make_replay, tmp_path):
    replay = make_replay()
    replay = replace(replay, joints=replace(replay.joints, std=made_std(200, 3)))
    file = write_over_time(replay, ("knee_angle angle", "knee_angle power"), tmp_path / "w.csv", per_kg=True)
    row = pyarrow.csv.read_csv(file).to_pylist()[7]
    assert list(row)[3:9:2] == ["knee_angle_r_deg", "knee_angle_l_deg", "knee_angle_r_power_W_kg"]
    assert row["knee_angle_r_std_deg"] == pytest.approx(np.degrees(0.01))
    assert row["knee_angle_r_power_std_W_kg"] == pytest.approx(0.05 / 80)


def test_by_cycle_means_and_every_stride(make_replay, tmp_path):
    replay = make_replay()
    cycles = tuple(Cycle(0, s, s + 0.3, s + 0.5, 1.0, 0.5, 0.1) for s in (2.1, 2.6, 3.1))
    curves = TrialCurves("walk", 100.0, replay.times, replay.joints, replay.residual.used)
    curves = replace(curves, joints=replace(replay.joints, std=made_std(200, 3)))
    trial = CycledTrial(curves, Gait(("calcn_r", "calcn_l"), (), cycles))
    means, single = write_by_cycle(
        [trial], ("knee_angle angle", "knee_angle power"), tmp_path / "w_by_cycle.csv"
    )
    assert single.name == "w_by_cycle_strides.csv"
    rows = pyarrow.csv.read_csv(means).to_pylist()
    assert [(row["trial"], row["foot"], row["percent"]) for row in rows] == [
        ("walk", "right", percent) for percent in range(101)
    ]
    every = pyarrow.csv.read_csv(single).to_pylist()
    assert len(every) == 3 * 101
    at_40 = [row for row in every if row["percent"] == 40]
    assert [row["contact_s"] for row in at_40] == [2.1, 2.6, 3.1]
    angles = [row["knee_angle_deg"] for row in at_40]
    assert angles == pytest.approx(
        [np.degrees(0.5 * np.sin(6 * (s - 1.8))) for s in (2.1, 2.6, 3.1)], abs=0.05
    )
    assert rows[40]["knee_angle_deg_mean"] == pytest.approx(np.mean(angles))
    assert rows[40]["knee_angle_deg_sd"] == pytest.approx(np.std(angles, ddof=1))
    assert rows[40]["knee_angle_deg_within_sd"] == pytest.approx(np.degrees(0.01))
    assert (rows[40]["knee_angle_deg_strides"], rows[40]["knee_angle_power_W_strides"]) == (3, 2)
    assert [row["knee_angle_power_W"] is None for row in at_40] == [
        True,
        False,
        False,
    ]  # not all frames count


def test_without_strides_nothing_is_written(make_replay, tmp_path):
    replay = make_replay()
    curves = TrialCurves("walk", 100.0, replay.times, replay.joints, replay.residual.used)
    assert write_by_cycle([CycledTrial(curves, None)], CHOSEN, tmp_path / "none.csv") == []
    assert list(tmp_path.iterdir()) == []
