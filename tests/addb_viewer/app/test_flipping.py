import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from addb_viewer.app.flipping import flipped

FEET = ("calcn_r", "calcn_l")


def mask(ranges):
    out = np.zeros((60, 2), dtype=bool)
    for start, end, foot, _ in ranges:
        out[start:end, slice(None) if foot is None else FEET.index(foot)] = True
    return out


feet = st.sampled_from([None, *FEET])
flags = st.lists(
    st.tuples(st.integers(0, 29), st.integers(30, 60), feet, st.just("manualReview")), max_size=4
)


@given(present=flags, start=st.integers(0, 40), length=st.integers(1, 20), foot=feet)
def test_the_range_turns_as_a_whole_and_nothing_else_changes(present, start, length, foot):
    instead, words = flipped(present, (start, start + length), foot, FEET)
    before, after = mask(present), mask(instead)
    about = np.zeros_like(before)
    about[start : start + length, slice(None) if foot is None else FEET.index(foot)] = True
    np.testing.assert_array_equal(before[~about], after[~about])
    mostly_out = 2 * before[about].sum() >= about.sum()
    assert (after[about] == (not mostly_out)).all()
    assert ("counted" in words) == mostly_out


@pytest.mark.parametrize(("foot", "word"), [("calcn_r", "right"), (None, "both")])
def test_it_says_what_is_asked(foot, word):
    assert f"frames 5 to 9, {word}" in flipped([], (5, 10), foot, FEET)[1]
