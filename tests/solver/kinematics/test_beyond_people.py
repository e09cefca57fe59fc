"""Which angles no person's joint takes; what becomes of them is in test_out_of_view.py."""

import numpy as np
import pytest

from solver.kinematics.determined import beyond_people
from solver.skeleton.default_body import default_skeleton

RATE = 100.0


@pytest.mark.parametrize(
    ("name", "degrees", "beyond"),
    [
        ("elbow_flex_l", -45, True),
        ("elbow_flex_l", -20, False),
        ("knee_angle_r", 175, True),
        ("knee_angle_r", 160, False),
        ("lumbar_extension", 70, True),
        ("pelvis_tilt", 200, False),  # who turns a somersault
    ],
)
def test_limits_are_those_of_people(name, degrees, beyond):
    body = default_skeleton()
    q = np.zeros((60, len(body.dofs)))
    q[30, body.dofs.index(name)] = np.radians(degrees)
    found = beyond_people(body, q, RATE)
    assert found[30].any() == beyond
    assert set(np.flatnonzero(found.any(axis=1))) <= set(range(15, 46))
    assert not found[:, np.array(body.dofs) != name].any()
