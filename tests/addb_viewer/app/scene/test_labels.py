"""Labels stay in the picture and apart; the eye that sees them is the inverse of itself."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from addb_viewer.app.scene.camera import Eye
from addb_viewer.app.scene.labels import add_label, free_place, settle

PICTURE = np.array([800.0, 600.0])
AHEAD = Eye(np.array([0.0, 0.0, -4.0]), np.diag([1.0, -1.0, 1.0]), 700.0, PICTURE)  # y of the ground is up


def boxes(labels, eye=AHEAD, offset=0.0):
    """Centres and sizes in the picture, by the pinhole's own formula."""
    found = []
    for label in labels:
        x, y, z = eye.R_ground_eye.T @ (label.handle.position + offset - eye.position)
        found.append((0.5 * eye.size + eye.focal * np.array([x / z, y / z]), label.size))
    return found


def inside(centre, size):
    return (centre - 0.5 * size >= 0).all() and (centre + 0.5 * size <= PICTURE).all()


def apart(a, b):
    return (np.abs(a[0] - b[0]) >= 0.5 * (a[1] + b[1]) - 1e-6).any()


def test_a_point_is_seen_where_it_is_and_found_again():
    rng = np.random.default_rng(3)
    eye = Eye(rng.normal(size=3), Rotation.random(random_state=4).as_matrix(), 500.0, PICTURE)
    right, down, ahead = eye.R_ground_eye.T
    point = eye.position + 3.0 * ahead + 0.6 * right - 0.3 * down
    (place,), (depth,) = eye.project(point[None])
    np.testing.assert_allclose(place, [400 + 500 * 0.2, 300 - 500 * 0.1])
    np.testing.assert_allclose(eye.point_at(place, depth), point)


def test_labels_at_one_place_and_at_the_edges_end_whole_and_apart(server):
    scene, offset = server.scene, np.array([0.5, 0.0, 0.0])
    places = [(0, 0, 0), (0, 0.01, 0), (0.02, 0, 0.1), (2.2, 1.7, 0), (2.25, 1.68, 0), (-2.27, -1.7, 0)]
    labels = [
        add_label(scene, f"/l/{i}", f"a name, {40 * i} N", np.array(p, float) - offset)
        for i, p in enumerate(places)
    ]
    settle(labels, AHEAD, offset)
    found = boxes(labels, offset=offset)
    assert all(inside(*box) for box in found)
    assert all(apart(a, b) for k, a in enumerate(found) for b in found[:k])


def test_a_label_that_has_room_stands_beside_its_place_and_goes_with_it(server):
    above, below = (add_label(server.scene, f"/m/{s}", "plate", np.zeros(3), side=s) for s in (1, -1))
    settle([above, below], AHEAD, np.zeros(3))
    (up, size), (down, _) = boxes([above, below])
    assert up[0] == down[0] == pytest.approx(400)
    assert 300 - size[1] < up[1] < 300 < down[1] < 300 + size[1]
    was = np.array(above.handle.position)
    above.show(np.array([0.1, 0.2, 0.3]))
    np.testing.assert_allclose(above.handle.position, was + np.array([0.1, 0.2, 0.3]))
    above.show(None)
    assert not above.handle.visible


def test_a_plate_that_is_out_of_the_picture_takes_its_name_with_it(server):
    far, origin = np.array([9.0, 0, 0]), np.zeros(3)
    stays, goes, part = (
        add_label(server.scene, f"/n/{i}", "far", far, of=of)
        for i, of in enumerate((None, far[None], np.stack([far, origin])))
    )
    behind = add_label(server.scene, "/n/behind", "behind", np.array([0.0, 0, -9.0]))
    settle([stays, goes, part, behind], AHEAD, np.zeros(3))
    assert all(inside(*box) for box in boxes([stays, part]))
    assert not goes.handle.visible
    assert not behind.handle.visible
    settle([goes], Eye(np.array([9.0, 0, -4.0]), AHEAD.R_ground_eye, 700.0, PICTURE), np.zeros(3))
    assert goes.handle.visible


def test_where_there_is_no_room_a_label_is_inside_all_the_same():
    size, picture = np.array([90.0, 90.0]), np.array([110.0, 110.0])
    centre = free_place(np.array([500.0, 5.0]), size, [(0.0, 0.0, 110.0, 110.0)], picture)
    np.testing.assert_allclose(centre, [59.0, 51.0])
