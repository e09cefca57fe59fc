"""What can be shown of joints, in words."""

from dataclasses import replace

import numpy as np

from addb_viewer.trial_view.joint_quantities import Kind, quantities_of
from tests.made_std import made_std


def test_joints_are_listed_in_words_with_both_sides_and_units(make_replay):
    found = quantities_of(make_replay().joints)
    assert [(q.id, q.words, q.unit, [side for side, _ in q.columns]) for q in found] == [
        ("pelvis_tx angle", "Pelvis position x", "m", [""]),
        ("pelvis_tx speed", "Pelvis position x speed", "m/s", [""]),
        ("knee_angle angle", "Knee flexion angle", "°", ["right", "left"]),
        ("knee_angle speed", "Knee flexion speed", "°/s", ["right", "left"]),
        ("knee_angle torque", "Knee flexion torque", "N·m", ["right", "left"]),
        ("knee_angle power", "Knee flexion power", "W", ["right", "left"]),
    ]  # the root's torque and power would be the residual


def test_values_are_in_the_unit_that_is_told(make_replay):
    joints = make_replay().joints
    angle, speed, torque, power = quantities_of(joints)[2:]
    (_, right), (_, left) = angle.columns
    np.testing.assert_allclose(np.radians(angle.values(joints, left)), joints.position[:, 2])
    np.testing.assert_allclose(speed.values(joints, right) / 180 * np.pi, joints.speed[:, 1])
    np.testing.assert_array_equal(torque.values(joints, right), joints.torque[:, 1])
    np.testing.assert_allclose(power.values(joints, right), torque.values(joints, right) * joints.speed[:, 1])


def test_standard_deviations_are_in_the_same_unit(make_replay):
    joints = replace(make_replay().joints, std=made_std(200, 3))
    told = {q.kind: q.std(joints, 1)[1] for q in quantities_of(joints, per_kg=True)[2:]}
    radians = {kind: np.degrees(0.01 * k) for k, kind in enumerate((Kind.POSITION, Kind.SPEED), start=1)}
    assert told == radians | {Kind.TORQUE: 0.04 / 80, Kind.POWER: 0.05 / 80}
    joints.std.torque[:, 1] = np.nan
    (torque,) = (q for q in quantities_of(joints) if q.id == "knee_angle torque")
    assert torque.std(joints, 1) is torque.std(make_replay().joints, 1) is None


def test_without_dynamics_there_are_angles_and_speeds_and_a_turned_knee_extends(make_replay):
    joints = replace(make_replay().joints, torque=None, power=None, limits=((-5, 5), (-2, 0.2), (-2, 0.2)))
    found = quantities_of(joints)
    assert {q.kind for q in found} == {Kind.POSITION, Kind.SPEED}
    assert [q.words for q in found][2:] == ["Knee extension angle", "Knee extension speed"]
    assert found[2].id == "knee_angle angle"  # what somebody chose stays chosen with another model


def test_for_each_kilogram_torques_and_powers_are_shared_out_and_angles_stay(make_replay):
    joints = make_replay().joints
    plain, shared = quantities_of(joints), quantities_of(joints, per_kg=True)
    for whole, each in zip(plain, shared, strict=True):
        (_, column) = whole.columns[-1]
        divisor = 80.0 if each.kind in (Kind.TORQUE, Kind.POWER) else 1.0
        np.testing.assert_allclose(divisor * each.values(joints, column), whole.values(joints, column))
    assert [q.unit for q in shared][2:] == ["°", "°/s", "N·m/kg", "W/kg"]
    lighter = replace(joints, mass_kg=40.0)
    assert shared[-1].of(lighter).divisor == 40.0
    assert plain[-1].of(lighter).divisor == 1.0
    assert quantities_of(replace(joints, mass_kg=None), per_kg=True)[-1].unit == "W"
