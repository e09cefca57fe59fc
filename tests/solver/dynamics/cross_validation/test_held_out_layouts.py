import numpy as np
import pytest

from solver.common.true_runs import runs
from solver.dynamics.cross_validation.held_out_layouts import BLOCKS, LAYOUTS, hold_out_blocks, hold_out_steps
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings

SETTINGS = TrajectorySettings(held_out_block_s=0.2, held_out_every=3)


def test_blocks_of_known_frames_never_at_the_ends():
    counts = np.ones(200, dtype=bool)
    counts[60:90] = False
    held_out = hold_out_blocks(counts, 100.0, SETTINGS)
    assert not held_out[~counts].any()
    assert not held_out[:20].any()
    assert not held_out[-20:].any()
    assert 0.2 < held_out.sum() / counts.sum() < 0.45
    edges = np.flatnonzero(np.diff(held_out[:60].astype(int)))
    assert np.diff(edges)[0] == 20


def test_too_few_frames_hold_out_nothing():
    assert not hold_out_blocks(np.ones(30, dtype=bool), 100.0, SETTINGS).any()


@pytest.mark.parametrize(("frames", "gap"), [(200, None), (437, (60, 90)), (67, None), (1001, (400, 407))])
def test_six_layouts_hold_out_every_known_frame_but_the_first_and_the_last_block(frames, gap):
    counts = np.ones(frames, dtype=bool)
    if gap:
        counts[slice(*gap)] = False
    layouts = [hold_out_blocks(counts, 100.0, SETTINGS, number) for kind, number in LAYOUTS if kind == BLOCKS]
    known = np.flatnonzero(counts)
    assert len(layouts) == 6
    assert not any((w & ~counts).any() for w in layouts)
    assert np.array_equal(np.flatnonzero(np.any(layouts, axis=0)), known[20:-20])
    assert all(w.sum() < 0.5 * len(known) for w in layouts)


def stances(frames=400):
    """Left and right feet that walk, and stand at the end."""
    in_contact = np.zeros((frames, 2), dtype=bool)
    for foot, starts in enumerate([(0, 110, 220), (55, 165, 300)]):
        for start in starts:
            in_contact[start : start + 65, foot] = True
    in_contact[300:, 1] = True
    return in_contact


def test_each_whole_step_is_held_out_in_one_of_three_layouts():
    in_contact, counts = stances(), np.ones(400, dtype=bool)
    layouts = [hold_out_steps(counts, in_contact, 100.0, number) for number in range(3)]
    told = sorted(run for w in layouts for run in runs(w))
    assert told == [(55, 120), (110, 175), (165, 230), (220, 285)]  # not the first one, cut; nor standing


def test_a_step_whose_force_is_not_known_throughout_is_not_held_out():
    in_contact, counts = stances(), np.ones(400, dtype=bool)
    counts[130] = False
    layouts = [hold_out_steps(counts, in_contact, 100.0, number) for number in range(3)]
    assert sorted(run for w in layouts for run in runs(w)) == [(55, 120), (165, 230), (220, 285)]
