from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.capture_scale import CaptureScale
from solver.diagnosis.causes.effect import Fitted
from solver.simulate.ground_demand import GroundDemand
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.scaling import scaled


@pytest.fixture
def enlarged(scene, walk):
    """The walk as cameras with a wrong scale tell it: a larger person in a larger room, no heavier."""

    def at(scale):
        skeleton = scaled(scene.skeleton, np.full((len(scene.skeleton.bodies), 3), scale))
        state = [np.array(x) for x in walk.motion.state(scene.times)]
        places = [k for k, dof in enumerate(skeleton.dofs) if dof in ("pelvis_tx", "pelvis_ty", "pelvis_tz")]
        for x in state:
            x[:, places] *= scale
        required = GroundDemand(RigidBodyModel(skeleton)).wrench(*state)
        return replace(
            scene, skeleton=skeleton, com_ground=scale * scene.com_ground, required_ground=required
        )

    return at


@pytest.mark.parametrize("scale", [1.01, 0.985])
def test_is_what_a_larger_room_demands_too_much(scene, enlarged, explains, demand_of, scale):
    seen = enlarged(scale)
    missing = seen.required_ground - demand_of(scene.skeleton)
    assert explains(CaptureScale("all"), seen, (), [1 - 1 / scale], missing) < 0.012


def test_what_is_left_over_falls_with_the_square_of_the_scale(scene, enlarged, demand_of):
    left = []
    for size in (0.02, 0.01):
        seen = enlarged(1 / (1 - size))
        column = CaptureScale("all").signature(seen, ()).columns[..., 0]
        missing = seen.required_ground - demand_of(scene.skeleton)
        left.append(np.sqrt(np.mean((missing - size * column) ** 2, axis=0)))
    np.testing.assert_allclose(left[0][:3], 0.0, atol=1e-3)
    np.testing.assert_allclose(left[0][3:] / left[1][3:], 4.0, rtol=0.1)


def test_the_scale_is_recorded_over_true(scene, enlarged, fitted, demand_of):
    seen, candidate = enlarged(1.012), CaptureScale("all")
    x, covariance = fitted(candidate, seen, seen.required_ground - demand_of(scene.skeleton))
    found = candidate.estimates([seen], Fitted((), (), x, covariance))
    assert found["scale"].value == pytest.approx(1.012, abs=3e-4)
    assert candidate.is_notable(found)
    assert not candidate.is_notable({"scale": replace(found["scale"], value=0.998)})


def test_there_is_one_room(scene):
    assert [c.target for c in CaptureScale.candidates([scene, scene])] == ["all"]
