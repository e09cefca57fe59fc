import pytest
from hypothesis import given
from hypothesis import strategies as st

from addb_viewer.app.timeline.span import Span, span_around


def test_borders_lie_between_frames():
    span = Span(0, 100)
    assert span.share(50) == 0.5
    left, width = span.block(10, 20)
    assert left == pytest.approx(0.095)
    assert width == pytest.approx(0.1)


def test_what_is_outside_is_cut_or_nothing():
    span = Span(50, 100)
    assert span.block(0, 40) is None
    assert span.block(0, 60) == pytest.approx((0.0, 0.19))
    assert span.block(90, 500) == pytest.approx((0.79, 0.21))


@given(frames=st.integers(2, 20_000), shown=st.none() | st.integers(2, 30_000), data=st.data())
def test_the_frame_is_on_its_page_and_the_page_in_the_trial(frames, shown, data):
    frame = data.draw(st.integers(0, frames - 1))
    span = span_around(frame, frames, shown)
    assert span.first <= frame <= span.last
    assert span.first >= 0
    assert span.last <= max(frames - 1, 1)
