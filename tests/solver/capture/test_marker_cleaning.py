import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.c3d import read_c3d_markers
from solver.capture.formats.trc import read_trc
from solver.capture.marker_cleaning import clean_markers


def swinging(rate=100.0, frames=200, count=4):
    """Markers on a leg that swings at running pace."""
    time = np.arange(frames)[:, None] / rate
    phase = np.arange(count)
    x = 0.6 * np.sin(2 * np.pi * 1.5 * time + phase)
    y = 0.3 * np.cos(2 * np.pi * 3.0 * time + phase)
    return Markers(tuple("ABCDEF"[:count]), np.stack([x + 4 * time, y, 0.1 * phase + 0 * x], axis=2), rate)


def changed(markers, place, value):
    positions = markers.positions_ground.copy()
    positions[place] = value
    return Markers(markers.names, positions, markers.rate)


def test_clean_markers_stay_as_they_are():
    markers = swinging()
    cleaned, notes = clean_markers(markers)
    np.testing.assert_array_equal(cleaned.positions_ground, markers.positions_ground)
    assert notes == ()


def test_a_spike_of_one_frame_goes_and_is_named():
    markers = swinging()
    spiked = changed(markers, (50, 1), markers.positions_ground[50, 1] + [0.0, 0.3, 0.2])
    cleaned, notes = clean_markers(spiked)
    assert np.isnan(cleaned.positions_ground[50, 1]).all()
    others = np.ones(markers.positions_ground.shape, bool)
    others[50, 1] = False
    np.testing.assert_array_equal(cleaned.positions_ground[others], markers.positions_ground[others])
    assert len(notes) == 1
    assert "B (frame 50)" in notes[0]


def test_a_short_stay_elsewhere_goes():
    markers = swinging()
    slipped = changed(markers, (slice(80, 85), 2), [3.0, 3.0, 3.0])
    cleaned, notes = clean_markers(slipped)
    missing = np.isnan(cleaned.positions_ground).any(axis=2)
    assert np.flatnonzero(missing[:, 2]).tolist() == [80, 81, 82, 83, 84]
    assert missing.sum() == 5
    assert "jumps there and back" in notes[0]


def test_a_jump_that_lasts_is_told_but_stays():
    markers = swinging()
    jumped = changed(markers, (slice(120, None), 0), markers.positions_ground[120:, 0] + [0.0, 2.0, 0.0])
    cleaned, notes = clean_markers(jumped)
    assert np.isfinite(cleaned.positions_ground).all()
    assert "A (frame 120)" in notes[0]
    assert "left as they are" in notes[0]


def test_a_step_across_a_gap_is_no_teleport():
    markers = swinging()
    gappy = changed(markers, (slice(60, 90), 1), np.nan)
    cleaned, notes = clean_markers(gappy)
    assert notes == ()
    np.testing.assert_array_equal(cleaned.positions_ground, gappy.positions_ground)


def test_a_spike_at_the_rim_of_a_gap_is_left():
    markers = changed(swinging(), (slice(60, 90), 1), np.nan)
    cleaned, _ = clean_markers(changed(markers, (59, 1), markers.positions_ground[59, 1] + 0.2))
    assert np.isfinite(cleaned.positions_ground[59, 1]).all()


@pytest.mark.parametrize("rate", [50.0, 100.0, 250.0, 1000.0])
def test_the_fastest_throw_is_no_artefact(rate):
    """A pitcher's hand: 40 m/s within 50 ms of rest, 800 m/s² and the same to stop it."""
    time = np.arange(0, 0.4, 1 / rate)
    speed = np.interp(time, [0.1, 0.15, 0.2], [0.0, 40.0, 0.0])
    x = np.cumsum(speed) / rate
    markers = Markers(("HAND",), np.stack([x, 0 * x, 0 * x + 1], axis=1)[:, None], rate)
    assert clean_markers(markers)[1] == ()


@pytest.mark.parametrize("rate", [30.0, 50.0, 100.0])
def test_a_shaken_hand_is_no_artefact(rate):
    """20 cm to either side nine times a second, 640 m/s²: slow cameras see it turn from frame to frame."""
    time = np.arange(0, 1, 1 / rate)
    y = 0.2 * np.cos(2 * np.pi * 9 * time)
    markers = Markers(("HAND",), np.stack([0 * y, y, 0 * y + 1], axis=1)[:, None], rate)
    assert clean_markers(markers)[1] == ()


@pytest.mark.parametrize("rate", [60.0, 100.0, 250.0])
def test_a_foot_that_strikes_the_ground_is_no_artefact(rate):
    """12 m/s forwards, then 0 from one frame to the next."""
    time = np.arange(0, 0.6, 1 / rate)
    x = 12 * np.minimum(time, 0.3)
    markers = Markers(("HEEL",), np.stack([x, 0 * x, 0 * x + 1], axis=1)[:, None], rate)
    assert clean_markers(markers)[1] == ()


def test_copies_and_empty_markers_are_named():
    markers = swinging()
    positions = markers.positions_ground.copy()
    positions[:, 1] = positions[:, 0]
    positions[30:60, 1] = np.nan
    positions[:, 3] = np.nan
    cleaned, notes = clean_markers(Markers(markers.names, positions, 100.0))
    assert cleaned.names == ("A", "B", "C")
    assert any("never seen: D" in note for note in notes)
    assert any("A and B have the same trajectory" in note for note in notes)
    assert np.isnan(cleaned.positions_ground[30:60, 1]).all()


REAL = (
    "run_treadmill_hamner2013_subject04/run400/markers.trc",
    "sprint_overground_dorn2012_JA1_9ms/run0900cms.trc",
    "sprint_overground_dorn2012_JA1_9ms/JA1Gait35.c3d",
    "opencap_subject4/MarkerData/DJ1.trc",
    "overground_camargo2021_AB06/levelground_ccw_fast_01_01.trc",
    "c3d_lab_trials/opensim_core/doubleLegLanding.c3d",
)


@pytest.mark.parametrize("name", REAL)
def test_fast_real_movement_is_not_touched(real_data, name):
    read = read_trc if name.endswith(".trc") else read_c3d_markers
    markers = read(real_data / name).markers
    cleaned, _ = clean_markers(markers)
    seen = np.isfinite(markers.positions_ground).all(axis=2)
    assert np.isfinite(cleaned.positions_ground).all(axis=2).sum() == seen.sum()


@pytest.mark.parametrize("name", REAL)
def test_swaps_put_into_real_movement_are_found(real_data, name):
    """Single frames in which a marker stands where another one of the body is, at least 25 cm away."""
    read = read_trc if name.endswith(".trc") else read_c3d_markers
    markers = read(real_data / name).markers
    rng = np.random.default_rng(9)
    positions = markers.positions_ground.copy()
    placed = []
    for frame in rng.choice(np.arange(5, markers.frames - 5, 6), 12, replace=False):
        one, two = rng.choice(len(markers.names), 2, replace=False)
        around = markers.positions_ground[frame - 1 : frame + 2, one]
        away = np.linalg.norm(markers.positions_ground[frame, two] - around[1])
        if np.isfinite(around).all() and away > 0.25:
            positions[frame, one] = markers.positions_ground[frame, two]
            placed.append((frame, one))
    assert len(placed) > 3
    cleaned, _ = clean_markers(Markers(markers.names, positions, markers.rate))
    kept = [cleaned.names.index(markers.names[one]) for _, one in placed]
    found = [
        np.isnan(cleaned.positions_ground[frame, k]).all() for (frame, _), k in zip(placed, kept, strict=True)
    ]
    assert np.mean(found) == 1.0
