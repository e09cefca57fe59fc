"""Markers whose own paths are cut: what a step is, what none is, and that real ones are told from it."""

import numpy as np
import pytest

from benchmarks.faults.editor.edits import carried_by_cloth, slipped
from benchmarks.faults.editor.sources import SOURCES
from solver.diagnosis.causes.leaps import leaps

RATE, FRAMES, AT = 100.0, 300, 140
STEP_M = np.array([0.012, -0.015, 0.009])


@pytest.fixture
def paths():
    """Six markers of a segment that swings to and fro, with half a millimetre of noise."""
    rng = np.random.default_rng(3)
    t = np.arange(FRAMES) / RATE
    middle = np.stack([1.2 * t, 0.9 + 0.04 * np.sin(11 * t), 0.25 * np.sin(6 * t)], axis=1)
    places = rng.uniform(-0.15, 0.15, (6, 3))
    return middle[:, None] + places + rng.normal(0, 0.0005, (FRAMES, 6, 3))


def test_those_that_moved_are_told_with_time_and_shift_and_the_others_are_not(paths):
    paths[AT:, [1, 4]] += STEP_M
    (leap,) = leaps(paths, RATE)
    assert leap.markers == (1, 4)
    assert leap.frame == AT
    assert np.abs(leap.shift_ground - STEP_M).max() < 5 * leap.std_m < 0.01


def bent(paths):
    """A foot that strikes: 3 m/s less from one frame on."""
    paths[AT:, 0, 0] -= 3.0 * np.arange(FRAMES - AT) / RATE
    return paths


def passing(paths):
    paths[AT : AT + 10, 0] += STEP_M
    return paths


def sliding(paths):
    paths[:, 0] += np.clip((np.arange(FRAMES) - AT) / 20, 0, 1)[:, None] * STEP_M
    return paths


def lost(paths):
    paths[AT:, 0] += STEP_M
    paths[AT - 15 : AT, 0] = np.nan
    return paths


def at_the_end(paths):
    paths[-20:, 0] += STEP_M
    return paths


def never_seen(paths):
    paths[:, 0] = np.nan
    return paths


@pytest.mark.parametrize("changed", [bent, passing, sliding, lost, at_the_end, never_seen])
def test_what_is_no_lasting_step_within_a_frame_is_none(paths, changed):
    assert leaps(changed(paths), RATE) == []


def test_a_recording_of_a_few_frames_has_none(paths):
    assert leaps(paths[:5], RATE) == []


@pytest.fixture(scope="module")
def recordings(real_data):
    return [source.read(real_data) for source in SOURCES]


def test_sound_recordings_have_none(recordings):
    """Walks, a run, squats, standing and two drop jumps with their impacts."""
    for recording in recordings:
        for trial in recording.trials:
            assert leaps(trial.positions, trial.rate) == []


@pytest.mark.parametrize("edit", [carried_by_cloth(0.025), slipped(0.03)], ids=["cloth", "slip"])
def test_of_real_recordings_with_markers_moved_all_but_few_tell_exactly_these(recordings, edit):
    """A marker with a bend as large elsewhere is left to its neighbours' word; none is told wrongly."""
    rng = np.random.default_rng(8)
    said = []
    for recording in recordings:
        edited, fault = edit(recording, rng)
        trial = edited.trials[0]
        found = leaps(trial.positions, trial.rate)
        said.append([{trial.labels[m] for m in leap.markers} for leap in found])
        assert said[-1] in ([], [set(fault.markers)])
    assert sum(map(bool, said)) >= len(said) - 2
