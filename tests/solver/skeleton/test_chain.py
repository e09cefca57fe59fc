from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.chain import Fixed, chain_of
from solver.skeleton.functions import Linear
from solver.skeleton.skeleton import Coordinate


def test_every_moving_axis_has_one_driving_dof_and_locked_axes_none(crane):
    chain = chain_of(crane)
    assert chain.dofs == len(crane.dofs) == 12
    assert chain.positions == 6 + 3 + 2 + 1 + 1 + 1
    assert sum(isinstance(s, Fixed) for s in chain.steps[4]) >= 1


def test_derivatives_of_the_coupling_map_match_finite_differences(crane, crane_q):
    chain = chain_of(crane)
    _, slope, curvature = chain.couple(crane_q)
    step = 1e-5
    ahead, behind = chain.couple(crane_q + step), chain.couple(crane_q - step)
    np.testing.assert_allclose(slope, (ahead[0] - behind[0]) / (2 * step), atol=1e-9)
    np.testing.assert_allclose(curvature, (ahead[1] - behind[1]) / (2 * step), atol=1e-9)


def test_a_coupled_coordinate_follows_its_master(crane, crane_q):
    chain = chain_of(crane)
    p, _, _ = chain.couple(crane_q)
    cap = list(chain.body).index(3)
    knee = crane_q[:, crane.dofs.index("knee_angle")]
    np.testing.assert_allclose(p[:, cap], 0.6 * knee + 0.05 + 0.1)


def test_circular_couplings_are_named(crane):
    circle = tuple(
        replace(c, coupling=Linear(1.0, 0.0), coupled_to="cap_angle") if c.name == "knee_angle" else c
        for c in crane.coordinates
    )
    assert isinstance(circle[0], Coordinate)
    with pytest.raises(ModelError, match="coupled in a circle"):
        chain_of(replace(crane, coordinates=circle))
