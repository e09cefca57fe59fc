"""Long series cut into pieces and windows, and put together again."""

from itertools import pairwise

import numpy as np
import pytest

from solver.common import frames_at_once
from solver.common.frames_at_once import by_frames, joined, overlapping, spans


@pytest.mark.parametrize(("frames", "most"), [(0, 5), (5, 5), (6, 5), (23, 5)])
def test_spans_follow_one_another(frames, most):
    pieces = spans(frames, most)
    assert np.concatenate([np.arange(frames)[piece] for piece in pieces]).tolist() == list(range(frames))
    assert max(piece.stop - piece.start for piece in pieces) <= most


def test_pieces_make_the_whole(monkeypatch):
    monkeypatch.setattr(frames_at_once, "FRAMES_AT_ONCE", 4)
    monkeypatch.setattr(spans, "__defaults__", (4,))
    lengths = []

    def outer(a, b):
        lengths.append(len(a))
        return a[:, :, None] * b[:, None]

    a, b = (np.random.default_rng(k).normal(size=(11, 3)) for k in range(2))
    np.testing.assert_array_equal(by_frames(outer, a, b), a[:, :, None] * b[:, None])
    assert max(lengths) <= 4


@pytest.mark.parametrize("frames", [100, 101, 250, 1237])
@pytest.mark.parametrize("align", [1, 4])
def test_windows_cover_all_and_share_enough(frames, align):
    windows = overlapping(frames, most=100, window=80, shared=20, align=align)
    assert windows[0].start == 0
    assert windows[-1].stop == frames
    assert all(
        w.start % align == 0 and w.stop - w.start <= max(80 + align, frames * (frames <= 100))
        for w in windows
    )
    for before, after in pairwise(windows):
        assert before.stop - after.start == 20
    for k in range(len(windows) - 2):
        assert windows[k].stop <= windows[k + 2].start  # no frame is in three of them


def test_no_more_is_shared_than_half_a_window():
    windows = overlapping(500, most=100, window=80, shared=400)
    assert len(windows) == 12
    assert all(before.stop - after.start == 40 for before, after in pairwise(windows))


def test_parts_that_agree_are_the_whole_again():
    whole = np.random.default_rng(0).normal(size=(250, 3))
    windows = overlapping(250, most=100, window=80, shared=20)
    parts = [whole[w] for w in windows]
    np.testing.assert_allclose(joined(parts, [w.start for w in windows]), whole, atol=1e-15)


def test_parts_that_differ_pass_into_each_other():
    """Near its own border a part has no say, and nothing jumps by more than a fraction of the difference."""
    together = joined([np.zeros(60), np.ones(60)], [0, 20])
    assert (together[:30] == 0.0).all()
    assert (together[-30:] == 1.0).all()
    steps = np.diff(together)
    assert (steps >= 0).all()
    assert steps.max() < 0.06
