from itertools import pairwise

import numpy as np
import pytest

from addb_viewer.dataset.grid import cuts_of


@pytest.mark.parametrize(
    ("frames", "sizes", "left"),
    [
        (11, [], [11]),
        (12, [12], []),
        (2000, [2000], []),
        (2001, [1001, 1000], []),
        (4001, [1334, 1334, 1333], []),
    ],
)
def test_a_span_is_cut_evenly_and_a_short_one_is_left_out(frames, sizes, left):
    cuts = cuts_of(np.zeros(frames, bool))
    assert [segment.frames for segment in cuts.kept] == sizes
    assert [segment.frames for segment in cuts.too_short] == left
    borders = [(segment.start, segment.end) for segment in (*cuts.kept, *cuts.too_short)]
    assert borders[0][0] == 0
    assert borders[-1][1] == frames
    assert all(one[1] == next_one[0] for one, next_one in pairwise(borders))


def test_segments_end_at_erroneous_stretches():
    erroneous = np.zeros(3000, bool)
    erroneous[5:20] = erroneous[100:110] = erroneous[-3:] = True
    cuts = cuts_of(erroneous)
    assert [(s.start, s.end) for s in cuts.too_short] == [(0, 5)]
    assert [(s.start, s.end) for s in cuts.erroneous] == [(5, 20), (100, 110), (2997, 3000)]
    assert [(s.start, s.end) for s in cuts.kept] == [(20, 100), (110, 1554), (1554, 2997)]
    number = cuts.number(3000)
    for k in range(3000):
        inside = [i for i, s in enumerate(cuts.kept) if s.start <= k < s.end]
        assert number[k] == (inside[0] if inside else -1)
    assert ((number >= 0) | erroneous | (np.arange(3000) < 5)).all()
