"""Drawings of single frames."""

import base64
import io
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from PIL import Image

from addb_viewer.report.scene_data import arrows_of, plates_of
from addb_viewer.report.still_picture import (
    FIELD_OF_VIEW,
    HEIGHT,
    KEPT,
    WIDTH,
    bones_image,
    camera_on,
    heading_of,
    still_picture,
)
from addb_viewer.trial_view.replay import BodyReplay


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


@pytest.mark.parametrize("heading", np.linspace(-3, 3, 7))
def test_all_that_is_to_be_seen_is_in_the_picture_and_fills_it(heading):
    rng = np.random.default_rng(3)
    points = np.add(rng.uniform([-0.5, 0, -0.3], [0.6, 1.8, 0.4], (50, 3)), [4.0, 0.0, -7.0])
    x, y, depth = camera_on(points, heading, WIDTH, HEIGHT).seen(points).T
    assert (depth > 0).all()
    assert 0 <= x.min() <= x.max() <= WIDTH
    assert 0 <= y.min() <= y.max() <= HEIGHT
    assert max(np.ptp(x) / WIDTH, np.ptp(y) / HEIGHT) > 0.75


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5])
def test_the_person_walks_to_the_right_and_stands_upright(heading):
    forward = np.array([np.cos(heading), 0.0, np.sin(heading)])
    person = np.array([[0, 0, 0], [0, 1.8, 0], 0.3 * forward, -0.3 * forward])
    feet, crown, front, back = camera_on(person, heading, WIDTH, HEIGHT).seen(person)
    assert front[0] > feet[0] > back[0]
    assert crown[1] < feet[1]
    assert crown[0] == pytest.approx(feet[0], abs=1e-9)
    assert front[2] < back[2]


def test_a_point_on_the_border_of_the_field_of_view_lies_on_the_border_of_the_picture():
    camera = camera_on(np.array([[0, 0, 0], [0, 1, 0]]), 0.0, WIDTH, HEIGHT)
    _, up, back = camera.R_camera_ground
    point = camera.eye - 2.0 * back + 2.0 * np.tan(FIELD_OF_VIEW / 2) * up
    np.testing.assert_allclose(camera.seen(point), [WIDTH / 2, 0.0, 2.0], atol=1e-9)


def test_headings(recording):
    replay = recording.trials[0].replay
    forward = np.tile([0.0, 0.0, 2.0], (40, 1))
    turned = replace(replay, bodies=replace(replay.bodies, forward=forward))
    assert heading_of(turned, 3) == pytest.approx(np.pi / 2)
    assert heading_of(replace(replay, bodies=None), 3) == 0.0


def test_a_body_stands_where_the_camera_sees_it():
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    position = np.array([[[1.0, 1.2, -2.0]]])
    bodies = BodyReplay(("a",), np.array([[[1.0, 0, 0, 0]]]), position)
    around = position[0] + np.array([[-1, -1, -1], [1, 1, 1]])
    camera = camera_on(around, 0.3, 120.0, 100.0)
    address = bones_image(bodies, {"a": box}, 0, camera)
    image = _image(address)
    assert image.size == (120 * KEPT, 100 * KEPT)
    solid = np.argwhere(np.asarray(image.convert("RGBA"))[..., 3] > 128)
    expected = KEPT * camera.seen(position[0, 0])[[1, 0]]
    np.testing.assert_allclose(solid.mean(axis=0), expected, atol=3)
    corners = KEPT * camera.seen(trimesh.bounds.corners(box.bounds) + position[0, 0])[:, [1, 0]]
    np.testing.assert_allclose(solid.min(axis=0), corners.min(axis=0), atol=2)
    np.testing.assert_allclose(solid.max(axis=0), corners.max(axis=0), atol=2)


def test_the_nearer_body_hides_the_other_whichever_comes_first():
    box, turns = trimesh.creation.box((0.2, 0.2, 0.2)), np.tile([1.0, 0.0, 0.0, 0.0], (1, 2, 1))
    camera = camera_on(np.array([[-0.3, -0.3, -0.3], [0.3, 0.3, 0.3]]), 0.0, 100.0, 100.0)
    _, _, back = camera.R_camera_ground
    places = np.stack([0.5 * back, -0.5 * back])[None]
    both = {"a": box, "b": box}
    far_last = bones_image(BodyReplay(("a", "b"), turns, places), both, 0, camera)
    near_last = bones_image(BodyReplay(("a", "b"), turns, places[:, ::-1]), both, 0, camera)
    only_near = bones_image(BodyReplay(("a",), turns[:, :1], places[:, :1]), {"a": box}, 0, camera)
    middle = [np.asarray(_image(each))[100, 100] for each in (far_last, near_last, only_near)]
    assert np.ptp(np.array(middle, dtype=int), axis=0).max() <= 3


def _image(address):
    return Image.open(io.BytesIO(base64.b64decode(address.removeprefix("data:image/webp;base64,"))))


def test_nothing_known_gives_no_picture():
    bodies = BodyReplay(("a",), np.full((1, 1, 4), np.nan), np.full((1, 1, 3), np.nan))
    camera = camera_on(np.array([[0, 0, 0], [1, 1, 1]]), 0.0, 10, 10)
    assert bones_image(bodies, {"a": trimesh.creation.box((1, 1, 1))}, 0, camera) == ""
