"""A subject of two trials, and one of which hardly anything is left."""

from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from addb_viewer.dataset import frame_rows
from addb_viewer.dataset.build_task import Task
from addb_viewer.dataset.release_subject import BuildOptions, ReleaseSubject
from addb_viewer.dataset.subject_files import SubjectWriting
from addb_viewer.dataset.trial_labels import labels_of
from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.fitting.settings import Settings

WHO = ReleaseSubject("Lab", "P1", "one", None, "CC0-1.0", "public", None, None, ())


@pytest.fixture
def twice(fit_100):
    """The walk under two names; in the second a stretch is erroneous, and labels have a person's name."""
    (trial,) = fit_100.trials
    reasons = ((20, 60, None, "erroneous"), (64, 70, None, "erroneous"))
    counts = trial.mask.counts.copy()
    counts[20:60] = counts[64:70] = False
    mask = replace(trial.mask, counts=counts, reasons=reasons, sources=("review", "review"))
    names = tuple(f"Anna:{name}" for name in trial.capture.markers.names)
    markers = replace(trial.capture.markers, names=names)
    match = fit_100.groundwork.match
    spelt = tuple((*each, *(f"Anna:{name}" for name in each)) for each in match.measured)
    other = replace(trial, capture=replace(trial.capture, name="again", markers=markers), mask=mask)
    groundwork = replace(fit_100.groundwork, match=replace(match, measured=spelt))
    return replace(fit_100, trials=(trial, other), groundwork=groundwork)


def written(fit, folder):
    task = Task("k", fit.subject.folder, WHO, (), BuildOptions(), folder, 0)
    (said,) = labels_of(fit.subject, fit.subject.trials, [fit.trials[0].capture]).values()
    labels = {trial.capture.name: said for trial in fit.trials}
    return SubjectWriting(task, fit, Settings(), None, labels).receipt(())


def test_trials_follow_each_other_in_every_file_and_end_at_erroneous_stretches(twice, tmp_path):
    receipt = written(twice, tmp_path / "out")
    again, walk = receipt.rows["trials"]
    frames = pq.read_table(tmp_path / "out" / "frames" / "Lab__one.parquet")
    whole = twice.trials[0].motion.frames
    kept = [*range(20), *range(70, whole)]
    assert (again["trial_id"], walk["trial_id"]) == ("Lab/one/again", "Lab/one/walk")
    assert (again["frames_rows"], walk["frames_first_row"], walk["frames_rows"]) == (
        len(kept),
        len(kept),
        whole,
    )
    assert frames["frame"].to_pylist() == [*kept, *range(whole)]
    assert frames["segment"].to_pylist() == [0] * 20 + [1] * (whole - 70) + [0] * whole
    knee = frames["tau_knee_angle_l"].to_numpy()
    assert (knee[:20] == knee[len(kept) : len(kept) + 20]).all()
    told = [(row.id, row.reason, row.start_frame, row.end_frame) for row in receipt.left_out]
    assert told == [
        ("Lab/one/again", "erroneous", 20, 60),
        ("Lab/one/again", "erroneous", 64, 70),
        ("Lab/one/again", "too_short", 60, 64),
    ]
    b3d = read_b3d(tmp_path / "out" / "b3d" / "Lab__one.b3d")
    pieces = [
        (t.header.original_name, t.header.split_index, t.header.original_start_frame) for t in b3d.trials
    ]
    assert pieces == [("again", 0, 0), ("again", 1, 70), ("walk", 0, 0)]
    second, last = b3d.trials[1], b3d.trials[2]
    assert second.header.trial_length == whole - 70
    assert second.header.original_start_time == pytest.approx(last.header.original_start_time + 0.7, abs=1e-6)
    for series in ("pos", "com_acc", "world_frame_joint_centers"):
        np.testing.assert_array_equal(
            np.array(getattr(second.passes[-1], series)), np.array(getattr(last.passes[-1], series))[70:]
        )
    assert not list((tmp_path / "out").glob("*.b3d"))


def test_no_file_tells_the_name_before_a_marker(twice, tmp_path):
    written(twice, tmp_path / "out")
    for path in (tmp_path / "out").rglob("*"):
        assert not path.is_file() or b"Anna" not in path.read_bytes(), path
    markers = pq.read_table(tmp_path / "out" / "markers" / "Lab__one.parquet")
    by_trial = {
        trial: set(rows["marker"].to_pylist())
        for trial in ("Lab/one/again", "Lab/one/walk")
        if (rows := markers.filter(np.array(markers["trial_id"].to_pylist()) == trial)).num_rows
    }
    assert by_trial["Lab/one/again"] == by_trial["Lab/one/walk"]


def test_a_trial_without_a_segment_is_in_no_file(twice, tmp_path):
    trial = twice.trials[0]
    reasons = ((0, trial.motion.frames - 11, None, "erroneous"),)
    counts = np.zeros_like(trial.mask.counts)
    mask = replace(trial.mask, counts=counts, reasons=reasons, sources=("review",))
    receipt = written(replace(twice, trials=(replace(trial, mask=mask),)), tmp_path / "out")
    assert not receipt.files
    assert [row.reason for row in receipt.left_out] == ["erroneous", "too_short", "no_trials"]


def test_long_tables_that_come_name_by_name_have_the_same_rows(fit_100, tmp_path, monkeypatch):
    once = written(fit_100, tmp_path / "once")
    monkeypatch.setattr(frame_rows, "FRAMES_AT_ONCE", 10)
    apart = written(fit_100, tmp_path / "apart")

    assert apart.rows == once.rows
    for table in ("markers", "joint_centres", "plates"):
        file = f"{table}/Lab__one.parquet"
        assert pq.read_table(tmp_path / "apart" / file).equals(pq.read_table(tmp_path / "once" / file))
    assert apart.files["b3d/Lab__one.b3d"] == once.files["b3d/Lab__one.b3d"]
