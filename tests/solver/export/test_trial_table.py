"""Tables read back with the tools that people use."""

import csv
from dataclasses import replace

import numpy as np
import pyarrow.csv
import pytest
from pyarrow import parquet

from solver.capture.capture import Markers
from solver.capture.formats.analog_channels import AnalogChannels
from solver.common.errors import CaptureError
from solver.contact.wrenches import FrameMask
from solver.export.c3d_file import C3dRecording, write_c3d
from solver.export.export_places import notes_on_renamed
from solver.export.trial_table import export_analog, export_angles, export_csv, export_parquet


def read_csv(path):
    with path.open(newline="", encoding="utf-8") as file:
        names, *rows = list(csv.reader(file))
    return {name: [row[i] for row in rows] for i, name in enumerate(names)}


def with_trial(fit, **changes):
    return replace(fit, trials=(replace(fit.trials[0], **changes),))


def test_units_are_in_the_names_and_numbers_keep_every_digit(fit, tmp_path):
    (path,) = export_csv(fit, tmp_path / "csv")
    table = read_csv(path)
    dynamics, dofs = fit.trials[0].dynamics, list(fit.skeleton.dofs)
    for name, expected in {
        "time_s": dynamics.motion.times,
        "tx_m": dynamics.motion.q[:, dofs.index("tx")],
        "knee_angle_rad_s2": dynamics.motion.acceleration[:, dofs.index("knee_angle")],
        "knee_angle_moment_Nm": dynamics.joint_torques[:, dofs.index("knee_angle")],
        "ty_force_N": dynamics.joint_torques[:, dofs.index("ty")],
        "residual_moment_z_Nm": dynamics.residual_root[:, 5],
        "residual_raw_force_y_N": dynamics.residual_raw_root[:, 1],
        "com_y_m": dynamics.com_ground[:, 1],
        "foot_r_force_y_N": fit.trials[0].contacts.wrench_ground[:, 0, 1],
    }.items():
        np.testing.assert_array_equal([float(cell) for cell in table[name]], expected)
    assert table["frame"][:2] == ["0", "1"]


def test_no_number_is_an_empty_cell(fit, tmp_path):
    (path,) = export_csv(fit, tmp_path)
    assert read_csv(path)["foot_r_cop_x_m"][:20] == [""] * 20
    (path,) = export_parquet(fit, tmp_path)
    assert parquet.read_table(path)["foot_r_cop_x_m"].null_count == 50


def test_parquet_holds_the_same(fit, tmp_path):
    (as_text,), (as_parquet,) = export_csv(fit, tmp_path), export_parquet(fit, tmp_path)
    table, text = parquet.read_table(as_parquet), read_csv(as_text)
    assert table.column_names == list(text)
    np.testing.assert_array_equal(table["turn_rad"].to_numpy(), [float(cell) for cell in text["turn_rad"]])
    assert table.schema.field("used").type == "bool"


def test_why_a_force_does_not_count(fit, tmp_path):
    counts = np.ones((90, 1), dtype=bool)
    counts[30:32] = False
    reasons = ((30, 32, "foot_r", "notOverForcePlate"), (31, 32, None, "manualReview"))
    (path,) = export_csv(with_trial(fit, mask=FrameMask(counts, reasons)), tmp_path)
    table = read_csv(path)
    assert table["missing_force"][29:33] == [
        "",
        "foot_r: notOverForcePlate",
        "foot_r: notOverForcePlate; manualReview",
        "",
    ]
    assert table["foot_r_counts"][29:33] == ["true", "false", "false", "true"]


def test_which_torques_rest_on_an_predicted_wrench(fit, tmp_path):
    predicted = np.zeros((90, 1), dtype=bool)
    predicted[30:32] = True
    marked = with_trial(fit, dynamics=replace(fit.trials[0].dynamics, wrench_is_predicted=predicted))
    (path,) = export_csv(marked, tmp_path / "marked")
    assert read_csv(path)["foot_r_predicted"][29:33] == ["false", "true", "true", "false"]
    (path,) = export_csv(fit, tmp_path / "measured")
    assert set(read_csv(path)["foot_r_predicted"]) == {"false"}


def test_a_trial_without_forces(fit, tmp_path):
    bare = with_trial(fit, contacts=None, mask=None, dynamics=None)
    (path,) = export_parquet(bare, tmp_path)
    names = parquet.read_table(path).column_names
    assert "knee_angle_rad" in names
    assert not [name for name in names if "force" in name or "moment" in name]


def test_names_that_files_cannot_have(small_fit, tmp_path):
    paths = export_csv(small_fit, tmp_path)
    assert [path.name for path in paths] == ["walk.csv", "no_forces.csv"]


def test_a_folder_that_cannot_be_made(fit, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(CaptureError, match="choose another output folder"):
        export_csv(fit, tmp_path / "file" / "csv")


def test_trials_whose_names_look_alike_do_not_overwrite_each_other(small_fit, tmp_path):
    walk = small_fit.trials[0]
    trials = tuple(
        replace(walk, capture=replace(walk.capture, name=name)) for name in ("walk(1)", "walk[1]", "run")
    )
    fit = replace(small_fit, trials=trials)
    written = export_csv(fit, tmp_path)
    assert [path.name for path in written] == ["walk_1_.csv", "walk_1_-2.csv", "run.csv"]
    assert all(path.is_file() for path in written)
    assert [note[:40] for note in notes_on_renamed(fit)] == ["trial 'walk[1]' is written as walk_1_-2,"]
    alone = export_csv(replace(fit, trials=trials[1:2], subject=_of(fit, trials)), tmp_path)
    assert [path.name for path in alone] == ["walk_1_-2.csv"]


def _of(fit, trials):
    files = tuple(replace(fit.subject.trials[0], name=trial.capture.name) for trial in trials)
    return replace(fit.subject, trials=files)


def test_analog_channels_have_a_table_of_their_own_with_a_row_a_sample(fit, tmp_path):
    values = np.random.default_rng(4).normal(size=(200, 2)).astype(np.float32)
    markers = Markers(("A",), np.ones((100, 1, 3)), 50.0)
    analog = AnalogChannels(("soleus", "trigger"), ("mV", ""), values, 100.0)
    write_c3d(tmp_path / "walk.c3d", C3dRecording(markers, analog=analog))
    recorded = with_trial(fit, capture=replace(fit.trials[0].capture, files=(tmp_path / "walk.c3d",)))
    for suffix, read in ((".csv", pyarrow.csv.read_csv), (".parquet", parquet.read_table)):
        (path,), notes = export_analog(recorded, tmp_path, suffix)
        assert (path, notes) == (tmp_path / "analog" / f"walk{suffix}", ())
        table = read(path)
        assert table.column_names == ["time_s", "soleus_mV", "trigger"]
        np.testing.assert_allclose(table["time_s"], np.arange(200) / 100, atol=1e-12)
        np.testing.assert_array_equal(table["soleus_mV"], values[:, 0])


def test_a_recording_that_is_gone_costs_only_its_analog_channels(fit, tmp_path):
    gone = with_trial(fit, capture=replace(fit.trials[0].capture, files=(tmp_path / "gone.c3d",)))
    files, (note,) = export_analog(gone, tmp_path, ".csv")
    assert files == []
    assert "walk: analog channels are not written: " in note
    assert "gone.c3d: cannot be read" in note


def test_angles_stand_in_degrees_beside_opensims(fit, recorded_walk, tmp_path):
    skeleton, motion = recorded_walk
    trial = replace(fit.trials[0], motion=motion, dynamics=None, contacts=None, mask=None)
    (path,) = export_angles(replace(fit, skeleton=skeleton, trials=(trial,)), tmp_path, ".csv")
    assert path == tmp_path / "angles" / "walk.csv"
    table = pyarrow.csv.read_csv(path)
    knee = np.degrees(motion.q[:, skeleton.dofs.index("knee_angle_r")])
    np.testing.assert_allclose(table["opensim_knee_angle_r_deg"], knee)
    np.testing.assert_allclose(table["time_s"], motion.times)
    for name in ("cgm_knee_flexion_r_deg", "isb_knee_flexion_r_deg"):
        assert np.ptp(np.asarray(table[name]) - knee) < 1.0  # this knee also turns about its other axes
    assert "cgm_knee_adduction_r_deg" in table.column_names
    assert not [name for name in table.column_names if "pelvis_tx" in name]
