"""Recordings whose rows were taken at uneven moments, or not at all: read, resampled, and never filled."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from solver.capture.capture import TrialFiles
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.trial import read_trial

FOLDER = "walk_treadmill_stepwidth/example1"


def write_uneven(path, markers, times):
    """The markers as seen at these times; write_trc prints even ones, so the column is put in place."""
    even = CubicSpline(markers.times, markers.positions_ground)
    write_trc(path, replace(markers, positions_ground=even(times)), "mm")
    lines = path.read_text(encoding="utf-8").splitlines()
    for k, time in enumerate(times):
        cells = lines[6 + k].split("\t")
        lines[6 + k] = "\t".join([cells[0], f"{time:.6f}", *cells[2:]])
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.fixture
def walk(real_data):
    folder = real_data / FOLDER
    return TrialFiles("walk", folder / "markers.trc", folder / "grf.mot")


def uneven(times, seed, jitter=0.4):
    step = (times[-1] - times[0]) / (len(times) - 1)
    shift = np.random.default_rng(seed).uniform(-jitter, jitter, len(times)) * step
    shift[[0, -1]] = 0.0
    return times + shift


@pytest.mark.real
def test_markers_and_forces_that_jitter_come_back(walk, tmp_path):
    original = read_trial(walk)
    markers = read_trc(walk.markers).markers
    write_uneven(tmp_path / "m.trc", markers, uneven(markers.times, 1))
    table = read_storage(walk.forces)
    times = uneven(table.times, 2)
    values = CubicSpline(table.times, table.values)(times)
    write_storage(tmp_path / "f.mot", table.labels, times, values)
    read = read_trial(TrialFiles("walk", tmp_path / "m.trc", tmp_path / "f.mot"))
    assert sum("the time steps are irregular" in note for note in read.notes) == 2, read.notes
    assert read.markers.rate == pytest.approx(original.markers.rate, rel=1e-3)
    inner = slice(5, -5)
    seen_at = CubicSpline(original.markers.times, original.markers.positions_ground)
    truth = seen_at(read.markers.times)
    off_mm = 1000 * np.linalg.norm(read.markers.positions_ground - truth, axis=2)[inner]
    unmoved = (
        1000
        * np.linalg.norm(
            CubicSpline(original.markers.times, original.markers.positions_ground)(uneven(markers.times, 1))
            - truth,
            axis=2,
        )[inner]
    )
    assert np.percentile(off_mm, 99) < 1.0
    assert np.percentile(unmoved, 99) > 5.0
    plate, whole = read.plates[0], original.plates[0]
    vertical = CubicSpline(whole.times, whole.force_ground[:, 1])(plate.times)
    off_N = np.abs(plate.force_ground[:, 1] - vertical)[inner]
    assert np.sqrt(np.mean(off_N**2)) < 12


@pytest.mark.real
def test_a_pause_in_the_recording_stays_unseen(walk, tmp_path):
    """The cameras paused for 31.4 frames and went on off the beat."""
    markers = read_trc(walk.markers).markers
    lines = walk.markers.read_text(encoding="utf-8").splitlines()
    first = next(k for k, line in enumerate(lines) if line.split("\t")[0] == "1")
    kept = []
    for line in lines[first:]:
        cells = line.split("\t")
        frame = int(cells[0])
        if not 200 < frame <= 231:
            time = float(cells[1]) + (0.004 if frame > 200 else 0.0)
            kept.append("\t".join([cells[0], f"{time:.4f}", *cells[2:]]))
    (tmp_path / "m.trc").write_text("\n".join([*lines[:first], *kept]) + "\n", encoding="utf-8")
    read = read_trial(TrialFiles("walk", tmp_path / "m.trc"))
    unseen = np.isnan(read.markers.positions_ground).all(axis=(1, 2))
    assert 30 <= unseen.sum() <= 32
    assert unseen[200 : 200 + unseen.sum()].all()
    assert abs(read.markers.frames - markers.frames) <= 1
    assert any("rows are missing" in note for note in read.notes)


@pytest.mark.real
def test_a_blank_time_in_markers_and_forces_costs_nothing(walk, tmp_path):
    """One cell of each file's time column was lost in an export."""
    original = read_trial(walk)
    for source, name, column in ((walk.markers, "m.trc", 1), (walk.forces, "f.mot", 0)):
        lines = source.read_text(encoding="utf-8").splitlines()
        k = len(lines) - 40
        cells = lines[k].split("\t")
        cells[column] = ""
        lines[k] = "\t".join(cells)
        (tmp_path / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    read = read_trial(TrialFiles("walk", tmp_path / "m.trc", tmp_path / "f.mot"))
    np.testing.assert_array_equal(read.markers.positions_ground, original.markers.positions_ground)
    for plate, whole in zip(read.plates, original.plates, strict=True):
        np.testing.assert_array_equal(plate.force_ground, whole.force_ground)
    said = [note for note in read.notes if "the time is missing; it follows" in note]
    assert {note.split(":")[0] for note in said} == {"m.trc", "f.mot"}
