import pytest

from addb_viewer.trial_view.span import Span


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
