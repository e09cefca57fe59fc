"""Events and cycles of a recorded walk as files."""

import json
from pathlib import Path

import pyarrow.csv
import pyarrow.parquet
import pytest

from solver.export.trial_table import export_csv, export_parquet


@pytest.mark.slow
@pytest.mark.real
def test_a_walk_has_events_and_cycles_in_files(recorded_fit, tmp_path):
    fit = recorded_fit("walk_gait2354_subject01")
    as_text = {path.name: path for path in export_csv(fit, tmp_path / "csv")}
    as_parquet = {path.name: path for path in export_parquet(fit, tmp_path / "parquet")}
    assert set(as_text) == {"walk1.csv", "events.csv", "cycles.csv", "curves.csv", "gait.json"}
    names = {Path(name).stem for name in as_text}
    assert {Path(name).stem for name in as_parquet} == names
    told = json.loads(as_text["gait.json"].read_text())
    for name in ("events", "cycles"):
        rows = pyarrow.csv.read_csv(as_text[f"{name}.csv"]).to_pylist()
        assert rows == pyarrow.parquet.read_table(as_parquet[f"{name}.parquet"]).to_pylist() == told[name]
        assert rows
    events = told["events"]
    assert [event["time_s"] for event in events] == sorted(event["time_s"] for event in events)
    assert {event["source"] for event in events} == {"force"}
    for cycle in told["cycles"]:
        assert cycle["contact_s"] < cycle["foot_off_s"] < cycle["next_contact_s"]
        assert cycle["speed_m_s"] == pytest.approx(1.2, abs=0.1)  # the belt's, by the standing feet
    assert set(told["cycles"][0]) - {"trial", "foot", "contact_s", "foot_off_s", "next_contact_s"} <= set(
        told["definitions"]
    )
    curves = pyarrow.csv.read_csv(as_text["curves.csv"]).to_pylist()
    own = [row for row in curves if row["foot"] == "calcn_r"]
    assert [row["percent"] for row in own] == list(range(101))
    (cycle,) = [cycle for cycle in told["cycles"] if cycle["foot"] == "calcn_r"]
    table = pyarrow.csv.read_csv(as_text["walk1.csv"]).to_pylist()
    middle = (cycle["contact_s"] + cycle["next_contact_s"]) / 2
    near = min(table, key=lambda row: abs(row["time_s"] - middle))
    assert own[50]["knee_angle_rad_mean"] == pytest.approx(near["knee_angle_r_rad"], abs=0.06)
    assert own[50]["knee_angle_rad_strides"] == 1
    assert own[50]["knee_angle_rad_sd"] is None
    assert {"hip_flexion_moment_Nm_mean", "ankle_angle_power_W_sd", "pelvis_tilt_rad_mean"} <= set(own[0])
    power = pyarrow.parquet.read_table(as_parquet["walk1.parquet"])
    used = fit.trials[0].dynamics.used
    ankle = power["ankle_angle_r_power_W"].to_numpy()[used]
    assert ankle.max() > 100  # push-off of an adult delivers two to four watts a kilogram
    torque, rate = (power[f"ankle_angle_r_{what}"].to_numpy()[used] for what in ("moment_Nm", "rad_s"))
    assert ankle == pytest.approx(torque * rate)
