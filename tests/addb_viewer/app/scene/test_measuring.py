"""What clicks in the scene measure, against lengths and angles that are known."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from addb_viewer.app.scene.camera import Eye
from addb_viewer.app.scene.measuring import Spot, angle, first_hit, from_vertical, joint_words
from addb_viewer.app.scene.scene import TrialScene
from addb_viewer.trial_view.replay import JointCentre
from tests.addb_viewer.app.scene.conftest import MESHES

SIDEWAYS = Eye(np.array([0.0, 1.0, 3.0]), np.diag([1.0, -1.0, -1.0]), 900.0, np.array([1200.0, 800.0]))


@pytest.fixture
def scene(server, make_replay):
    replay = make_replay()
    replay = replace(
        replay, bodies=replace(replay.bodies, joints={0: JointCentre("hip_r", np.array([0, 0.2, 0.1]))})
    )
    scene = TrialScene(server)
    scene.show(replay, MESHES)
    scene.measuring.switch(True)
    return scene


def at(point, offset=0.0):
    """Where a point is seen."""
    return SIDEWAYS.project(np.array([point], dtype=float) + offset)[0][0]


def spot(*places):
    return Spot("a", np.array(places, dtype=float))


def test_two_clicks_measure_a_distance_that_follows_the_cursor(scene):
    for point in ((0, 1.7, 0), (0, 1.2, 0.1)):  # HEAD, and the joint in the pelvis
        assert scene.measure(0, SIDEWAYS, at(point) + np.array([3.0, -4.0]))
    assert [found.words for found in scene.measuring.spots] == ["HEAD", "right hip"]
    told = scene.measuring.told(0)
    assert f"{np.hypot(0.5, 0.1):.3f}" in told
    assert f"{np.degrees(np.arctan(0.1 / 0.5)):.1f}°" in told
    scene.draw(100)
    np.testing.assert_allclose(scene.measuring.lines.points[0], [[1, 1.7, 0], [1, 1.2, 0.1]], atol=1e-6)
    assert scene.measuring.label.handle.text == "0.510 m"


def test_the_scene_that_follows_the_person_is_clicked_where_it_is_seen(scene):
    scene.draw(100)
    assert scene.measure(100, SIDEWAYS, at((1.0, 1.7, 0), scene.lab.position))
    assert scene.measuring.spots[0].words == "HEAD"


def test_the_pointer_names_a_marker_and_its_error_where_the_model_has_it(scene):
    scene.draw(100)
    for point, words in (
        ((1.0, 1.7, 0), "HEAD"),
        ((1.1, 0.05, 0.1), "RTOE · error 3.0 cm"),
        ((1.5, 1.4, 0), ""),
    ):
        assert scene.pointed_at(100, SIDEWAYS, at(point, scene.lab.position)) == words


def test_a_point_on_a_bone_moves_with_it_and_beside_it_is_nothing(scene):
    assert scene.measure(0, SIDEWAYS, at((0.07, 1.04, 0.15)))
    (found,) = scene.measuring.spots
    np.testing.assert_allclose(found.path[[0, 50]], [[0.07, 1.04, 0.15], [0.57, 1.04, 0.15]], atol=1e-9)
    assert "pelvis" in found.words
    assert not scene.measure(0, SIDEWAYS, at((0.5, 1.4, 0)))
    assert len(scene.measuring.spots) == 1


def test_a_lost_marker_is_not_there_and_the_fourth_click_begins_anew(scene):
    for frame in (60, 55):
        assert scene.measure(frame, SIDEWAYS, at((0.01 * frame, 1.0, -0.1)))
    assert [found.words for found in scene.measuring.spots] == ["L", "R"], "L is lost; R is seen beside it"
    for name in "bcde":
        scene.measuring.take(Spot(name, np.zeros((200, 3))))
    assert [found.words for found in scene.measuring.spots] == ["c", "d", "e"]
    scene.measuring.switch(False)
    scene.draw(0)
    assert not scene.measuring.lines.visible
    assert not scene.measuring.label.handle.visible
    assert not len(scene.measuring.dots.points)


def test_angles_are_those_of_triangles_that_are_known():
    corner = spot((0, 0, 0), (1, 1, 1)).path
    one, other = spot((3, 0, 0), (1, 1, 4)).path, spot((0, 4, 0), (1, 1 + 3**0.5, 2)).path
    np.testing.assert_allclose(np.degrees(angle(one, corner, other)), [90, 60])
    np.testing.assert_allclose(
        np.degrees(from_vertical(np.array([[0, -2.0, 0], [1, 1, 0], [1, 0, 1]]))), [0, 45, 90]
    )


def test_a_ray_meets_the_nearest_of_the_triangles_ahead():
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    start, ray = np.array([0.0, 0.1, 2.0]), np.array([0.0, 0.0, -1.0])
    assert first_hit(sphere.triangles, start, ray) == pytest.approx(2.0 - np.sqrt(0.24), abs=5e-3)
    assert first_hit(sphere.triangles, start, -ray) == np.inf
    assert first_hit(sphere.triangles, start + np.array([0.6, 0, 0]), ray) == np.inf


@pytest.mark.parametrize(
    ("name", "words"), [("walker_knee_r", "right knee"), ("hip_l", "left hip"), ("back", "back")]
)
def test_joints_have_the_names_that_people_say(name, words):
    assert joint_words(name) == words
