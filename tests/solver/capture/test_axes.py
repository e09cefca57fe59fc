from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.capture.axes import VerticalAxis, markers_y_up, plate_y_up, vertical_axis, vertical_axis_named
from solver.capture.capture import ForcePlate, Markers
from solver.common.errors import CaptureError

SIGNED = [f"{sign}{axis}" for axis in "xyz" for sign in "+-"]
NAMES = ("RHEE", "RTOE", "LHEE", "RKNE", "LKNE", "RASI", "LASI", "C7", "RSHO", "RFHD")


def walker(names=NAMES, frames=120, rate=100.0):
    """Somebody walking 3 m along z with y up; the right foot rests half of the time."""
    rng = np.random.default_rng(2)
    time = np.arange(frames) / rate
    height = np.array([0.05, 0.04, 0.05, 0.5, 0.48, 0.95, 0.96, 1.45, 1.4, 1.7])
    side = np.array([0.1, 0.1, -0.1, 0.12, -0.12, 0.12, -0.12, 0.0, 0.18, 0.07])
    positions = np.zeros((frames, 10, 3))
    positions[:, :, 1] = height
    positions[:, :, 0] = side
    positions[:, :, 2] = -1.5 + 2.5 * time[:, None]
    stance = time > 0.6
    positions[stance, :2, 2] = positions[stance, :2, 2][:1]
    return Markers(tuple(names), positions + rng.normal(0, 1e-4, positions.shape), rate)


def in_lab(markers, up):
    """The same recording in a laboratory in which `up` points up."""
    return replace(markers, positions_ground=markers.positions_ground @ vertical_axis_named(up).R_ground_lab)


@pytest.mark.parametrize("name", SIGNED)
def test_every_turn_is_a_rotation_that_brings_up_to_y(name):
    up = vertical_axis_named(name)
    np.testing.assert_allclose(up.R_ground_lab @ up.R_ground_lab.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(up.R_ground_lab) == pytest.approx(1)
    np.testing.assert_allclose(up.R_ground_lab @ up.up_lab, [0, 1, 0], atol=1e-15)
    assert up.name == name


def test_z_up_turns_as_opensim_users_do():
    R = vertical_axis_named("z").R_ground_lab
    np.testing.assert_allclose(R @ [1.0, 2.0, 3.0], [1.0, 3.0, -2.0])
    np.testing.assert_allclose(vertical_axis_named("y").R_ground_lab, np.eye(3))


@pytest.mark.parametrize("wrong", ["", "w", "zz", "up", "+-z"])
def test_unknown_axis(wrong):
    with pytest.raises(CaptureError, match="no such axis"):
        vertical_axis_named(wrong)


@pytest.mark.parametrize("default", ["y", "z"])
@pytest.mark.parametrize("name", SIGNED)
def test_upright_markers_tell_every_axis_and_sign(name, default):
    up = vertical_axis(in_lab(walker(), name), default=default)
    assert (up.name, up.certain) == (name, True)
    np.testing.assert_allclose(
        markers_y_up(in_lab(walker(), name), up).positions_ground[:, :, 1],
        walker().positions_ground[:, :, 1],
        atol=1e-12,
    )


@pytest.mark.parametrize("name", SIGNED)
def test_nameless_markers_tell_it_by_the_foot_that_rests(name):
    nameless = walker(tuple(f"M{k}" for k in range(10)))
    assert vertical_axis(in_lab(nameless, name), default="z").name == name


def test_without_evidence_the_default_is_said_to_be_assumed():
    rng = np.random.default_rng(3)
    cloud = Markers(("a", "b", "c", "d"), rng.normal(0, 0.1, (20, 4, 3)), 100.0)
    for default in "yz":
        up = vertical_axis(cloud, default=default)
        assert up.name == f"+{default}"
        assert not up.certain
        assert "ambiguous" in up.notes("a.trc")[0]


def test_forces_outweigh_a_body_that_lies_down():
    lying = in_lab(walker(), "+z")
    lying = replace(lying, positions_ground=lying.positions_ground[:, :, [2, 1, 0]])
    push = np.tile([20.0, -30.0, 600.0], (50, 1))
    up = vertical_axis(lying, [push], default="z")
    assert up.name == "+z"
    assert any("although" in sentence for sentence in up.evidence)


def test_the_sign_of_forces_is_no_evidence():
    push = np.tile([0.0, 5.0, -600.0], (50, 1))
    assert vertical_axis(in_lab(walker(), "+z"), [push], default="z").name == "+z"


def test_noise_of_unloaded_plates_is_no_evidence():
    noise = np.random.default_rng(0).normal(0, 3, (500, 3)) + np.array([15.0, 0.0, 0.0])
    assert vertical_axis(in_lab(walker(), "+z"), [noise], default="z").name == "+z"


def test_screen_axes_hint_at_the_axis_only():
    rng = np.random.default_rng(3)
    cloud = Markers(("a", "b", "c", "d"), rng.normal(0, 0.1, (20, 4, 3)), 100.0)
    assert vertical_axis(cloud, default="z", screen_up="-Z").name == "+z"


def test_forces_alone():
    push = np.tile([0.0, 5.0, 600.0], (50, 1))
    assert vertical_axis(None, [push], default="y").name == "+z"


@given(st.sampled_from(SIGNED), st.integers(0, 2**32 - 1))
def test_turning_a_plate_keeps_the_wrench(name, seed):
    """What doesn't depend on axes: the moment about the centre of pressure, and its part along the force."""
    rng = np.random.default_rng(seed)
    force, moment, cop = rng.normal(size=(3, 4, 3))
    corners = rng.normal(size=(4, 3))
    plate = ForcePlate("p", force, moment, cop, 100.0, corners_ground=corners, point_ground=cop)
    turned = plate_y_up(plate, vertical_axis_named(name))
    np.testing.assert_array_equal(turned.point_ground, turned.cop_ground)
    about = moment - np.cross(cop, force)
    about_turned = turned.moment_ground - np.cross(turned.cop_ground, turned.force_ground)
    np.testing.assert_allclose(
        np.einsum("si,si->s", about, force),
        np.einsum("si,si->s", about_turned, turned.force_ground),
        atol=1e-12,
    )
    np.testing.assert_allclose(
        np.linalg.norm(about, axis=1), np.linalg.norm(about_turned, axis=1), atol=1e-12
    )
    up = vertical_axis_named(name).up_lab
    np.testing.assert_allclose(turned.force_ground[:, 1], force @ up, atol=1e-12)
    np.testing.assert_allclose(turned.corners_ground[:, 1], plate.corners_ground @ up, atol=1e-12)


def test_certain_by_default():
    assert VerticalAxis(1, 1).certain
