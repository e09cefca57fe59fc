"""A fit as C3D: what was recorded, and beside it what the model says, by the field's conventions."""

from dataclasses import replace

import ezc3d
import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.export.c3d import export_c3d, foot_events
from solver.gait.events import Source, Stance, side_of
from solver.gait.gait import Gait


def points_of(path):
    found = ezc3d.c3d(str(path))
    labels = found["parameters"]["POINT"]["LABELS"]["value"]
    values = found["data"]["points"][:3].transpose(1, 2, 0)
    return dict(zip(labels, values, strict=True)), found["parameters"]


@pytest.fixture
def written(fit, tmp_path):
    (path,), notes = export_c3d(fit, tmp_path / "results" / "c3d")
    assert path == tmp_path / "results" / "c3d" / "walk.c3d"
    assert notes == ("walk.c3d: frame 1 is at 0.35 s of the recording; in a C3D file it is at 0 s",)
    return points_of(path)


def test_angles_are_degrees_joint_by_joint_in_the_order_of_their_axes(written, fit):
    points, parameters = written
    q, dofs = np.degrees(fit.trials[0].dynamics.motion.q), fit.skeleton.dofs
    hip = [q[:, dofs.index(name)] for name in ("hip_flexion", "hip_adduction", "hip_rotation")]
    np.testing.assert_allclose(points["hip_angles"], np.column_stack(hip), atol=1e-4)
    knee = q[:, dofs.index("knee_angle")]
    np.testing.assert_allclose(points["knee_angles"], np.column_stack([knee, 0 * knee, 0 * knee]), atol=1e-4)
    assert parameters["POINT"]["ANGLE_UNITS"]["value"] == ["deg"]
    described = dict(
        zip(parameters["POINT"]["LABELS"]["value"], parameters["POINT"]["DESCRIPTIONS"]["value"], strict=True)
    )
    assert described["hip_angles"] == "x hip_flexion, y hip_adduction, z hip_rotation"


def test_moments_powers_and_the_residual_force_stand_in_their_groups(written, fit):
    points, parameters = written
    dynamics, dofs = fit.trials[0].dynamics, fit.skeleton.dofs
    knee = dofs.index("knee_angle")
    np.testing.assert_allclose(
        points["knee_moments"][:, 0], 1000 * dynamics.joint_torques[:, knee], rtol=1e-5, atol=0.1
    )
    power = dynamics.joint_torques[:, knee] * dynamics.motion.velocity[:, knee]
    np.testing.assert_allclose(points["knee_powers"][:, 0], power, rtol=1e-5, atol=1e-4)
    root = fit.skeleton.joints[0].name
    forces = [dynamics.joint_torques[:, dofs.index(name)] for name in ("tx", "ty", "tz")]
    np.testing.assert_allclose(points[f"{root}_forces"], np.column_stack(forces), rtol=1e-5, atol=1e-3)
    point = parameters["POINT"]
    assert "knee_moments" in point["MOMENTS"]["value"]
    assert point["MOMENT_UNITS"]["value"] == ["Nmm"]
    assert point["POWER_UNITS"]["value"] == ["W"]
    assert f"{root}_forces" in point["FORCES"]["value"]
    assert f"{root}_translations" in point["SCALARS"]["value"]


def test_every_coordinate_is_in_some_point_once(written, fit):
    _, parameters = written
    told = [
        part.split(" ", 1)[1]
        for label, text in zip(
            parameters["POINT"]["LABELS"]["value"], parameters["POINT"]["DESCRIPTIONS"]["value"], strict=True
        )
        if label.endswith(("_angles", "_translations"))
        for part in text.split(", ")
    ]
    assert sorted(told) == sorted(fit.skeleton.dofs)


def test_a_trial_without_dynamics_has_angles_alone(fit, tmp_path):
    trial = replace(fit.trials[0], dynamics=None, contacts=None, mask=None)
    (path,), _ = export_c3d(replace(fit, trials=(trial,)), tmp_path)
    points, parameters = points_of(path)
    assert "hip_angles" in points
    assert not any(label.endswith(("_moments", "_powers", "_forces")) for label in points)
    assert "MOMENTS" not in parameters["POINT"]


def test_markers_that_were_not_seen_stay_unseen(fit, tmp_path):
    positions = np.full((90, 1, 3), 0.5)
    positions[7] = np.nan
    trial = replace(
        fit.trials[0], capture=replace(fit.trials[0].capture, markers=Markers(("M0",), positions, 50.0))
    )
    (path,), _ = export_c3d(replace(fit, trials=(trial,)), tmp_path)
    points, _ = points_of(path)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(points["M0"]).any(axis=1)), [7])
    np.testing.assert_allclose(points["M0"][6], [500, -500, 500])


def test_gait_events_get_the_names_of_the_field():
    stances = (Stance(0, 0.2, 0.9, Source.FORCE), Stance(1, None, 0.4, Source.FEET))
    events = foot_events(Gait(("calcn_r", "calcn_l"), stances, ()))
    assert [(e.time_s, e.side, e.label) for e in events] == [
        (0.2, "Right", "Foot Strike"),
        (0.4, "Left", "Foot Off"),
        (0.9, "Right", "Foot Off"),
    ]


@pytest.mark.parametrize(
    ("body", "side"),
    [
        ("calcn_l", "Left"),
        ("r_foot", "Right"),
        ("LeftFoot", "Left"),
        ("foot", "General"),
        ("calcaneus", "General"),
    ],
)
def test_the_side_of_a_body_is_read_from_its_name(body, side):
    assert side_of(body) == side
