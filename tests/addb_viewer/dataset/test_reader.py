"""A release as those see it who load it."""

import subprocess
import sys

import numpy as np
import polars
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import addb_viewer.dataset
from addb_viewer.commands.cli import app
from addb_viewer.dataset.release_errors import ReleaseError


@pytest.fixture
def opened(release):
    return addb_viewer.dataset.open(release)


def test_counting_frames_unless_one_asks_for_all(release, opened):
    whole = pq.read_table(release / "frames")
    counts = whole["counts"].to_numpy()
    assert 0 < counts.sum() < len(counts)
    got = opened.frames(["tau_knee_angle_l"])
    assert got.column_names == ["subject_id", "trial_id", "segment", "frame", "tau_knee_angle_l"]
    assert got.num_rows == counts.sum()
    assert opened.frames(["time_s"], counting=False).num_rows == len(counts)
    only = opened.frames(["time_s"], counting=False, where={"subject_id": "Lab/at_100", "frame": [3, 4]})
    assert only["frame"].to_pylist() == [3, 4]


def test_segments_come_one_after_the_other(opened):
    found = dict(opened.segments(["time_s", "grf_r_y_N"], counting=False))
    assert list(found) == ["Lab/at_100/walk/0", "Lab/at_200/walk/0"]
    arrays = found["Lab/at_200/walk/0"]
    assert arrays["frame"].tolist() == list(range(len(arrays["time_s"])))
    np.testing.assert_allclose(np.diff(arrays["time_s"]), 0.01)
    assert np.isnan(arrays["grf_r_y_N"]).any()


def test_what_is_not_there_is_said_with_what_is(opened, tmp_path):
    with pytest.raises(ReleaseError, match=r"no column 'tau_knee'; nearest: .*tau_knee_angle_"):
        opened.frames(["tau_knee"])
    with pytest.raises(ReleaseError, match="no table 'frame'; nearest: frames"):
        opened.table("frame")
    with pytest.raises(ReleaseError, match="no split 'default'; make one: addb-viewer dataset split"):
        opened.frames(["time_s"], split="train")
    with pytest.raises(ReleaseError, match=r"no release, since it has no manifest\.json"):
        addb_viewer.dataset.open(tmp_path)


def test_polars_reads_the_same_rows(release, opened):
    lazy = polars.scan_parquet(release / "frames" / "*.parquet").filter(polars.col("counts"))
    rows = lazy.select("trial_id", "frame", "tau_ankle_angle_l").collect()
    ours = opened.frames(["tau_ankle_angle_l"])
    assert rows["frame"].to_list() == ours["frame"].to_pylist()
    assert rows["tau_ankle_angle_l"].to_list() == ours["tau_ankle_angle_l"].to_pylist()


def test_loading_takes_neither_the_solver_nor_scipy():
    code = "import sys, addb_viewer.dataset.reader; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"scipy", "pinocchio", "solver.fitting.pipeline", "dask"} & set(run.stdout.split())


def test_show_says_what_there_is_and_where_a_trial_comes_from(release):
    shown = CliRunner().invoke(app, ["dataset", "show", str(release)])
    assert shown.exit_code == 0
    assert "2 subjects, 2 persons, 2 trials, 2 segments" in shown.stdout
    assert "  Lab: 2 subjects, CC0-1.0" in shown.stdout
    shown = CliRunner().invoke(app, ["dataset", "show", str(release), "at_100/walk"])
    assert "right, footContactDetectedButNoForce (proposals)" in shown.stdout
    assert shown.stdout.count("sha256") >= 2
    shown = CliRunner().invoke(app, ["dataset", "show", str(release), "walk"])
    assert shown.exit_code == 1
    assert "several trials end so: Lab/at_100/walk, Lab/at_200/walk" in shown.output
