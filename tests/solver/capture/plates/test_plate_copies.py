"""Plates that hold the forces of others once more count once; plates with forces of their own all count."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from addb_viewer import Subject
from solver.capture.capture import TrialFiles
from solver.capture.plates.plate_copies import without_copies
from solver.capture.subject.subject import open_subject
from solver.capture.trial import read_recording, read_trial


@pytest.fixture(scope="module")
def plates():
    """Three plates that are stepped on one after the other, and one that nobody uses."""
    subject = Subject.demo()
    read = read_trial(open_subject(subject.folder).trials[0]).plates
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
