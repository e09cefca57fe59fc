"""What a recording shows by itself and after its fit: markers, plates, steps."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.watch import judging
from addb_viewer.watch.judging import (
    LOST_S,
    MISSING_S,
    MISSING_SHARE,
    NEAR_PLATE_M,
    OFF_ZERO_N,
    SEEN_SHARE,
    first_look,
    fit_look,
)
from solver.capture.capture import Capture, ForcePlate, Markers
from solver.common.errors import SolverError
from solver.common.gravity import GRAVITY

RATE, FRAMES = 100.0, 400


def markers(hidden=()):
    """Six that stand; `hidden` are (column, first, end)."""
    places = np.tile(np.random.default_rng(1).uniform(0.2, 1.6, (1, 6, 3)), (FRAMES, 1, 1))
    for column, first, end in hidden:
        places[first:end, column] = np.nan
    return Markers(tuple("ABCDEF"), places, RATE)


def plate(vertical_N, zero_N=None):
    force = np.zeros((FRAMES, 3))
    force[:, 1] = vertical_N
    zero = None if zero_N is None else np.array([0.0, zero_N, 0, 0, 0, 0])
    return ForcePlate("P", force, np.zeros((FRAMES, 3)), np.full((FRAMES, 3), np.nan), RATE, zero_ground=zero)


@pytest.mark.parametrize(("share", "is_told"), [(0.7, False), (1.4, True)])
def test_a_marker_is_lost_that_is_out_of_sight_for_long_while_others_are_seen(share, is_told):
    frames = round(share * LOST_S * RATE)
    lost = list(judging._lost(markers([(1, 100, 100 + frames)])))
    assert lost == ([("B", frames / RATE)] if is_told else [])
    everybody = [(column, 100, 200) for column in range(6)]
    assert list(judging._lost(markers(everybody))) == []


@pytest.mark.parametrize(("share", "is_told"), [(0.7, False), (1.4, True)])
def test_what_is_hardly_ever_seen_is_no_marker(share, is_told):
    seen = round(share * SEEN_SHARE * FRAMES)
    assert bool(list(judging._lost(markers([(1, seen, FRAMES)])))) is is_told


@pytest.mark.parametrize(("share", "is_told"), [(0.7, False), (1.4, True)])
def test_a_plate_is_off_its_zero(share, is_told):
    capture = Capture("walk", markers(), (plate(700.0), plate(0.0, -share * OFF_ZERO_N)))
    look = judging._look(capture)
    assert (look.off_zero == ((2, -share * OFF_ZERO_N),)) is is_told
    assert (look.has_plates, look.is_loaded) == (True, True)
    assert not judging._look(replace(capture, plates=(plate(0.0),))).is_loaded
    assert judging._look(capture).apart_s == 0.0
    late = replace(plate(700.0), start_time=0.25)
    assert judging._look(replace(capture, plates=(plate(0.0), late))).apart_s == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("seconds", "share", "is_told"), [(3.0, 1.4, True), (3.0, 0.7, False), (0.3, 1.4, False)]
)
def test_a_step_that_no_plate_measured_is_seen_without_a_fit(seconds, share, is_told):
    weight = 70.0 * GRAVITY
    vertical = np.full(FRAMES, weight)
    vertical[200 : 200 + round(seconds * MISSING_S * RATE)] -= share * MISSING_SHARE * weight
    trial = judging.Measured(Capture("walk", markers(), (plate(vertical),)), judging.ReadingSettings())
    found = list(judging._unborne_s(trial, 70.0))
    assert [abs(time - 2.0 - 0.5 * seconds * MISSING_S) < 0.03 for time in found] == [True] * is_told


@pytest.mark.real
def test_a_former_trial_that_cannot_be_read_condemns_itself_alone(tmp_path, real_data):
    for file in ("subject01_walk1.trc", "subject01_walk1_grf.mot"):
        shutil.copy(real_data / "walk_gait2354_subject01" / file, tmp_path)
    (tmp_path / "bad.c3d").write_bytes(b"")
    assert first_look(tmp_path, "subject01_walk1", ["bad"]).look.has_plates
    with pytest.raises(SolverError, match="bad"):
        first_look(tmp_path, "bad", ["subject01_walk1"])


@pytest.mark.slow
@pytest.mark.real
def test_steps_of_a_walk_over_two_plates(tmp_path, real_data):
    found = fit_look(real_data / "walk_rajagopal2015", "walk")
    assert [(step.side, step.whole, step.missed) for step in found.steps] == [
        ("Left", False, False),
        ("Right", True, False),
        ("Left", True, False),
        ("Right", True, False),
        ("Left", False, False),
    ]
    assert found.activity == "walk"
    assert [step.plate for step in found.steps[1:4]] == [1, 2, 1]
    assert 0.2 < NEAR_PLATE_M < 0.6
