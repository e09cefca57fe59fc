"""Drawings of single frames."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from addb_viewer.report.arrows import arrows_of
from addb_viewer.report.floor import plates_of
from addb_viewer.report.still_picture import HEIGHT, WIDTH, still_picture


@pytest.fixture
def replay(recording):
    return recording.trials[0].replay


def drawn(recording, replay, frame):
    arrows = arrows_of(replay, None)
    return ElementTree.fromstring(
        still_picture(replay, frame, recording.meshes, arrows, plates_of(replay))
    ), arrows


def test_markers_bones_plates_and_forces(recording, replay):
    picture, arrows = drawn(recording, replay, 4)
    seen = np.isfinite(replay.markers.measured[4]).all(axis=1).sum()
    assert len(picture.findall(".//circle")) == seen == 5
    assert picture.find(".//image").get("href").startswith("data:image/webp;base64,")
    assert len(picture.findall(".//path[@class='plate']")) == 2
    here = [arrow.label for arrow in arrows if np.isfinite(arrow.force[4]).all()]
    assert here == ["plate 1", "residual"]
    assert picture.find(".//g[@class='arrow']/polygon") is not None
    force = np.linalg.norm(replay.plates[0].force[4])
    assert f"{force:.0f}\u00a0N" in [text.text for text in picture.findall(".//text")]
    assert all(name in picture.get("aria-label") for name in here)


def test_all_markers_and_arrow_tips_lie_in_the_picture(recording, replay):
    picture, _ = drawn(recording, replay, 4)
    x, y = (np.array([float(c.get(k)) for c in picture.findall(".//circle")]) for k in ("cx", "cy"))
    corners = [p for g in picture.findall(".//polygon") for p in g.get("points").split()]
    tips = np.array([[float(v) for v in re.split(",", corner)] for corner in corners])
    for values, most in ((x, WIDTH), (tips[:, 0], WIDTH), (y, HEIGHT), (tips[:, 1], HEIGHT)):
        assert values.min() >= 0
        assert values.max() <= most


def test_a_frame_on_which_nothing_was_seen(recording, replay):
    markers = replace(replay.markers, measured=replay.markers.measured * np.nan)
    empty = replace(replay, markers=markers, bodies=None)
    picture, _ = drawn(recording, empty, 4)
    assert picture.text == "Nothing was seen on this frame."


def test_names_from_files_are_text(recording, replay):
    plates = (replace(replay.plates[0], name='"><script>'), replay.plates[1])
    picture, _ = drawn(recording, replace(replay, plates=plates), 4)
    assert '"><script>' in picture.get("aria-label")
    assert picture.find(".//script") is None


def test_figures_of_forces_side_by_side_do_not_lie_over_one_another(recording, replay):
    beside = replace(replay.plates[0], cop=np.add(replay.plates[0].cop, [0.02, 0.0, 0.0]))
    picture, _ = drawn(recording, replace(replay, plates=(replay.plates[0], beside)), 4)
    first, second = ((float(t.get("x")), float(t.get("y"))) for t in picture.findall(".//text")[:2])
    assert abs(first[0] - second[0]) < 48
    assert abs(first[1] - second[1]) >= 12
