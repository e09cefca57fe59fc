"""Force vectors that lean against the cameras' vertical."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.plate_geometry import GravityTilt


def leaning(tilt_deg, capture, seen, refiled):
    R = Rotation.from_rotvec(np.radians([tilt_deg[0], 0.0, tilt_deg[1]]))

    def tilted(force, point, free):
        return R.apply(force), point, free

    return seen(replace(capture, plates=tuple(refiled(plate, tilted) for plate in capture.plates)))


def left_over(tilt_deg, crisp, seen, refiled):
    scene = leaning(tilt_deg, crisp, seen, refiled)
    given = GravityTilt("all").signature(scene, ()).columns @ np.radians(tilt_deg)
    missing = seen(crisp).measured_ground - scene.measured_ground
    return np.sqrt(((missing - given) ** 2).mean()) / np.sqrt((missing**2).mean())


def test_the_true_wrench_comes_back_to_second_order(crisp, seen, refiled):
    tilt = np.array([1.2, -0.9])
    whole, half = (left_over(share * tilt, crisp, seen, refiled) for share in (1.0, 0.5))
    assert whole < 0.02
    assert half == pytest.approx(whole / 2, rel=0.02)


@pytest.mark.parametrize("axis", [0, 1])
def test_columns_are_derivatives(crisp, seen, refiled, axis):
    step = 0.01 * np.eye(2)[axis]
    more, less = (leaning(sign * step, crisp, seen, refiled).measured_ground for sign in (1, -1))
    slope = (more - less) / np.radians(0.02)
    column = GravityTilt("all").signature(seen(crisp), ()).columns[:, :, axis]
    np.testing.assert_allclose(-column, slope, atol=1e-5 * np.abs(slope).max())


def test_estimates_and_the_practical_minimum():
    candidate = GravityTilt("all")
    covariance = np.diag(np.radians([0.1, 0.2]) ** 2)
    found = candidate.estimates([], Fitted((), (), np.radians([1.5, -0.5]), covariance))
    assert list(found) == ["tilt_x_deg", "tilt_z_deg"]
    assert [e.value for e in found.values()] == pytest.approx([1.5, -0.5])
    assert [e.std for e in found.values()] == pytest.approx([0.1, 0.2])
    assert candidate.is_notable(found)
    assert not candidate.is_notable(
        candidate.estimates([], Fitted((), (), np.radians([0.3, 0.3]), covariance))
    )


def test_one_candidate_where_anything_is_loaded(crisp, seen):
    scene = seen(crisp)
    assert [c.target for c in GravityTilt.candidates([scene])] == ["all"]
    assert GravityTilt.candidates([replace(scene, plates=())]) == []
