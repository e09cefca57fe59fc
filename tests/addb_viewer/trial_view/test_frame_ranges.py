from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from addb_viewer.trial_view.frame_ranges import Selection, moved_border
from annotations.events import Edit, FlagRange
from annotations.folding import folded
from annotations.review_errors import ReviewError
from annotations.trial_review import FlaggedRange, Source


def test_i_then_o_selects_both_frames():
    chosen = Selection().with_start(10).with_end(20)
    assert chosen.frames(20, 100) == (10, 21)


def test_an_open_range_reaches_to_the_cursor():
    assert Selection().with_start(10).frames(30, 100) == (10, 31)
    assert Selection().with_start(10).frames(4, 100) == (4, 11)
    assert Selection().with_end(30).frames(10, 100) == (10, 31)


def test_a_border_on_the_wrong_side_begins_anew():
    assert Selection().with_start(10).with_end(20).with_start(50).frames(60, 100) == (50, 61)
    assert Selection().with_start(10).with_end(20).with_end(5).frames(5, 100) == (5, 6)


def test_nothing_is_selected_at_first():
    assert Selection().frames(5, 100) is None


def test_a_painted_range_holds_until_the_cursor_moves_on():
    painted = Selection(10, 20).spent(12)
    assert painted.seen_from(12).frames(12, 100) == (10, 20)
    assert painted.seen_from(13).frames(13, 100) is None
    assert painted.with_start(40).frames(45, 100) == (40, 46)  # not to the old end


@pytest.mark.parametrize("keys", ["io", "oi", "i", "o"])
@given(first=st.integers(0, 99), second=st.integers(0, 99), cursor=st.integers(0, 99))
def test_a_range_always_has_frames_and_lies_in_the_trial(keys, first, second, cursor):
    selection = Selection()
    for key, frame in zip(keys, (first, second), strict=False):
        selection = selection.with_start(frame) if key == "i" else selection.with_end(frame)
    start, end = selection.frames(cursor, 100)
    assert 0 <= start < end <= 100


def test_the_borders_may_be_set_in_either_order():
    assert Selection().with_start(50).with_end(20).frames(5, 100) == (20, 51)
    assert Selection().with_end(20).with_start(50).frames(5, 100) == (20, 51)


FLAG = FlaggedRange(20, 40, "calcn_r", "forceDiscrepancy", Source.PERSON, "Zoë", 1, "odd")


@pytest.mark.parametrize("to", [(10, 40), (20, 60), (30, 40), (20, 25), (21, 22)])
def test_a_dragged_border_gives_the_flag_the_frames_it_was_dragged_to(to):
    asked = moved_border((FLAG,), (20, 40, "calcn_r"), to)
    now = datetime(2026, 1, 1, tzinfo=UTC)
    events = (FlagRange(20, 40, "forceDiscrepancy", "calcn_r", "odd"), *asked)
    edits = [Edit(i, "walk", "Zoë", now, event) for i, event in enumerate(events, 1)]
    assert [(f.start, f.end, f.note) for f in folded("walk", edits, ("calcn_r", "calcn_l")).flags] == [
        (*to, "odd")
    ]
    assert len(asked) == 1 + (to == (21, 22))  # a border is one step of undo


def test_a_flag_that_is_gone_cannot_be_dragged():
    with pytest.raises(ReviewError, match="no flag of frames 20–39"):
        moved_border((FLAG,), (20, 40, None), (20, 50))
