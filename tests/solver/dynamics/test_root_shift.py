"""Moving the root: the centre of mass goes where it is told, and no angle changes."""

import numpy as np
import pytest

from solver.dynamics.root_wrench import with_com_at
from solver.skeleton.functions import Linear
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.rotations import body_fixed_xyz
from solver.skeleton.skeleton import Axis, Body, Coordinate, Joint, Skeleton


@pytest.fixture
def skewed() -> Skeleton:
    """A trunk on a root whose frames are turned, whose axes are oblique and one of which counts backwards."""
    oblique = np.array([[1.0, 0.0, 0.0], [0.3, 0.95, 0.0], [0.0, -0.2, 0.98]])
    slopes = (1.0, -2.0, 0.5)
    root = (
        *(
            Axis("translation", axis, Linear(slope, 0.1), name)
            for axis, slope, name in zip(oblique, slopes, ("tx", "ty", "tz"), strict=True)
        ),
        *(
            Axis("rotation", axis, Linear(1.0, 0.0), name)
            for axis, name in zip(np.eye(3)[[2, 0, 1]], ("tilt", "list", "turn"), strict=True)
        ),
    )
    hinge = (Axis("rotation", np.array([0.0, 0.0, 1.0]), Linear(1.0, 0.0), "hip"),)
    names = ("tilt", "tx", "list", "hip", "ty", "turn", "tz")
    turned = body_fixed_xyz(np.array([0.4, -0.7, 1.1]))
    return Skeleton(
        name="skewed",
        bodies=(
            Body("pelvis", 30.0, np.array([0.0, 0.1, 0.02]), np.eye(3)),
            Body("leg", 12.0, np.array([0.0, -0.4, 0.0]), np.eye(3)),
        ),
        joints=(
            Joint("root", -1, turned, np.array([0.5, 0.2, -0.3]), turned.T, np.array([0.0, 0.1, 0.0]), root),
            Joint("hip", 0, np.eye(3), np.array([0.0, -0.1, 0.1]), np.eye(3), np.zeros(3), hinge),
        ),
        coordinates=tuple(Coordinate(name, "rotation", 0.0, (-10.0, 10.0)) for name in names),
        markers=(),
    )


def test_the_centre_of_mass_is_where_it_was_asked_for(skewed):
    rng = np.random.default_rng(5)
    q, target = rng.normal(size=(20, 7)), rng.normal(size=(20, 3))
    moved = with_com_at(skewed, q, target)
    np.testing.assert_allclose(RigidBodyModel(skewed).centre_of_mass(moved), target, atol=1e-12)


def test_only_the_roots_translations_change(skewed):
    rng = np.random.default_rng(5)
    q = rng.normal(size=(20, 7))
    kept = q.copy()
    moved = with_com_at(skewed, q, rng.normal(size=(20, 3)))
    translations = [skewed.dofs.index(name) for name in ("tx", "ty", "tz")]
    np.testing.assert_array_equal(np.delete(moved, translations, axis=1), np.delete(q, translations, axis=1))
    np.testing.assert_array_equal(q, kept)


def test_a_body_that_is_there_already_stays(skewed):
    q = np.random.default_rng(5).normal(size=(20, 7))
    there = RigidBodyModel(skewed).centre_of_mass(q)
    np.testing.assert_allclose(with_com_at(skewed, q, there), q, atol=1e-12)
