import numpy as np
import pytest

from solver.diagnosis.causes.marker_swap import findings


def swapped(observed, a, b, first, last):
    altered = observed.copy()
    altered[first:last, [a, b]] = observed[first:last, [b, a]]
    return altered


def test_a_sound_walk_has_none(long_walk, tracked):
    assert findings(tracked(*long_walk)) == []


@pytest.mark.parametrize(
    ("pair", "first", "last"),
    [
        (("RTH1", "RTH2"), 140, 230),  # on one segment
        (("LTOE", "LMT5"), 90, 401),  # to the end, near each other
        (("RASI", "LASI"), 0, 120),  # from the start, counterparts
        (("RKNE", "RTB1"), 200, 260),  # on neighbours
        (("RANK", "LANK"), 150, 163),  # where feet pass
    ],
)
def test_finds_a_pair(long_walk, tracked, pair, first, last):
    observed, skeleton = long_walk
    a, b = (skeleton.marker_names.index(name) for name in pair)
    altered = swapped(observed, a, b, first, last)
    (found,) = findings(tracked(altered, skeleton))
    assert set(found.target.split("+")) == set(pair)
    assert found.frames.start == pytest.approx(first, abs=3)
    assert found.frames.end == pytest.approx(last, abs=3)
    assert found.parameters == {}
    both_seen = np.isfinite(observed[:, [a, b]]).all(axis=(1, 2))
    both_seen[: first + 3] &= np.arange(first + 3) < first
    np.testing.assert_array_equal(found.repair(altered)[both_seen][3:-3], observed[both_seen][3:-3])


def test_a_swap_behind_a_gap(long_walk, tracked):
    observed, skeleton = long_walk
    a, b = (skeleton.marker_names.index(name) for name in ("LASI", "RASI"))
    altered = swapped(observed, a, b, 200, 300)
    altered[185:200, [a, b]] = np.nan
    (found,) = findings(tracked(altered, skeleton))
    assert set(found.target.split("+")) == {"LASI", "RASI"}
    assert (found.frames.start, found.frames.end) == (pytest.approx(200, abs=15), pytest.approx(300, abs=3))


def test_two_swaps_of_one_pair_are_two_findings(long_walk, tracked):
    observed, skeleton = long_walk
    a, b = (skeleton.marker_names.index(name) for name in ("RTB1", "RTB3"))
    altered = swapped(swapped(observed, a, b, 100, 140), a, b, 250, 300)
    found = findings(tracked(altered, skeleton))
    assert [(f.frames.start, f.frames.end) for f in found] == [(100, 140), (250, 300)]


@pytest.mark.real
def test_in_a_recorded_walk(real_walk, tracked):
    observed, skeleton, rate = real_walk
    assert findings(tracked(observed, skeleton, rate)) == []
    a, b = (skeleton.marker_names.index(name) for name in ("L.SH1", "L.SH2"))
    altered = swapped(observed, a, b, 70, 120)
    (found,) = findings(tracked(altered, skeleton, rate))
    assert set(found.target.split("+")) == {"L.SH1", "L.SH2"}
    assert (found.frames.start, found.frames.end) == (70, 120)
