"""Zeros that a program wrote at the ends of a recording are not an unloaded plate."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import TrialFiles
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.plates.conditioning import condition
from solver.capture.plates.edge_zeros import without_edge_zeros
from solver.capture.plates.moment_convention import plates_from_storage
from solver.capture.trial import read_trial
from solver.common.runs import runs


def zeroed_ends(table, first, last):
    values = table.values.copy()
    values[:first] = 0.0
    values[len(values) - last :] = 0.0
    return replace(table, values=values)


@pytest.mark.real
@pytest.mark.parametrize(("first", "last"), [(1, 1), (3, 0), (0, 6), (40, 25)])
def test_zeros_beside_a_loaded_row_are_not_measured(real_data, tmp_path, first, last):
    """Squats, both feet on plates all the time; a filter's delay left rows of zeros."""
    folder = real_data / "opencap_subject4"
    table = zeroed_ends(read_storage(folder / "ForceData/squats1_grf.mot"), first, last)
    write_storage(tmp_path / "f.mot", table.labels, table.times, table.values)
    capture = read_trial(TrialFiles("squats", folder / "MarkerData/squats1.trc", tmp_path / "f.mot"))
    notes = [note for note in capture.notes if "zero force next to a row under load" in note]
    assert [note.split(": ")[1] for note in notes] == ["ground_force_1", "ground_force_2"]
    plate = condition(capture.plates[0], capture.markers.times)
    lost = np.r_[np.arange(first), np.arange(len(plate.observed) - last, len(plate.observed))]
    np.testing.assert_array_equal(np.flatnonzero(~plate.observed), lost)
    inside = plate.force_ground[plate.observed, 1]
    assert inside.min() > 150  # no dip towards the zeros


@pytest.mark.real
def test_no_real_recording_here_loses_a_row(real_data):
    checked = 0
    for path in real_data.rglob("*.mot"):
        if path.parent.name != "reference" and "wild" not in path.parts:
            for plate in plates_from_storage(read_storage(path))[0]:
                assert without_edge_zeros(plate)[0] is plate, path
                checked += 1
    assert checked > 20


@pytest.mark.real
def test_a_foot_that_lands_within_the_first_rows_is_measured(real_data):
    """A drop jump at 100 Hz, cut two rows before the landing: 0, 0, 160, 564 N."""
    table = read_storage(real_data / "opencap_subject4/ForceData/DJ1_grf.mot")
    landing = replace(table, values=table.values[140:], times=table.times[140:], lines=table.lines[140:])
    for plate in plates_from_storage(landing)[0]:
        assert without_edge_zeros(plate)[1] == ()


@pytest.mark.real
@pytest.mark.parametrize(("first", "last"), [(1500, 0), (0, 1300)])
def test_a_run_that_stops_under_load_is_not_in_the_air_after_it(real_data, first, last):
    """The load changes by half within 50 ms, but by more than 500 N in half a millisecond at the zeros."""
    whole = read_storage(real_data / "run_treadmill_hamner2013_subject04/run400/grf.mot")
    table = zeroed_ends(whole, first, last)
    cut = 0
    for plate, as_it_was in zip(plates_from_storage(table)[0], plates_from_storage(whole)[0], strict=True):
        beside = as_it_was.force_ground[first if first else len(whole.times) - last - 1, 1]
        _, notes = without_edge_zeros(plate)
        assert bool(notes) == (beside > 500)
        cut += bool(notes)
    assert cut == 1


@pytest.mark.real
@pytest.mark.parametrize("rate", [None, 100.0])
def test_no_real_landing_or_leaving_is_taken_for_padding(real_data, rate):
    """Every recording that begins or ends within a swing, at its own rate and at a slow camera's."""
    checked = 0
    for path in sorted(real_data.rglob("*.mot")):
        if path.parent.name == "reference" or "wild" in path.parts:
            continue
        for plate in plates_from_storage(read_storage(path))[0]:
            step = 1 if rate is None else max(1, round(plate.rate / rate))
            slow = replace(
                plate,
                force_ground=plate.force_ground[::step],
                moment_ground=plate.moment_ground[::step],
                cop_ground=plate.cop_ground[::step],
                rate=plate.rate / step,
            )
            zero = (slow.force_ground == 0).all(axis=1)
            for start, end in runs(zero):
                if start == 0 or end == slow.samples or end - start < 2:
                    continue
                middle = (start + end) // 2
                for part in (slice(middle, None), slice(None, middle)):
                    cut = replace(
                        slow,
                        force_ground=slow.force_ground[part],
                        moment_ground=slow.moment_ground[part],
                        cop_ground=slow.cop_ground[part],
                    )
                    assert without_edge_zeros(cut)[0] is cut, (path, start)
                    checked += 1
    assert checked > 30
