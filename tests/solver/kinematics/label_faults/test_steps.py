"""Steps of labels against those that were put in by hand, on a body that moves meanwhile."""

import numpy as np
import pytest

from solver.kinematics.label_faults.rigid_neighbours import Stretch, edges, rigid_neighbours, step_m

STEP = np.array([0.03, -0.04, 0.12])  # 13 cm


@pytest.fixture
def rigid(swinging, crane):
    x = swinging.positions_ground.copy()
    x[100:160, 0] += STEP
    x[155:170, 1] = np.nan
    return rigid_neighbours(x, crane)


def test_a_step_is_that_of_the_label_not_of_the_body(rigid):
    assert step_m(rigid, (0, 0), (99, 100)) == pytest.approx(0.13, abs=0.01)
    assert step_m(rigid, (2, 2), (99, 100)) < 0.02
    assert np.linalg.norm(rigid.points_ground[120, 2] - rigid.points_ground[99, 2]) > 0.1


def test_from_one_labels_place_to_anothers(rigid):
    apart = np.linalg.norm(rigid.points_ground[50, 2] - rigid.points_ground[50, 3])
    assert step_m(rigid, (2, 3), (50, 51), without=(2, 3)) == pytest.approx(apart, abs=0.01)


def test_edges_are_where_all_columns_are_seen(rigid):
    stretch = Stretch(100, 160, 99, 160)
    assert edges(rigid, (0, 2), stretch, 100.0) == [(99, 100), (159, 160)]
    assert edges(rigid, (0, 1), stretch, 100.0) == [(99, 100), (154, 170)]
    assert edges(rigid, (0, 1), stretch, 5.0) == [(99, 100), None]
    assert edges(rigid, (0, 2), Stretch(0, 60, None, 60), 100.0) == [(59, 60)]
