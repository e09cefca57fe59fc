"""The clock behind a printed time column."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from solver.capture.capture import TrialFiles
from solver.capture.clock import find_clock
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError

FOLDER = "walk_treadmill_stepwidth/example1"


def clock_of(times, header_rate=None):
    times = np.asarray(times, dtype=float)
    return find_clock(times, path=Path("x.trc"), lines=range(7, 7 + len(times)), header_rate=header_rate)


@settings(deadline=None)  # the machine may be busy
@given(
    rate=st.sampled_from(
        [25, 29.97, 30, 50, 59.94, 60, 100, 119.88, 120, 150, 200, 250, 300, 500, 600, 960, 1000, 2000]
    ),
    rows=st.integers(200, 3000),
    start=st.floats(0, 100),
    decimals=st.sampled_from([3, 4, 6]),
)
def test_recovers_the_rate_from_rounded_times(rate, rows, start, decimals):
    true = start + np.arange(rows) / rate
    clock = clock_of(np.round(true, decimals))
    assert clock.samples == rows
    assert clock.notes == ()
    span = true[-1] - true[0]
    assert clock.rate == pytest.approx(rate, rel=1.01 * 10.0**-decimals / span)


def test_the_median_step_would_be_wrong():
    times = np.round(np.arange(151) / 60, 3)
    assert 1 / np.median(np.diff(times)) == pytest.approx(58.82, abs=0.01)
    assert clock_of(times).rate == 60


def test_the_header_refines_what_rounding_hides():
    times = np.round(np.arange(11) / 119.88, 3)
    assert clock_of(times).rate != pytest.approx(119.88, abs=0.1)
    assert clock_of(times, header_rate=119.88).rate == 119.88


def test_the_time_column_wins_over_a_wrong_header():
    clock = clock_of(np.arange(100) / 200, header_rate=100)
    assert clock.rate == 200
    assert "header says 100 Hz, the time column 200 Hz" in clock.notes[0]


@pytest.mark.parametrize("times", [np.zeros(50), np.full(50, np.nan)])
def test_the_header_serves_where_times_say_nothing(times):
    clock = clock_of(times, header_rate=120)
    assert (clock.rate, clock.samples) == (120, 50)
    assert "unusable" in clock.notes[0]


def test_no_rate_at_all_is_an_error():
    with pytest.raises(CaptureError, match=r"x\.trc: the time column holds only one time"):
        clock_of(np.zeros(50))


def test_frame_numbers_in_place_of_times():
    clock = clock_of(np.arange(1, 51), header_rate=100)
    assert (clock.rate, clock.start_time) == (100, 0)
    assert "counts frames" in clock.notes[0]


@pytest.mark.parametrize("decimals", [2, 3, 6])
def test_missing_rows_become_gaps(decimals):
    true = np.round(np.arange(300) / 100, decimals)
    kept = np.delete(np.arange(300), [50, 51, 120])
    clock = clock_of(true[kept])
    np.testing.assert_array_equal(clock.sample, kept)
    assert clock.rate == pytest.approx(100)
    assert "3 rows are missing in 2 places" in clock.notes[0]
    placed = clock.placed(kept[:, None].astype(float))
    assert np.isnan(placed[[50, 51, 120]]).all()
    assert placed[121, 0] == 121


def test_missing_rows_of_a_rate_that_rounding_blurs():
    true = np.round(np.arange(300) / 60, 3)
    kept = np.delete(np.arange(300), [100, 200, 201])
    clock = clock_of(true[kept])
    np.testing.assert_array_equal(clock.sample, kept)
    assert clock.rate == pytest.approx(60, rel=1e-3)


def test_one_row_lost_where_a_period_is_the_last_digit():
    kept = np.delete(np.arange(200), 90)
    clock = clock_of(kept / 100)
    np.testing.assert_array_equal(clock.sample, kept)


def test_a_repeated_row_counts_once():
    clock = clock_of(np.r_[np.arange(50), np.arange(49, 100)] / 100)
    assert clock.samples == 100
    assert clock.rate == pytest.approx(100)
    assert "repeat the time before" in clock.notes[0]
    assert clock.placed(np.r_[np.zeros(50), 7.0, np.zeros(50)])[49] == 0


def test_time_running_backwards_names_the_line():
    with pytest.raises(CaptureError, match=r"x\.trc: line 57: time runs backwards, from 0\.49 to 0 s"):
        clock_of(np.r_[np.arange(50), np.arange(50)] / 100)


def test_a_missing_time_between_even_neighbours_follows_from_them():
    times = np.arange(60) / 100
    times[[4, 20, 21]] = np.nan
    clock = clock_of(times)
    np.testing.assert_array_equal(clock.sample, np.arange(60))
    assert clock.keep.all()
    assert clock.rate == pytest.approx(100)
    (note,) = clock.notes
    assert "lines 11, 27, 28, column 'time': the time is missing; it follows" in note


def test_a_missing_time_between_neighbours_that_do_not_tell_it_is_a_gap():
    """Three rows were lost beside the one that has no time: it may be any of the four."""
    times = np.delete(np.arange(60) / 100, [21, 22, 23])
    times[20] = np.nan
    clock = clock_of(times)
    values = clock.placed(np.arange(57.0)[:, None])[:, 0]
    assert np.flatnonzero(np.isnan(values)).tolist() == [20, 21, 22, 23]
    assert values[24] == 21
    assert any(
        "line 27, column 'time': the time is missing; it does not follow from the rows around" in note
        for note in clock.notes
    )


def test_missing_times_at_the_ends_are_left_out():
    times = 2.0 + np.arange(60) / 100
    times[[0, 1, 59]] = np.nan
    clock = clock_of(times)
    assert clock.start_time == pytest.approx(2.02)
    assert clock.samples == 57
    np.testing.assert_array_equal(clock.placed(np.arange(60.0)[:, None])[:, 0], np.arange(2, 59))


def test_where_every_other_row_has_a_time_those_are_read():
    """No two rows in succession have one, so nothing tells how many samples lie between."""
    times = np.arange(60) / 100
    times[1::2] = np.nan
    clock = clock_of(times)
    assert clock.rate == pytest.approx(50)
    np.testing.assert_array_equal(clock.placed(np.arange(60.0)[:, None])[:, 0], np.arange(0, 60, 2))
    assert any("lines 8, 10, 12, 14, 16 and 25 more" in note for note in clock.notes)


def test_times_of_events_are_an_error_that_names_the_line():
    times = np.cumsum(np.random.default_rng(3).exponential(0.01, 100))
    with pytest.raises(CaptureError, match=r"line \d+: the time steps are irregular"):
        clock_of(times)


@pytest.mark.parametrize("paused", [False, True])
def test_stamps_that_drift_by_many_steps_are_interpolated_with_a_note(paused):
    """Steps of 1.6 to 2.2 ms, as a program stamps rows when they arrive; and a pause of the recording."""
    order = np.arange(2000)
    steps = 0.0019 + 0.0003 * np.sin(order / 150)
    steps[1200] += 0.05 * paused
    times = 3.0 + np.cumsum(steps)
    clock = clock_of(times)
    assert clock.rate == pytest.approx(1 / 0.0019, rel=0.02)
    assert any("the time steps are irregular" in note and "resampled at" in note for note in clock.notes)
    moved = clock.moved(clock.placed(np.sin(9 * times)[:, None]))[:, 0]
    uniform = clock.start_time + np.arange(clock.samples) / clock.rate
    known = np.isfinite(moved)
    np.testing.assert_allclose(moved[known], np.sin(9 * uniform[known]), atol=0.01)
    away = np.abs(uniform[:, None] - times).min(axis=1)
    assert away[known].max() < 0.0012
    assert (~known).sum() * 0.0019 == pytest.approx(0.05 * paused, abs=0.004)
    assert uniform[-1] == pytest.approx(times[-1], abs=0.002)


@pytest.mark.parametrize("header_rate", [None, 100.0])
@pytest.mark.parametrize("lost", [(), (60, 61, 62, 200)])
def test_jitter_below_half_a_step_is_resampled_with_a_note(header_rate, lost):
    rng = np.random.default_rng(5)
    kept = np.delete(np.arange(300), lost)
    times = 2.0 + (kept + rng.uniform(-0.4, 0.4, len(kept))) / 100
    clock = clock_of(times, header_rate)
    assert clock.rate == pytest.approx(100, rel=2e-3)
    assert clock.samples == 300
    note = next(note for note in clock.notes if "irregular" in note)
    assert "resampled at" in note
    moved = clock.moved(clock.placed(np.sin(9 * times)[:, None]))[:, 0]
    uniform = clock.start_time + np.arange(300) / clock.rate
    assert np.isnan(moved[list(lost)]).all()
    known = np.isfinite(moved)
    assert known.sum() == len(kept)
    inner = known & (np.arange(300) > 0) & (np.arange(300) < 299)
    np.testing.assert_allclose(moved[inner], np.sin(9 * uniform)[inner], atol=4e-3)
    unmoved = np.full(300, np.nan)
    unmoved[kept] = np.sin(9 * times)
    assert np.nanmax(np.abs(unmoved - np.sin(9 * uniform))) > 0.03


def test_a_gap_off_the_beat_stays_a_gap():
    """The camera paused for 12.4 frames: rows are seen before and after it, and nothing is filled in."""
    times = np.r_[np.arange(50) / 100, 0.49 + 0.134 + np.arange(50) / 100]
    clock = clock_of(times)
    placed = clock.moved(clock.placed(np.arange(100.0)[:, None]))[:, 0]
    missing = np.isnan(placed)
    assert 11 <= missing.sum() <= 13
    assert missing[50 : 50 + missing.sum()].all()
    assert any("rows are missing" in note for note in clock.notes)


def test_repeated_and_backward_rows_are_all_named():
    times = np.arange(60) / 100 + 0.0004
    times[[20, 40]] = times[[19, 39]]
    assert any("lines 27, 47" in note for note in clock_of(times).notes)
    times[[10, 30]] = times[[8, 28]]
    with pytest.raises(CaptureError, match=r"line 17: time runs backwards, .*\(likewise line 37\)"):
        clock_of(times)


def test_two_recordings_in_one_file():
    with pytest.raises(CaptureError, match=r"line 57: time jumps from 0\.49 to 60 s"):
        clock_of(np.r_[np.arange(50), 6000 + np.arange(50)] / 100)


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
