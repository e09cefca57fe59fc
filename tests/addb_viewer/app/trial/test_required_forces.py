import numpy as np
import pytest

from addb_viewer.app.scene.force_nodes import hollow_arrow
from addb_viewer.trial_view.replay_of_fit import acting_point


def test_the_point_is_where_the_force_has_that_moment():
    rng = np.random.default_rng(0)
    force = np.array([[30.0, 700.0, -20.0], [-10.0, 500.0, 5.0]])
    point = np.array([[1.2, 0.0, -0.3], [0.1, 0.0, 0.2]])
    free = np.zeros((2, 3))
    free[:, 1] = rng.normal(0, 5, 2)
    wrench = np.concatenate([force, np.cross(point, force) + free], axis=1)
    np.testing.assert_allclose(acting_point(wrench, point + np.array([0.05, 0.1, 0.05])), point, atol=1e-12)


def test_far_from_the_foot_or_without_load_it_starts_below_the_foot():
    foot = np.array([[1.0, 0.1, 0.0]])
    far = np.array([[0.0, 100.0, 0.0, 0.0, 0.0, 500.0]])  # 5 m along x
    light = np.array([[0.0, 1.0, 0.0, 0.0, 0.0, 1.0]])
    for wrench in (far, light):
        np.testing.assert_allclose(acting_point(wrench, foot), [[1.0, 0.0, 0.0]])


@pytest.mark.parametrize("along", [[0, 1, 0], [0.3, 0.5, -0.2], [1, 0, 0]])
def test_a_hollow_arrow_reaches_from_start_to_tip(along):
    start, along = np.array([0.5, 0.0, 0.2]), np.array(along, float)
    edges = hollow_arrow(start, start + along).reshape(-1, 3) - start
    reach = edges @ along / np.linalg.norm(along)
    assert reach.max() == pytest.approx(np.linalg.norm(along))
    assert reach.min() == pytest.approx(0.0, abs=1e-12)
    assert np.isfinite(edges).all()
