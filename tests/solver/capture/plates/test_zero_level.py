"""Offsets of plates that were not tared are taken off; nothing else is."""

import tomllib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, filtfilt

from addb_viewer import Plate, Subject
from solver.capture.capture import ForcePlate, TrialFiles
from solver.capture.formats.storage import read_storage
from solver.capture.plates.conditioning import plate_loads
from solver.capture.plates.moment_convention import plates_from_storage
from solver.capture.plates.plate_levels import correct_signs_and_levels
from solver.capture.plates.zero_level import resting_samples, zeroed
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_recording, read_trial
from tests.demo_walk import demo_walk

RATE = 1000
newtons = st.floats(15.5, 900.0).flatmap(lambda size: st.sampled_from([size, -size]))
aside = st.floats(-60.0, 60.0)


def plate(vertical, noise=1.0, seed=0):
    """A plate at (0.5, 0, 0.3) under a vertical force, with amplifier noise on all channels."""
    rng = np.random.default_rng(seed)
    force = np.zeros((len(vertical), 3))
    force[:, 1] = vertical
    force += rng.normal(0, noise, force.shape) if noise else 0
    moment = np.cross([0.5, 0, 0.3], force)
    return ForcePlate("fp1", force, moment, np.full_like(force, np.nan), RATE)


def steps():
    """Two stances within three seconds."""
    vertical = np.zeros(3000)
    for start in (400, 1700):
        vertical[start : start + 700] = 800 * np.sin(np.pi * np.arange(700) / 700)
    return vertical


def biased(clean, force=(4.0, 12.0, -3.0), moment=(1.5, -0.5, 6.0)):
    return replace(clean, force_ground=clean.force_ground + force, moment_ground=clean.moment_ground + moment)


@pytest.mark.parametrize("vertical", [6.0, 12.0, -15.0, 30.0])
def test_an_offset_is_taken_off_everywhere(vertical):
    clean = plate(steps())
    tared, notes = zeroed(biased(clean, (4.0, vertical, -3.0)))
    np.testing.assert_allclose(tared.force_ground, clean.force_ground, atol=0.2)
    np.testing.assert_allclose(tared.moment_ground, clean.moment_ground, atol=0.1)
    assert len(notes) == 1
    assert "fp1: reads 4.0, " in notes[0]


@pytest.mark.parametrize("cutoff_Hz", [3.0, 3.8, 4.5, 6.0])
def test_what_a_slow_filter_leaves_between_steps_is_no_offset(cutoff_Hz):
    """Walking on two belts: 0.65 s on the plate, 0.4 s off it; a zero-phase filter rings below zero there."""
    stride, stance = 1050, 650
    vertical = np.zeros(6 * stride)
    for start in range(0, len(vertical), stride):
        phase = np.arange(stance) / stance
        vertical[start : start + stance] = 800 * np.sin(np.pi * phase) ** 0.4
    crisp = plate(vertical)
    smooth = replace(
        crisp,
        force_ground=filtfilt(*butter(2, cutoff_Hz, fs=RATE), crisp.force_ground, axis=0),
        moment_ground=filtfilt(*butter(2, cutoff_Hz, fs=RATE), crisp.moment_ground, axis=0),
    )
    assert smooth.force_ground[:, 1].min() < -14
    tared, notes = zeroed(smooth)
    np.testing.assert_allclose(tared.force_ground, smooth.force_ground, atol=1.5)
    assert not any("drifts" in note for note in notes)


@pytest.mark.parametrize("vertical", [15.0, -15.0])
def test_an_offset_of_smoothed_forces_is_taken_off(vertical):
    """Laboratories low-pass at 10 Hz and more, which leaves the time between steps flat."""
    crisp = biased(plate(steps()), (4.0, vertical, -3.0))
    b, a = butter(2, 10.0, fs=RATE)
    smooth = replace(crisp, force_ground=filtfilt(b, a, crisp.force_ground, axis=0))
    tared, _ = zeroed(smooth)
    off = (smooth.force_ground - tared.force_ground)[0]
    np.testing.assert_allclose(off, (4.0, vertical, -3.0), atol=0.5)


def test_an_offset_without_noise():
    tared, _ = zeroed(biased(plate(steps(), noise=0)))
    np.testing.assert_allclose(tared.force_ground, plate(steps(), noise=0).force_ground, atol=0.01)


@pytest.mark.parametrize(
    "vertical",
    [
        steps(),
        np.full(3000, 400.0),
        300 + 150 * np.sin(np.arange(3000) / 150),
        np.abs(900 * np.sin(np.arange(3000) / 200)) + 60,
        np.zeros(3000),
    ],
    ids=["tared steps", "standing", "swaying on both feet", "treadmill never unloaded", "never used"],
)
def test_plates_without_an_offset_are_left_alone(vertical):
    clean = plate(vertical)
    tared, notes = zeroed(clean)
    assert tared is clean
    assert notes == ()


def test_files_set_to_exact_zeros_are_left_alone_whatever_else_they_hold():
    clean = plate(steps(), noise=0)
    force = clean.force_ground.copy()
    force[2500:2800, 1] = 14  # the edge of a pulled cable, say; the file's own zero is zero
    held = replace(clean, force_ground=force)
    assert zeroed(held)[0] is held


def test_a_brief_dip_is_no_unloaded_stretch():
    vertical = np.full(3000, 300.0)
    vertical[1000:1030] = 15
    dipped = plate(vertical)
    assert zeroed(dipped)[0] is dipped


def test_drift_is_noted():
    clean = plate(steps())
    drifting = replace(clean, force_ground=clean.force_ground + np.outer(np.linspace(2, 12, 3000), [0, 1, 0]))
    _, notes = zeroed(drifting)
    assert any("drifts from" in note for note in notes), notes


def test_gaps_do_not_disturb():
    untared = biased(plate(steps()))
    untared.force_ground[100:200] = np.nan
    tared, _ = zeroed(untared)
    known = np.r_[0:100, 200:3000]
    np.testing.assert_allclose(tared.force_ground[known], plate(steps()).force_ground[known], atol=0.2)


@pytest.mark.real
def test_no_real_file_here_needs_taring(real_data):
    """All of them were tared or thresholded upstream; a taring that fires on them would invent an offset."""
    for path in real_data.rglob("*.mot"):
        if path.parent.name != "reference" and "wild" not in path.parts:
            for each in plates_from_storage(read_storage(path))[0]:
                assert zeroed(each)[1] == (), path


@pytest.mark.real
@pytest.mark.parametrize("file", ["walk_rajagopal2015/grf.mot", "walk_treadmill_stepwidth/example1/grf.mot"])
def test_an_offset_put_into_a_real_file_is_found(real_data, file):
    for clean in plates_from_storage(read_storage(real_data / file))[0]:
        centre = np.nanmedian(clean.cop_ground, axis=0)
        offset = np.array([3.0, 15.0, -5.0])
        tared, notes = zeroed(biased(clean, offset, np.cross(centre, offset)))
        assert len(notes) == 1
        np.testing.assert_allclose(tared.force_ground, clean.force_ground, atol=1.0)
        np.testing.assert_allclose(tared.moment_ground, clean.moment_ground, atol=1.0)


@cache
def demo():
    """With moments of the plates' own, as in a C3D file."""
    capture = read_trial(open_subject(demo_walk().folder).trials[0])
    return replace(capture, plates=tuple(replace(plate, point_ground=None) for plate in capture.plates))


def offset(plate, wrench, noise_N=0.3):
    """The plate with a wrench added to all it reads: one, or one for each sample."""
    noise = np.random.default_rng(0).normal(0, noise_N, plate.force_ground.shape)
    level = np.broadcast_to(wrench, (plate.samples, 6))
    return replace(
        plate,
        force_ground=plate.force_ground + level[:, :3] + noise,
        moment_ground=plate.moment_ground + level[:, 3:],
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 5), newtons, st.tuples(aside, aside), st.tuples(aside, aside, aside))
def test_any_zero_level_of_a_plate_that_is_seen_empty_comes_off_all_six_channels(
    k, up_N, across_N, moment_Nm
):
    capture = demo()
    plate = capture.plates[k]
    level = np.array([across_N[0], up_N, across_N[1], *moment_Nm])
    (changed, _), notes = correct_signs_and_levels(
        [offset(plate, level), capture.plates[k + 1]], capture.markers
    )
    np.testing.assert_allclose(changed.force_ground, plate.force_ground, atol=2.0)
    np.testing.assert_allclose(changed.moment_ground, plate.moment_ground, atol=0.5)
    np.testing.assert_allclose(changed.zero_ground, level, atol=0.5)
    assert [note.split(":")[0] for note in notes] == [plate.name]
    assert "while nobody is on it" in notes[0]
    loads, true = plate_loads(changed), plate_loads(plate)
    assert abs(int(loads.carrying.sum()) - int(true.carrying.sum())) <= 4


@pytest.mark.slow
@pytest.mark.parametrize("up_N", [-120.0, 71.0, 300.0])
def test_a_file_without_pressures_of_the_empty_plate_keeps_those_of_loads(up_N):
    """Its columns hold the pressure of force and level together, and none while the plate rests."""
    recording = demo_walk().recording("walk")
    plates = [
        Plate(plate.force + np.array([0.0, up_N * (k == 1), 0.0]), plate.times, moment=plate.moment)
        for k, plate in enumerate(recording.plates)
    ]
    subject = Subject.from_arrays(
        recording.markers,
        recording.marker_names,
        recording.times,
        plates=plates,
        up=recording.up,
        check=False,
    )
    found = read_trial(open_subject(subject.folder).trials[0]).plates[1]
    true = demo().plates[1]
    loaded = true.force_ground[:, 1] > 100
    off_m = np.linalg.norm(found.cop_ground - true.cop_ground, axis=1)[loaded]
    assert np.percentile(off_m, 95) < 0.02


@pytest.mark.parametrize("drift_N", [-35.0, 20.0])
def test_a_level_that_drifts_is_followed(drift_N):
    capture = demo()
    plate = capture.plates[1]
    level = np.zeros((plate.samples, 6))
    level[:, 1] = 90.0 + np.linspace(0, drift_N, plate.samples)
    changed, _ = correct_signs_and_levels(
        [capture.plates[0], offset(plate, level), *capture.plates[2:]], capture.markers
    )
    np.testing.assert_allclose(changed[1].force_ground, plate.force_ground, atol=2.5)


@pytest.mark.parametrize("up_N", [12.0, -71.0])
@pytest.mark.parametrize("hum_Hz", [50.0, 60.0, 180.0, 350.0])
def test_the_level_of_a_plate_that_hums_is_in_the_middle_of_its_swing(hum_Hz, up_N):
    """By 20 N to either side: a mains hum, or steps of a staircase that vibrate."""
    capture = demo()
    plate = capture.plates[1]
    swing = np.zeros((plate.samples, 6))
    swing[:, 1] = up_N + 20 * np.sin(2 * np.pi * hum_Hz * plate.times)
    changed, notes = correct_signs_and_levels(
        [capture.plates[0], offset(plate, swing), *capture.plates[2:]], capture.markers
    )
    assert changed[1].zero_ground[1] == pytest.approx(up_N, abs=2.0)
    assert [note.split(":")[0] for note in notes] == [plate.name]


@pytest.mark.parametrize("samples", [1, 2, 7, 20])
def test_a_recording_shorter_than_a_hum_is_read(samples):
    capture = demo()
    short = [
        replace(
            plate,
            force_ground=plate.force_ground[:samples],
            moment_ground=plate.moment_ground[:samples],
            cop_ground=plate.cop_ground[:samples],
        )
        for plate in capture.plates
    ]
    plates, _ = correct_signs_and_levels(short, capture.markers)
    assert [plate.samples for plate in plates] == [samples] * len(short)


@pytest.mark.parametrize("up_N", [0.0, 300.0])
def test_who_stands_still_on_two_plates_from_beginning_to_end_stays_there(up_N):
    """At a load that does not change by a newton; before the plates, nobody."""
    capture = demo()
    markers = replace(
        capture.markers,
        positions_ground=np.repeat(capture.markers.positions_ground[200:201], capture.markers.frames, axis=0),
    )
    middle = np.nanmedian(markers.positions_ground[0], axis=0) * [1, 0, 1]
    corners = middle + np.array([(1.0, 0, 1), (1, 0, -1), (-1, 0, -1), (-1, 0, 1)])
    plates = []
    for k, plate in enumerate(capture.plates[:2]):
        force = np.tile([0.0, 350.0 + up_N * k, 0.0], (plate.samples, 1))
        force += np.random.default_rng(k).normal(0, 0.3, force.shape)
        point = np.tile(middle + np.array([0, 0, 0.1 - 0.2 * k]), (plate.samples, 1))
        plates.append(
            replace(
                plate,
                force_ground=force,
                moment_ground=np.cross(point, force),
                cop_ground=point,
                point_ground=None,
                corners_ground=corners if up_N else None,
            )
        )
    assert not any(resting_samples(plate, markers).any() for plate in plates)
    changed, _ = correct_signs_and_levels(plates, markers)
    assert all(a is b for a, b in zip(changed, plates, strict=True))


def wild_plates(real_data):
    """Every plate of which a truth tells the zero level: what was read of it and what is so."""
    for truth in sorted((real_data / "wild/truth").glob("*.toml")):
        told = tomllib.loads(truth.read_text())
        for trial in told.get("trial", {}).values():
            files = [
                path for path in (real_data / "wild" / truth.stem).rglob("*.c3d")
                if str(path).endswith(trial["markers_file"])
            ]  # fmt: skip
            known = {
                int(key[5:]) - 1: plate
                for key, plate in trial.items()
                if key[5:].isdigit() and "zero_N" in plate
            }
            if files and known:
                recording = read_recording(TrialFiles("t", files[0]))
                yield from ((files[0].name, k, recording, plate) for k, plate in known.items())


@pytest.mark.real
def test_levels_of_plates_that_laboratories_left_are_found_or_none_is(real_data):
    found = 0
    for name, k, recording, truth in wild_plates(real_data):
        plate = recording.plates[k]
        resting = resting_samples(plate, recording.markers)
        zeroed = any(note.startswith(f"{name}: {plate.name}: zeroed by its mean") for note in recording.notes)
        unknown = not truth["zero_N"] and not truth["loaded"]
        if zeroed or unknown or not resting.any():
            continue
        rest_N = plate.force_ground[resting, 1]
        if rest_N.std() > truth["tolerance_N"]:
            continue  # of a plate that vibrates, the truth is the commonest reading, not the mean
        level = float(np.median(rest_N))
        assert level == pytest.approx(truth["zero_N"], abs=truth["tolerance_N"]), (name, k)
        found += 1
    assert found >= 20


@pytest.mark.real
def test_what_an_empty_plate_reads_is_no_load(real_data):
    """A child stands beside three plates that read 52, 89 and 76 N."""
    file = real_data / "wild/patient_bone_deformity_p01/session1/static01/c3dfile.c3d"
    if not file.is_file():
        pytest.skip(f"no {file}")
    capture = read_trial(TrialFiles("static01", file))
    assert not any(plate_loads(plate).carrying.any() for plate in capture.plates)
    assert sum("while nobody is on it" in note for note in capture.notes) == 3
