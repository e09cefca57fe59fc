import numpy as np
import pytest

from solver.dynamics.cross_validation.held_out import HeldOut, HeldOutBlocks, judged_blocks
from solver.dynamics.cross_validation.held_out_figures import against_markers


def blocks(fit, markers, starts, cutoffs=(6.0, 8.0)):
    """Blocks of 20 frames that miss so much of force and moment on each of them."""
    starts = np.asarray(starts)
    squares = [20 * np.tile(np.asarray(m, dtype=float)[:, None], 2) ** 2 for m in (fit, markers)]
    ranges = np.stack([starts, starts + 20], axis=1)
    return HeldOutBlocks(ranges, np.full(len(starts), 20), *squares, cutoffs)


def test_rms_over_all_layouts_and_the_cutoffs_they_chose():
    force, moment = against_markers([blocks([3, 4], [6, 8], [0, 60]), blocks([5], [10], [30], (4.0, 8.0))])
    assert force.fit == pytest.approx(np.sqrt(50 / 3))
    assert force.ratio == pytest.approx(0.5)
    assert force.cutoffs_hz == (4.0, 6.0)
    assert moment.cutoffs_hz == (8.0, 8.0)


def test_the_interval_holds_a_chance_difference_and_not_a_real_one():
    random = np.random.default_rng(1)
    markers = 10 + random.random(40)
    starts = 30 * np.arange(40)
    real, _ = against_markers([blocks(1.3 * markers, markers, starts)])
    chance, _ = against_markers([blocks(random.permutation(markers), markers, starts)])
    assert real.interval[0] > 1
    assert chance.interval[0] < 1 < chance.interval[1]


def test_layouts_over_the_same_frames_are_one_direct_check():
    random = np.random.default_rng(2)
    fit, markers, starts = 5 + 10 * random.random(12), 5 + 10 * random.random(12), 60 * np.arange(12)
    once, _ = against_markers([blocks(fit, markers, starts)])
    many, _ = against_markers([blocks(fit, markers, starts + k % 3) for k in range(6)])
    assert np.diff(many.interval) == pytest.approx(np.diff(once.interval))


def test_three_blocks_make_no_interval():
    force, _ = against_markers([blocks([3, 4, 5], [6, 8, 9], [0, 60, 120])])
    assert force.interval is None


def test_frames_that_do_not_count_are_in_no_block():
    residual = np.tile([3.0, 4.0, 0.0, 0.0, 0.0, 2.0], (60, 1))
    layout, counts = np.zeros(60, dtype=bool), np.ones(60, dtype=bool)
    layout[0:10] = layout[20:30] = layout[50:60] = True
    counts[:25] = False
    held_out = HeldOut(layout & counts, residual, 2 * residual, (6.0, 6.0))
    found = judged_blocks(held_out, layout)
    assert found is not None
    assert found.ranges.tolist() == [[20, 30], [50, 60]]
    assert found.frames.tolist() == [5, 10]
    np.testing.assert_allclose(found.missed, [[125, 20], [250, 40]])
    np.testing.assert_allclose(found.markers_missed, 4 * found.missed)
