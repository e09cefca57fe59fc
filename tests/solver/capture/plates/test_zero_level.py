"""Offsets of plates that were not tared are taken off; nothing else is."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from solver.capture.capture import ForcePlate
from solver.capture.formats.storage import read_storage
from solver.capture.plates.moment_convention import plates_from_storage
from solver.capture.plates.zero_level import zeroed

RATE = 1000


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
