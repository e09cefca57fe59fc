"""Triangles as pixels."""

import base64
import io

import numpy as np
import trimesh
from PIL import Image

from addb_viewer.report.bone_raster import KEPT, bones_image, raster
from addb_viewer.report.camera import camera_on
from addb_viewer.trial_view.replay import BodyReplay


def drawn(*triangles, size=(40, 50)):
    corners = np.array([triangle for triangle, _, _ in triangles], dtype=float)
    shades = np.array([[shade] * 3 for _, shade, _ in triangles])
    return raster(corners, shades, np.array([color for _, _, color in triangles]), size)


def test_a_triangle_covers_the_pixels_whose_middles_lie_inside():
    image = drawn(([[0, 0, 1], [30, 0, 1], [0, 20, 1]], 1.0, (200, 100, 50)))
    y, x = np.mgrid[:40, :50] + 0.5
    inside = x / 30 + y / 20 <= 1
    np.testing.assert_array_equal(image[..., 3] == 255, inside)
    assert (image[inside] == [200, 100, 50, 255]).all()
    assert (image[~inside] == 0).all()


def test_either_way_round():
    corners = [[0, 0, 1], [30, 0, 1], [0, 20, 1]]
    np.testing.assert_array_equal(
        drawn((corners, 0.5, (100, 100, 100))), drawn((corners[::-1], 0.5, (100, 100, 100)))
    )


def test_the_nearer_one_hides_the_other_whichever_comes_first():
    far = ([[0, 0, 3], [49, 0, 3], [0, 39, 3]], 1.0, (10, 10, 10))
    near = ([[0, 0, 2], [20, 0, 2], [0, 20, 2]], 1.0, (250, 250, 250))
    np.testing.assert_array_equal(drawn(far, near), drawn(near, far))
    assert drawn(far, near)[5, 5, 0] == 250
    assert drawn(far, near)[5, 30, 0] == 10


def test_what_leans_through_another_is_hidden_only_where_it_is_behind():
    flat = ([[0, 0, 2], [49, 0, 2], [0, 39, 2]], 1.0, (10, 10, 10))
    leaning = ([[0, 0, 1], [49, 0, 4], [0, 39, 1]], 1.0, (250, 250, 250))
    row = drawn(flat, leaning)[0, :, 0]
    assert row[0] == 250
    assert row[45] == 10
    assert (np.diff(row.astype(int)) <= 0).all()


def test_triangles_out_of_the_picture_or_without_area_leave_no_trace():
    behind = ([[5, 5, -1], [9, 5, -1], [5, 9, -1]], 1.0, (9, 9, 9))
    aside = ([[-90, 5, 1], [-80, 5, 1], [-90, 9, 1]], 1.0, (9, 9, 9))
    thin = ([[5, 5, 1], [9, 9, 1], [7, 7, 1]], 1.0, (9, 9, 9))
    assert not drawn(behind, aside, thin).any()


def test_a_body_stands_where_the_camera_sees_it():
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    position = np.array([[[1.0, 1.2, -2.0]]])
    bodies = BodyReplay(("a",), np.array([[[1.0, 0, 0, 0]]]), position)
    around = position[0] + np.array([[-1, -1, -1], [1, 1, 1]])
    camera = camera_on(around, 0.3, 120.0, 100.0)
    address = bones_image(bodies, {"a": box}, 0, camera)
    image = Image.open(io.BytesIO(base64.b64decode(address.removeprefix("data:image/webp;base64,"))))
    assert image.size == (120 * KEPT, 100 * KEPT)
    solid = np.argwhere(np.asarray(image.convert("RGBA"))[..., 3] > 128)
    expected = KEPT * camera.seen(position[0, 0])[[1, 0]]
    np.testing.assert_allclose(solid.mean(axis=0), expected, atol=3)
    corners = KEPT * camera.seen(trimesh.bounds.corners(box.bounds) + position[0, 0])[:, [1, 0]]
    np.testing.assert_allclose(solid.min(axis=0), corners.min(axis=0), atol=2)
    np.testing.assert_allclose(solid.max(axis=0), corners.max(axis=0), atol=2)


def test_nothing_known_gives_no_picture():
    bodies = BodyReplay(("a",), np.full((1, 1, 4), np.nan), np.full((1, 1, 3), np.nan))
    camera = camera_on(np.array([[0, 0, 0], [1, 1, 1]]), 0.0, 10, 10)
    assert bones_image(bodies, {"a": trimesh.creation.box((1, 1, 1))}, 0, camera) == ""
