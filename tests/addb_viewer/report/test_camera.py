"""Where pictures are seen from."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.report.camera import FIELD_OF_VIEW, camera_on, heading_of

WIDTH, HEIGHT = 320.0, 350.0


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
