"""Written models: read back they are the same skeleton, and OpenSim moves them alike."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from solver.common.errors import CaptureError, ModelError
from solver.skeleton.forward import marker_positions
from solver.skeleton.functions import Composed, CubicSpline, Linear, PiecewiseLinear, Scaled
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.rotations import body_fixed_xyz
from solver.skeleton.scaling import scaled, with_offsets
from solver.skeleton.skeleton import Axis, Geometry

NOT_IN_FILES = {("Skeleton", "notes"), ("Body", "scale")}


@pytest.fixture
def furnished(crane):
    """The crane with meshes and every kind of function."""
    turned = Geometry("bone.vtp", np.array([1, 2, 3.0]), body_fixed_xyz(np.ones(3)), np.array([0.1, 0, 0]))
    plain = Geometry("other.stl", np.ones(3), np.eye(3), np.zeros(3))
    first, *others = crane.bodies
    knee = crane.joints[2]
    along = (
        Axis("translation", np.eye(3)[0], CubicSpline((0.0, 1.0, 2.0), (0.0, 0.1, 0.0)), "knee_angle"),
        Axis("translation", np.eye(3)[1], PiecewiseLinear((0.0, 1.0), (0.0, 0.01)), "knee_angle"),
        Axis("translation", np.eye(3)[2], Scaled(1.5, Linear(0.01, 0.02)), "knee_angle"),
    )
    turns = tuple(axis for axis in knee.axes if axis.kind == "rotation")
    joints = (*crane.joints[:2], replace(knee, axes=along + turns), *crane.joints[3:])
    bodies = (replace(first, geometry=(plain, turned)), replace(others[0], geometry=(plain,)), *others[1:])
    coordinates = tuple(
        replace(c, motion="rotation") if c.motion == "coupled" else c for c in crane.coordinates
    )  # its axis follows it one to one, so OpenSim calls it a rotation
    return replace(crane, bodies=bodies, joints=joints, coordinates=coordinates)


def test_a_written_skeleton_reads_back_as_itself(furnished, tmp_path):
    path = tmp_path / "with spaces é.osim"
    write_skeleton(furnished, path)
    assert_same(load_skeleton(path), furnished)


@pytest.mark.real
def test_real_models_survive_writing_scaled(model_files, tmp_path, subtests):
    for path in model_files:
        if "Scapulothoracic" in path.name:
            continue
        with subtests.test(path.name):
            skeleton = individual(load_skeleton(path))
            write_skeleton(skeleton, tmp_path / "m.osim")
            assert_same(load_skeleton(tmp_path / "m.osim"), skeleton)


@pytest.mark.opensim
@pytest.mark.real
def test_opensim_moves_written_models_alike(model_files, referee, random_q, tmp_path, subtests):
    for path in model_files:
        if "Scapulothoracic" in path.name:
            continue
        with subtests.test(path.name):
            skeleton = individual(load_skeleton(path))
            write_skeleton(skeleton, tmp_path / "m.osim")
            theirs = referee(tmp_path / "m.osim", skeleton)
            assert [c.getName() for c in theirs.coordinates] == [c.name for c in skeleton.coordinates]
            q = random_q(skeleton, np.random.default_rng(12))
            M = theirs.mass_matrix(q)
            assert M.shape == (len(q), len(q))
            theirs.pose(q)
            if skeleton.markers:
                ours = marker_positions(skeleton, q[None])[0]
                np.testing.assert_allclose(ours, theirs.markers(), rtol=0, atol=1e-9)


def test_what_opensim_cannot_hold_is_refused(crane, tmp_path):
    joint = crane.joints[5]
    composed = replace(joint.axes[0], function=Composed(Linear(1.0, 0.0), Linear(2.0, 0.0)))
    odd = replace(crane, joints=(*crane.joints[:5], replace(joint, axes=(composed,))))
    with pytest.raises(ModelError, match="'shoulder' moves by a Composed"):
        write_skeleton(odd, tmp_path / "m.osim")
    orphan = replace(crane, joints=(*crane.joints[:5], replace(joint, axes=())))
    with pytest.raises(ModelError, match="no joint uses coordinate 'arm_angle'"):
        write_skeleton(orphan, tmp_path / "m.osim")
    with pytest.raises(CaptureError, match="cannot be replaced"):
        write_skeleton(crane, tmp_path)
    assert list(tmp_path.iterdir()) == []


def individual(generic):
    """The skeleton at a size of its own, with markers moved."""
    rng = np.random.default_rng(13)
    sized = scaled(generic, rng.uniform(0.8, 1.2, (len(generic.bodies), 3)), 70.0)
    return with_offsets(sized, 0.01 * rng.normal(size=(len(sized.markers), 3)))


def assert_same(ours, theirs, where="skeleton", rtol=1e-12, atol=1e-14):
    """Equal but for what files do not hold, and rounding."""
    if is_dataclass(theirs):
        assert type(ours) is type(theirs), where
        for field in fields(theirs):
            if (type(theirs).__name__, field.name) not in NOT_IN_FILES:
                mine, other = getattr(ours, field.name), getattr(theirs, field.name)
                assert_same(mine, other, f"{where}.{field.name}", rtol, atol)
    elif isinstance(theirs, tuple):
        assert len(ours) == len(theirs), where
        for i, (mine, other) in enumerate(zip(ours, theirs, strict=True)):
            assert_same(mine, other, f"{where}[{i}]", rtol, atol)
    elif isinstance(theirs, np.ndarray | float):
        np.testing.assert_allclose(ours, theirs, rtol=rtol, atol=atol, err_msg=where)
    else:
        assert ours == theirs, where


def test_names_that_opensim_refuses_are_written_with_underscores(crane, tmp_path):
    named = replace(crane, name="default body, 71 kg", markers=(replace(crane.markers[0], name="R/ASIS *1"),))
    write_skeleton(named, tmp_path / "model.osim")
    again = load_skeleton(tmp_path / "model.osim")
    assert again.name == "default_body,_71_kg"
    assert again.marker_names == ("R_ASIS__1",)
