"""Plates that hold the forces of others once more count once; plates with forces of their own all count."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.capture.capture import TrialFiles
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.plates.conditioning import condition
from solver.capture.plates.moment_convention import plates_from_storage
from solver.capture.plates.program_artefacts import without_copies, without_edge_zeros
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_recording, read_trial
from solver.common.true_runs import runs
from tests.demo_walk import demo_walk


@pytest.fixture(scope="module")
def plates():
    """Three plates that are stepped on one after the other, and one that nobody uses."""
    read = read_trial(open_subject(demo_walk().folder).trials[0]).plates
    return (*read[1:4], read[7])


def times(plate, scale, zero_N=0.0, noise_N=0.0, name="copy"):
    noise = np.random.default_rng(1).normal(0, noise_N, plate.force_ground.shape) if noise_N else 0.0
    return replace(
        plate,
        name=name,
        force_ground=scale * plate.force_ground + [0, zero_N, 0] + noise,
        moment_ground=scale * plate.moment_ground,
    )


def names(plates):
    return {plate.name for plate in plates}


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 2),
    st.sampled_from([1.0, -1.0, 0.98, 1e-3, -1e-3, 1 / 4.448, 1 / 9.80665]),
    st.floats(-100, 100),
    st.randoms(),
)
def test_a_copy_in_whatever_unit_sign_and_zero_level_counts_once(plates, k, scale, zero_N, order):
    copy = times(plates[k], scale, zero_N * abs(scale), noise_N=0.5 * abs(scale))
    mixed = [*plates, copy]
    order.shuffle(mixed)
    left, notes = without_copies(mixed)
    gone = {"copy", plates[k].name} - names(left)
    assert len(left) == len(plates)
    assert len(gone) == 1
    if abs(scale) < 0.5:
        assert gone == {"copy"}
    assert "once more" in notes[0]
    assert all(name in notes[0] for name in ("copy", plates[k].name))


def test_a_plate_that_is_the_sum_of_others_is_left_out(plates):
    first, second, third, _ = plates
    whole = replace(
        first,
        name="all",
        force_ground=first.force_ground + second.force_ground + third.force_ground,
        moment_ground=first.moment_ground + second.moment_ground + third.moment_ground,
    )
    left, notes = without_copies([whole, *plates])
    assert names(left) == names(plates)
    assert f"all ({first.name} + {second.name} + {third.name})" in notes[0]


def test_plates_with_forces_of_their_own_stay(plates):
    """The same load on another place is another foot's: two feet jump alike."""
    other = replace(
        plates[0],
        name="other foot",
        moment_ground=plates[0].moment_ground + np.cross([0.0, 0.0, 0.25], plates[0].force_ground),
    )
    given_plates = (*plates, other)
    left, notes = without_copies(given_plates)
    assert all(a is b for a, b in zip(left, given_plates, strict=True))
    assert notes == ()


@pytest.mark.real
def test_no_recording_of_a_sound_laboratory_loses_a_plate(real_data):
    for folder in ("opencap_subject4", "walk_treadmill_stepwidth", "overground_camargo2021_AB06"):
        for files in open_subject(real_data / folder).trials:
            recording = read_recording(files)
            assert without_copies(recording.plates)[0] == recording.plates


@pytest.mark.real
def test_a_treadmill_whose_file_holds_all_forces_four_times_weighs_its_person(real_data):
    file = real_data / "wild/treadmill_plates_twice_TD31/fws_end01.c3d"
    if not file.is_file():
        pytest.skip(f"no {file}")
    capture = read_trial(TrialFiles("fws_end01", file))
    total_N = sum(plate.force_ground[:, 1] for plate in capture.plates)
    assert np.mean(total_N) / 9.80665 == pytest.approx(50.6, abs=2)
    assert any("plate 7 (plate 1)" in note for note in capture.notes)


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
