from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import body_poses


def test_coordinates_release_memory_the_pose(crane, crane_q):
    R, p = body_poses(crane, crane_q)
    root = root_joint(crane)
    again = crane_q.copy()
    again[:, root.dofs] = root.coordinates(R[:, root.body], p[:, root.body])
    R_again, p_again = body_poses(crane, again)
    np.testing.assert_allclose(R_again[:, root.body], R[:, root.body], atol=1e-12)
    np.testing.assert_allclose(p_again[:, root.body], p[:, root.body], atol=1e-12)


def test_a_root_that_is_not_free_is_named(crane):
    coordinates = tuple(replace(c, locked=c.name == "ty" or c.locked) for c in crane.coordinates)
    with pytest.raises(ModelError, match="root joint 'root' has 5 free coordinates"):
        root_joint(replace(crane, coordinates=coordinates))
