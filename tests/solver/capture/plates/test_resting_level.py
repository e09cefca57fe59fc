"""A level at which a plate rests while nobody is near it is its zero, whatever its size and sign."""

import tomllib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from addb_viewer import Plate, Subject
from solver.capture.capture import TrialFiles
from solver.capture.plates.conditioning import plate_loads
from solver.capture.plates.plate_levels import levelled
from solver.capture.plates.resting_level import resting_samples
from solver.capture.subject.subject import open_subject
from solver.capture.trial import read_recording, read_trial

newtons = st.floats(15.5, 900.0).flatmap(lambda size: st.sampled_from([size, -size]))
aside = st.floats(-60.0, 60.0)


@cache
def demo():
    """With moments of the plates' own, as in a C3D file."""
    subject = Subject.demo()  # a temporary folder lives as long as it does
    capture = read_trial(open_subject(subject.folder).trials[0])
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
    (changed, _), notes = levelled([offset(plate, level), capture.plates[k + 1]], capture.markers)
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
    recording = Subject.demo().recording("walk")
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
    changed, _ = levelled([capture.plates[0], offset(plate, level), *capture.plates[2:]], capture.markers)
    np.testing.assert_allclose(changed[1].force_ground, plate.force_ground, atol=2.5)


@pytest.mark.parametrize("up_N", [12.0, -71.0])
@pytest.mark.parametrize("hum_Hz", [50.0, 60.0, 180.0, 350.0])
def test_the_level_of_a_plate_that_hums_is_in_the_middle_of_its_swing(hum_Hz, up_N):
    """By 20 N to either side: a mains hum, or steps of a staircase that vibrate."""
    capture = demo()
    plate = capture.plates[1]
    swing = np.zeros((plate.samples, 6))
    swing[:, 1] = up_N + 20 * np.sin(2 * np.pi * hum_Hz * plate.times)
    changed, notes = levelled([capture.plates[0], offset(plate, swing), *capture.plates[2:]], capture.markers)
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
    plates, _ = levelled(short, capture.markers)
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
    changed, _ = levelled(plates, markers)
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
