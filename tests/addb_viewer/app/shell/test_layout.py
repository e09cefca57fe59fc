"""Sizes of the panels: the scene keeps its place."""

import pytest

from addb_viewer.app.shell.controls import layout_of

SIZES = [(1024, 768), (1280, 720), (1440, 900), (1920, 1080), (2560, 1440)]


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_the_scene_has_more_than_a_third_of_any_window(size):
    layout = layout_of(size[0])
    scene = size[0] - layout.controls_width - layout.timeline_width
    assert scene > size[0] / 3
    assert scene >= layout.controls_width
