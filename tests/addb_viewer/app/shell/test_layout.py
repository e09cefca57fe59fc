"""Sizes of the panels: the scene keeps its place, and all charts fit."""

import pytest

from addb_viewer.app.shell.controls import layout_of

SIZES = [(1024, 768), (1280, 720), (1440, 900), (1920, 1080), (2560, 1440)]


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_the_scene_has_more_than_a_third_of_any_window(size):
    layout = layout_of(*size)
    scene = size[0] - layout.controls_width - layout.timeline_width
    assert scene > size[0] / 3
    assert scene >= layout.controls_width


def test_charts_are_as_high_as_their_window_allows():
    heights = [layout_of(*size).chart_height for size in SIZES[1:]]
    assert heights == sorted(heights)
    assert heights[0] < heights[-1]
