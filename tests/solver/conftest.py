"""A small synthetic skeleton with every feature that the kernels must handle."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from solver.capture.formats.b3d.b3d_fields import (
    B3dFile,
    B3dTrial,
    Header,
    PassFrames,
    PassHeader,
    PassModel,
    SensorFrames,
    TrialHeader,
)
from solver.simulate.subject_folder import write_subject
from solver.skeleton.functions import Constant, Linear, Polynomial
from solver.skeleton.rotations import body_fixed_xyz
from solver.skeleton.skeleton import Axis, Body, Coordinate, Joint, Marker, Skeleton
from tests.measured_walk import WOMAN, measured_walk

PI = np.pi


def _body(name, mass=1.0):
    return Body(name, mass, np.array([0.01, -0.1, 0.02]), np.diag([0.02, 0.01, 0.02]))


def _axes(names, kinds, vectors):
    return tuple(
        Axis(kind, np.array(vector, float), Linear(1.0, 0.0), name)
        for name, kind, vector in zip(names, kinds, vectors, strict=True)
    )


def _joint(name, parent, location, axes, *, turn=(0.0, 0.0, 0.0), child=(0.0, 0.0, 0.0)):
    return Joint(
        name, parent, body_fixed_xyz(np.array(turn)), np.array(location), np.eye(3), np.array(child), axes
    )


@pytest.fixture(scope="session")
def crane() -> Skeleton:
    """Free root, a ball-like hip, a knee whose translation follows its angle, a coupled and a locked one."""
    x, y, z = np.eye(3)
    root = _axes(
        ["tx", "ty", "tz", "tilt", "list", "turn"], ["translation"] * 3 + ["rotation"] * 3, [x, y, z, z, x, y]
    )
    hip = _axes(["hip_flexion", "hip_adduction", "hip_rotation"], ["rotation"] * 3, [z, x, y])
    knee = (
        Axis("translation", x, Polynomial((0.02, -0.03, 0.0)), "knee_angle"),
        Axis("translation", y, Constant(-0.01), None),
        Axis("rotation", np.array([0.1, 0.2, -1.0]), Linear(1.0, 0.0), "knee_angle"),
    )
    cap = (Axis("rotation", z, Linear(1.0, 0.1), "cap_angle"),)
    ankle = (
        Axis("rotation", z, Linear(1.0, 0.0), "ankle_angle"),
        Axis("rotation", x, Linear(1.0, 0.0), "locked_angle"),
    )
    free = [
        Coordinate(n, "translation" if n.startswith("t") and len(n) == 2 else "rotation", 0.0, (-10.0, 10.0))
        for n in ("tilt", "list", "turn", "tx", "ty", "tz", "hip_flexion", "hip_adduction", "hip_rotation")
    ]
    coordinates = (
        *free,
        Coordinate("knee_angle", "rotation", 0.3, (0.0, 2.5)),
        Coordinate(
            "cap_angle", "coupled", 0.0, (-9.0, 9.0), coupling=Linear(0.6, 0.05), coupled_to="knee_angle"
        ),
        Coordinate("ankle_angle", "rotation", 0.0, (-1.0, 1.0)),
        Coordinate("locked_angle", "rotation", 0.2, (-1.0, 1.0), locked=True),
        Coordinate("arm_angle", "rotation", 0.0, (-3.0, 3.0)),
    )
    arm = _axes(["arm_angle"], ["rotation"], [x])
    bodies = ("pelvis", "femur_r", "tibia_r", "patella_r", "foot_r", "arm_r")
    joints = (
        _joint("root", -1, (0, 0.1, 0), root),
        _joint("hip", 0, (0.02, -0.05, 0.08), hip, turn=(0.1, -0.2, 0.3)),
        _joint("knee", 1, (0.0, -0.4, 0.01), knee, child=(0.0, 0.01, 0.0)),
        _joint("cap", 1, (0.03, -0.38, 0.0), cap),
        _joint("ankle", 2, (0.0, -0.42, 0.0), ankle, turn=(0.0, 0.3, 0.0)),
        _joint("shoulder", 0, (0.0, 0.4, 0.15), arm),
    )
    rng = np.random.default_rng(3)
    markers = tuple(
        Marker(f"M{i}", body, rng.normal(0, 0.08, 3) + np.array([0, -0.15 * (body > 0), 0]))
        for i, body in enumerate([0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 4, 4, 4, 5, 5])
    )
    return Skeleton("crane", tuple(_body(b) for b in bodies), joints, coordinates, markers)


@pytest.fixture(scope="session")
def crane_q(crane) -> np.ndarray:
    """Smooth motion of the crane, 90 frames, turning by more than a whole turn."""
    t = np.linspace(0, 1.8, 90)
    rng = np.random.default_rng(5)
    q = np.stack([0.3 * np.sin(rng.uniform(2, 5) * t + rng.uniform(0, 6)) for _ in crane.dofs], axis=1)
    names = list(crane.dofs)
    q[:, names.index("turn")] = np.linspace(-2.0, 5.5, len(t))
    q[:, names.index("knee_angle")] += 0.6
    q[:, names.index("tx")] = 1.2 * t
    q[:, names.index("ty")] += 0.9
    return q


LENGTHS = (3, 5)


def assert_same(one, other, place="file"):
    """Equal in every field; NaN equals NaN."""
    if is_dataclass(one):
        assert type(one) is type(other)
        for f in fields(one):
            assert_same(getattr(one, f.name), getattr(other, f.name), f"{place}.{f.name}")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, place
        np.testing.assert_array_equal(one, other, err_msg=place)
    elif isinstance(one, dict):
        assert one.keys() == other.keys(), place
        for key in one:
            assert_same(one[key], other[key], f"{place}[{key}]")
    elif isinstance(one, str | bytes) or not hasattr(one, "__len__"):
        assert one == other, place
    else:
        assert len(one) == len(other), place
        for i, (left, right) in enumerate(zip(one, other, strict=True)):
            assert_same(left, right, f"{place}[{i}]")


@pytest.fixture
def same():
    """Holds two dataclasses against each other."""
    return assert_same


def _b3d_trial(name, frames, rng):
    about = PassHeader(
        dof_positions_observed=np.array([True, False]),
        marker_rms=rng.random(frames).astype(np.float32),
        lowpass_filter_order=3,
    )
    return B3dTrial(
        header=TrialHeader(
            name=name,
            missing_GRF_reason=np.array([0, 10, 18, 0, 5], np.int32)[:frames],
            trial_length=frames,
            trial_timestep=0.01,
            processing_pass_header=(about,),
            trial_tag=("übung",),
            num_force_plates=1,
            force_plate_corners=np.arange(12.0),
        ),
        sensors=SensorFrames(
            marker_obs=np.where(rng.random((frames, 3)) < 0.3, np.nan, rng.normal(size=(frames, 3))),
            raw_force_plate_force=np.zeros((frames, 3)),
        ),
        passes=(PassFrames(pos=rng.normal(size=(frames, 2)), tau=rng.normal(size=(frames, 2))),),
    )


@pytest.fixture
def small_b3d() -> B3dFile:
    """A small .b3d subject made by hand."""
    rng = np.random.default_rng(4)
    trials = tuple(_b3d_trial(f"trial {i}", frames, rng) for i, frames in enumerate(LENGTHS))
    header = Header(
        num_dofs=2,
        passes=(PassModel(0, "<OpenSimDocument/>"),),
        ground_contact_body=("calcn_r",),
        trial_header=tuple(trial.header for trial in trials),
        version=4,
        biological_sex="female",
        height_m=1.65,
        marker_name=("C7",),
        subject_tag=("healthy", ""),
    )
    return B3dFile(header, trials)


@pytest.fixture(scope="session")
def walking_woman(tmp_path_factory):
    """A simulated subject's folder, for those who write nothing into it."""
    folder = tmp_path_factory.mktemp("walker")
    write_subject(folder, WOMAN, [measured_walk()])
    return folder
