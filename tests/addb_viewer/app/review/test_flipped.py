import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from addb_viewer.app.review.what_if import flipped
from solver.contact.force_review import ForceReview
from solver.contact.mask import ERRONEOUS, mask_of
from tests.flagged import flagged

FEET, FRAMES = ("calcn_r", "calcn_l"), 60

feet = st.sampled_from([None, *FEET])
flags = st.lists(
    st.tuples(
        st.integers(0, 29), st.integers(30, FRAMES), feet, st.sampled_from(["manualReview", None, ERRONEOUS])
    ),
    max_size=4,
)
proposed = st.lists(
    st.tuples(st.integers(0, 29), st.integers(30, FRAMES), feet, st.just("missingBlip")), max_size=2
)


@given(said=flags, proposed=proposed, start=st.integers(0, 40), length=st.integers(1, 20), foot=feet)
def test_the_range_turns_as_a_whole_and_nothing_else_changes(said, proposed, start, length, foot):
    present = flagged(*sorted(said, key=lambda label: label[3] == ERRONEOUS))
    before = mask_of(FEET, FRAMES, (), present, proposed)
    instead, words = flipped(present, before, (start, start + length), foot, FEET)
    after = mask_of(FEET, FRAMES, (), instead, proposed).counts
    about = np.zeros_like(after)
    about[start : start + length, slice(None) if foot is None else FEET.index(foot)] = True
    np.testing.assert_array_equal(before.counts[~about], after[~about])
    mostly_out = 2 * (~before.counts[about]).sum() >= about.sum()
    assert (after[about] == mostly_out).all()
    assert ("counted" in words) == mostly_out


@pytest.mark.parametrize(("foot", "word"), [("calcn_r", "right"), (None, "both")])
def test_it_says_what_is_asked(foot, word):
    nothing = ForceReview()
    assert f"frames 5 to 9, {word}" in flipped(nothing, mask_of(FEET, FRAMES, ()), (5, 10), foot, FEET)[1]
