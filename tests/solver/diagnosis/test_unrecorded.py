"""Frames that the right clock puts outside the recording, in a walk whose forces are late."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.diagnose_subject import causes_of, without_unrecorded
from solver.diagnosis.noise.balance_rows import END_S
from solver.diagnosis.search.selection import select
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import measure, plates_under
from tests.solver.diagnosis.causes.conftest import NOISELESS, scene_of_trial

LATE_FRAMES = 12
HALF_A_SAMPLE_S = 0.0005
ENDS = round(END_S * 100.0)


@pytest.fixture(scope="module")
def late_by(short_walk, balance_of_scenes):
    """Its balance with forces that come some frames late."""

    def balance(frames: int):
        plates = plates_under(short_walk.contacts, (0.0, short_walk.scenario.duration))
        settings = replace(NOISELESS, force_delay_s=frames / 100.0)
        capture = measure(short_walk, plates, MARKERS, settings, np.random.default_rng(0))
        return balance_of_scenes(scene_of_trial(short_walk, capture))

    return balance


@pytest.fixture(scope="module")
def late(late_by):
    return late_by(LATE_FRAMES)


def test_windows_that_the_right_clock_leaves_empty_are_gone_and_others_are_as_they_were(late):
    selection = select(late, [ClockOffset("all")])
    (before,), (after,) = late.trials, without_unrecorded(late, selection.found).trials
    ((shift_s,),) = (f.contender.term.eta for f in selection.found)
    recorded_s = before.scene.plates[0].plate.times[-1]
    lost = int((before.scene.times + shift_s < recorded_s + HALF_A_SAMPLE_S).sum()) - ENDS
    kept = before.windows.start + before.windows.length <= lost
    assert 0 < kept.sum() < len(kept)
    np.testing.assert_array_equal(after.windows.start, before.windows.start[kept])
    own = np.repeat(kept, 6)
    np.testing.assert_array_equal(after.residual, before.residual[own])
    np.testing.assert_array_equal(after.covariance, before.covariance[np.ix_(own, own)])
    np.testing.assert_array_equal(after.nuisance, before.nuisance[own])
    assert not after.scene.counts[lost:].any()
    np.testing.assert_array_equal(after.scene.counts[:lost], before.scene.counts[:lost])


def test_the_clock_alone_is_named(late):
    """Though frames of which nothing is known name a place, a zero and a clock of a plate at first."""
    balance, selection = causes_of(late)
    assert balance is not late
    (found,) = selection.found
    assert found.contender.term.candidate.key == ("clock_offset", "all")
    assert found.contender.term.eta[0] == pytest.approx(LATE_FRAMES / 100.0, abs=0.001)


@pytest.mark.parametrize("frames", [0, 3])
def test_where_no_window_is_lost_the_balance_stays(late_by, frames):
    """The last 0.05 s are in no window anyway."""
    balance = late_by(frames)
    assert without_unrecorded(balance, select(balance, [ClockOffset("all")]).found) is None
