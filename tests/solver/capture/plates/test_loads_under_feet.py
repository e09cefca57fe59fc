"""Loads under feet: right pairs of every gait, and how seldom forces of another stretch pass for right."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from solver.capture.capture import Markers, TrialFiles
from solver.capture.plates.loads_under_feet import (
    CONTRADICTION_NATS,
    Feet,
    Loads,
    best_lag_s,
    evidence,
    feet_of,
    loads_of,
    under_feet,
)
from solver.capture.subject.force_pairing import TAKEN_NATS
from solver.capture.trial import read_trial

GAITS = {
    "treadmill walk": (
        "walk_treadmill_stepwidth/example1/markers.trc",
        "walk_treadmill_stepwidth/example1/grf.mot",
    ),
    "treadmill run": (
        "run_treadmill_hamner2013_subject04/run400/markers.trc",
        "run_treadmill_hamner2013_subject04/run400/grf.mot",
    ),
    "walkway": (
        "overground_camargo2021_AB06/levelground_ccw_fast_01_01.trc",
        "overground_camargo2021_AB06/levelground_ccw_fast_01_01_grf.mot",
    ),
}
EVERY_S = 0.1


@pytest.fixture
def gait(real_data):
    return lambda name: read_trial(TrialFiles(name, *(real_data / file for file in GAITS[name])))


@pytest.mark.parametrize("name", GAITS)
def test_loads_of_the_same_recording_lie_under_the_feet_whatever_the_labels(gait, name):
    capture = gait(name)
    nonsense = replace(capture.markers, names=tuple(f"M{k}" for k in range(len(capture.markers.names))))
    found = evidence(feet_of(nonsense), loads_of(capture.plates))
    assert found.log_odds > 0.5
    assert found.off_m < 0.02


def test_forces_of_another_stretch_of_the_same_gait_seldom_pass(gait):
    """As a force file of another trial of the same person: names silent, cut at any moment."""
    passed = tried = 0
    for name in GAITS:
        capture = gait(name)
        markers, start = capture.markers, capture.markers.start_time
        half = (markers.frames - 1) / markers.rate / 2
        first = markers.times - start <= half
        feet = feet_of(Markers(markers.names, markers.positions_ground[first], markers.rate, start))
        loads = loads_of(capture.plates)
        for later in np.arange(EVERY_S, half, EVERY_S):
            moved = loads.times - later
            kept = (moved >= start) & (moved <= start + half)
            stretch = Loads(moved[kept], loads.centres[kept], loads.steps[kept], start, start + half)
            passed += evidence(feet, stretch).log_odds >= TAKEN_NATS
            tried += 1
    assert tried > 80
    assert passed <= 0.02 * tried


def test_feet_that_stay_in_place_tell_nothing():
    times = np.arange(0, 5, 0.01)
    foot = np.array([[0.0, 0.0], [0.2, 0.0]])
    feet = Feet(times, np.tile(foot, (len(times), 1, 1)), 100.0, np.ones(len(times), dtype=bool), True)
    loads = Loads(times, np.tile([0.1, 0.0], (len(times), 1)), (times // 0.6).astype(int), 0.0, 5.0)
    assert evidence(feet, loads).log_odds == pytest.approx(0.0, abs=0.01)
    assert under_feet(feet, loads).log_odds > 5.0


def test_loads_that_come_late_are_found_by_how_much():
    """A foot that steps on by a metre every second; its loads are recorded 0.3 s late."""
    times = np.arange(0, 10, 0.01)
    places = np.floor(times)[:, None, None] * [1.0, 0.0]
    positions = places + np.array([[0.0, 0.0], [0.2, 0.0]])
    feet = Feet(times, positions, 100.0, np.ones(len(times), dtype=bool), True)
    centres = np.floor(times)[:, None] * [1.0, 0.0] + [0.1, 0.0]
    loads = Loads(times + 0.3, centres, np.floor(times).astype(int), 0.3, 10.3)
    assert best_lag_s(feet, loads) == pytest.approx(-0.3, abs=0.06)
    assert under_feet(feet, loads).log_odds < under_feet(feet, replace(loads, times=times)).log_odds


def test_without_loads_or_feet_nothing_is_told(gait):
    capture = gait("treadmill run")
    unloaded = [replace(plate, force_ground=0 * plate.force_ground) for plate in capture.plates]
    assert loads_of(unloaded) is None
    markers = replace(
        capture.markers, positions_ground=np.full_like(capture.markers.positions_ground, np.nan)
    )
    unseen = feet_of(markers)
    assert evidence(unseen, loads_of(capture.plates)).log_odds == 0.0


STEP, STEPS = 60, 16  # frames at 100 Hz
SOLE = np.array([[0.0, 0.05, 0.0], [0.2, 0.05, -0.04], [0.2, 0.05, 0.04], [0.05, 0.09, 0.0]])


def walker(seen):
    """Markers of two feet that step in turn, half a step on each time, and the loads under them."""
    frames = STEP * STEPS
    times, step = np.arange(frames) / 100, np.arange(frames) // STEP
    positions = np.empty((frames, 2, len(SOLE), 3))
    for foot in range(2):
        swings = step % 2 != foot
        share = np.where(swings, np.arange(frames) % STEP / STEP, 0.0)
        stands_at = 0.6 * np.where(swings, step - 1, step)
        path = np.stack(
            [stands_at + 1.2 * share, 0.2 * np.sin(np.pi * share), np.full(frames, 0.2 * foot)], axis=1
        )
        positions[:, foot] = path[:, None] + SOLE
    positions[~seen] = np.nan
    names = tuple(f"M{k}" for k in range(2 * len(SOLE)))
    centres = np.stack([0.6 * step + 0.1, 0.2 * (step % 2)], axis=1)
    return Markers(names, positions.reshape(frames, -1, 3), 100.0), Loads(
        times, centres, step, 0.0, float(times[-1])
    )


@given(
    st.lists(
        st.tuples(
            st.integers(0, STEP * STEPS - 1),
            st.integers(1, STEP * STEPS),
            st.sampled_from(["right", "left", "both"]),
        ),
        max_size=8,
    )
)
@example([(k * STEP, STEP, "both") for k in range(0, STEPS, 4)])
@example([(k * STEP, STEP, "right") for k in range(0, STEPS, 2)])
@example([(STEP, 12 * STEP, "both")])
@example([(0, STEP * STEPS, "right")])
@example([(0, STEP * STEPS, "both")])
def test_feet_that_are_not_seen_contradict_no_load(unseen):
    seen = np.ones((STEP * STEPS, 2), dtype=bool)
    for start, length, which in unseen:
        seen[start : start + length, {"right": [0], "left": [1], "both": [0, 1]}[which]] = False
    markers, loads = walker(seen)
    found = under_feet(feet_of(markers), loads)
    assert found.log_odds >= 0.0


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7])
def test_loads_off_the_feet_that_are_seen_do(share):
    seen = np.ones((STEP * STEPS, 2), dtype=bool)
    seen[: round(share * STEP * STEPS)] = False
    markers, loads = walker(seen)
    astray = replace(loads, centres=loads.centres + 0.3)
    found = under_feet(feet_of(markers), astray)
    assert found.log_odds < CONTRADICTION_NATS
    assert 0.2 < found.off_m < 0.45
