import numpy as np
import pytest

from solver.capture.formats.c3d_contents import open_c3d
from solver.capture.plates.force_platform import (
    PlatformSignals,
    force_platforms,
    plate_axes,
    wrench_on_surface,
)
from solver.common.errors import CaptureError

LABELS = ("A", "B")
UNITS = ("N",) * 3 + ("Nmm",) * 3
HALF_SIDES = np.array([0.2, 0.3])
SAMPLES = 60
R_SENSOR_SURFACE = np.array([0.004, -0.002, -0.04])  # from the sensors' origin to the surface; z points down


@pytest.fixture
def points():
    return np.random.default_rng(0).normal(500, 100, (20, 2, 3))


def test_plate_axes_follow_the_corners(flat_corners):
    R = plate_axes(flat_corners)
    np.testing.assert_allclose(R, [[0, 1, 0], [1, 0, 0], [0, 0, -1]], atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)


def test_wrench_about_the_laboratory_origin(tmp_path, write_c3d, plate_of, flat_corners, points):
    """A tilted, turned plate: the load is made in the laboratory and taken apart into channels by hand."""
    rng = np.random.default_rng(4)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    corners = flat_corners @ turn.T + np.array([0.3, -0.2, 0.1])
    middle = corners.mean(axis=0)
    R = plate_axes(corners)
    force = rng.normal(0, 200, (20, 3))
    acts_at = middle + rng.uniform(-0.1, 0.1, (20, 2)) @ R[:, :2].T
    moment_origin = np.cross(acts_at, force)
    in_plate = np.c_[force @ R, np.cross(acts_at - middle, force) @ R * 1000]
    path = write_c3d(
        tmp_path / "a.c3d", points, LABELS, plates=[plate_of(2, in_plate, corners * 1000, units=UNITS)]
    )
    (platform,), notes = force_platforms(open_c3d(path), 1e-3)
    np.testing.assert_allclose(platform.force_lab, force, atol=1e-3)  # the file stores single precision
    np.testing.assert_allclose(platform.moment_lab, moment_origin, atol=1e-3)
    np.testing.assert_allclose(platform.corners_lab, corners, atol=1e-6)
    assert notes == ()


def test_zero_frames(tmp_path, write_c3d, plate_of, flat_corners, points):
    channels = np.tile([1.0, 2.0, -8.0, 10.0, 20.0, 30.0], (20, 1))
    channels[10:] += [0.0, 0.0, -500.0, 0.0, 0.0, 0.0]
    plate = plate_of(2, channels, flat_corners * 1000, units=UNITS)

    def read(first, last):
        zero = {"FORCE_PLATFORM__ZERO": [first, last]}
        path = write_c3d(tmp_path / "a.c3d", points, LABELS, plates=[plate], **zero)
        (platform,), notes = force_platforms(open_c3d(path), 1e-3)
        return platform.force_lab[[0, 15], 2], notes

    untared, notes = read(0, 0)
    np.testing.assert_allclose(untared, [8, 508])
    assert notes == ()
    np.testing.assert_allclose(read(1, 0)[0], [8, 508])
    zeroed, notes = read(1, 5)
    np.testing.assert_allclose(zeroed, [0, 500], atol=1e-4)
    assert "zeroed" in notes[0]
    plate.channels[0, 2] = -20.0
    np.testing.assert_allclose(read(1, 1)[0], [0, 488], atol=1e-4)
    plate.channels[0, 2] = -8.0
    loaded, notes = read(12, 16)
    np.testing.assert_allclose(loaded, [8, 508])
    assert "not zeroed" in notes[0]


@pytest.mark.parametrize(
    "corners",
    [
        np.zeros((4, 3)),
        np.full((4, 3), np.nan),
        np.array([[1e30, 2.0, 3.0]] * 4),
        np.array([[0.0, 0, 0], [400, 0, 0], [800, 0, 0], [1200, 0, 0]]),
    ],
)
def test_garbage_corners(tmp_path, write_c3d, plate_of, points, corners):
    plate = plate_of(2, np.ones((20, 6)), corners, units=UNITS)
    path = write_c3d(tmp_path / "a.c3d", points, LABELS, plates=[plate])
    platforms, notes = force_platforms(open_c3d(path), 1e-3)
    assert platforms == ()
    assert "plate 1: left out" in notes[0]


def test_declared_channels_that_are_not_there(tmp_path, write_c3d, plate_of, flat_corners, points):
    plates = [plate_of(2, np.ones((20, 6)), flat_corners * 1000, units=UNITS) for _ in range(2)]
    channel = np.array([[1, 7], [2, 8], [3, 9], [4, 10], [5, 11], [6, 13]], float)
    path = write_c3d(tmp_path / "a.c3d", points, LABELS, plates=plates, FORCE_PLATFORM__CHANNEL=channel)
    platforms, notes = force_platforms(open_c3d(path), 1e-3)
    assert [platform.name for platform in platforms] == ["plate 1"]
    assert "plate 2: left out: its analog channels 13 are not in the file" in notes[0]


@pytest.mark.parametrize("kind", [0, 5, 6, 7, 11, 12, 21])
def test_other_types(tmp_path, write_c3d, plate_of, points, kind):
    plates = [plate_of(2, np.ones((20, 6)), units=UNITS), plate_of(kind, np.ones((20, 8)))]
    path = write_c3d(tmp_path / "a.c3d", points, LABELS, plates=plates)
    with pytest.raises(CaptureError, match=f"plate 2: force platforms of type {kind} cannot be read"):
        force_platforms(open_c3d(path), 1e-3)


def test_no_plates_and_no_samples(tmp_path, write_c3d, points):
    assert force_platforms(open_c3d(write_c3d(tmp_path / "a.c3d", points, LABELS)), 1e-3) == ((), ())
    used = write_c3d(tmp_path / "b.c3d", points, LABELS, FORCE_PLATFORM__USED=[2])
    platforms, notes = force_platforms(open_c3d(used), 1e-3)
    assert platforms == ()
    assert "no analog samples" in notes[0]


@pytest.fixture
def load():
    """Force, centre of pressure and free moment in plate axes, z down: (samples, 3), metres and newtons."""
    rng = np.random.default_rng(3)
    force = rng.normal(0, 60, (SAMPLES, 3))
    force[:, 2] = -rng.uniform(300, 900, SAMPLES)
    centre = np.c_[rng.uniform(-1, 1, (SAMPLES, 2)) * HALF_SIDES * 0.9, np.zeros(SAMPLES)]
    free = np.c_[np.zeros((SAMPLES, 2)), rng.normal(0, 5, SAMPLES)]
    return force, centre, free


def signals(kind, channels, *, units=("",) * 8, metres=1e-3, origin=(0, 0, 0), **more):
    return PlatformSignals(
        kind=kind,
        signals=channels,
        units=units,
        scales=np.ones(channels.shape[1]),
        metres=metres,
        origin=np.array(origin, float),
        half_sides=HALF_SIDES,
        **more,
    )


def check(plate, load, notes=0):
    force, centre, free = load
    read_force, read_moment, said = wrench_on_surface(plate)
    np.testing.assert_allclose(read_force, force, atol=1e-9)
    np.testing.assert_allclose(read_moment, np.cross(centre, force) + free, atol=1e-9)
    assert len(said) == notes, said


@pytest.mark.parametrize(
    ("length", "twist", "units"),
    [
        (1000, 1000, ("N", "N", "N", "mm", "mm", "Nmm")),
        (1, 1, ("N", "N", "N", "m", "m", "N.m")),
        (1000, 1000, ("N",) * 6),
    ],
)
def test_type_1_records_centre_and_free_moment(load, length, twist, units):
    force, centre, free = load
    channels = np.c_[force, centre[:, :2] * length, free[:, 2] * twist]
    check(signals(1, channels, units=units), load)


def about_sensors(load):
    """Force and the moment about the sensors' origin: M_origin = r × F + M_surface."""
    force, centre, free = load
    return np.c_[force, np.cross(R_SENSOR_SURFACE + centre, force) + free]


@pytest.mark.parametrize(
    ("unit", "per_newton_metre"), [("Nmm", 1000), ("ntmm", 1000), ("N*m", 1), ("", 1000)]
)
def test_type_2_records_the_moment_about_the_sensors(load, unit, per_newton_metre):
    channels = about_sensors(load) * np.r_[1, 1, 1, np.full(3, per_newton_metre)]
    units = ("N",) * 3 + (unit,) * 3
    check(signals(2, channels, units=units, origin=R_SENSOR_SURFACE), load)


def test_an_origin_with_the_wrong_sign_is_turned_round(load):
    channels = about_sensors(load) * np.r_[1, 1, 1, np.full(3, 1000.0)]
    check(signals(2, channels, units=("Nmm",) * 6, origin=-R_SENSOR_SURFACE), load, notes=1)


@pytest.mark.parametrize(("per_newton_metre", "claimed"), [(1, "Nmm"), (1000, "Nm")])
def test_moments_in_another_unit_than_declared_are_recognized(load, per_newton_metre, claimed):
    channels = about_sensors(load) * np.r_[1, 1, 1, np.full(3, per_newton_metre)]
    check(signals(2, channels, units=(claimed,) * 6, origin=R_SENSOR_SURFACE), load, notes=1)


def test_a_plate_without_moments_keeps_the_declared_unit(load):
    channels = np.c_[load[0], np.zeros((SAMPLES, 3))]
    assert wrench_on_surface(signals(2, channels, units=("Nmm",) * 6, origin=R_SENSOR_SURFACE))[2] == ()


def test_standing_in_the_middle_of_the_plate_is_no_reason_to_doubt_the_unit(load):
    force, centre, free = load
    near = force, centre * 0.02, free
    channels = about_sensors(near) * np.r_[1, 1, 1, np.full(3, 1000.0)]
    check(signals(2, channels, units=("Nmm",) * 6, origin=R_SENSOR_SURFACE), near)


def test_a_doubtful_centre_of_pressure_is_said(load):
    force, centre, free = load
    channels = about_sensors((force, centre + np.array([0.6, 0, 0]), free))
    notes = wrench_on_surface(signals(2, channels, units=("Nm",) * 6, metres=1.0, origin=R_SENSOR_SURFACE))[2]
    assert any("lie on the plate" in note for note in notes)


def test_type_3_sums_up_its_four_sensors():
    """Loads on four sensors at (±a, ±b), below the surface: the wrench is the sum of r × f."""
    rng = np.random.default_rng(5)
    a, b, below = 0.12, 0.2, 0.05
    positions = np.array([[a, b, below], [-a, b, below], [-a, -b, below], [a, -b, below]])
    loads = rng.normal(0, 40, (SAMPLES, 4, 3))
    loads[:, :, 2] = -rng.uniform(50, 300, (SAMPLES, 4))
    (x1, y1, z1), (x2, y2, z2), (x3, y3, z3), (x4, y4, z4) = (loads[:, k].T for k in range(4))
    channels = np.stack([x1 + x2, x3 + x4, y1 + y4, y2 + y3, z1, z2, z3, z4], axis=1)
    for origin in ((a, b, -below), (-a, -b, below), (a, b, below)):
        force, moment, notes = wrench_on_surface(signals(3, channels, origin=origin))
        np.testing.assert_allclose(force, loads.sum(axis=1), atol=1e-9)
        np.testing.assert_allclose(moment, np.cross(positions, loads).sum(axis=1), atol=1e-9)
        assert notes == ()


def test_type_3_without_the_distances_of_its_sensors_says_so():
    channels = np.tile([0.0, 0.0, 0.0, 0.0, -100.0, -150.0, -50.0, -80.0], (SAMPLES, 1))
    force, moment, notes = wrench_on_surface(signals(3, channels))
    np.testing.assert_allclose(force[0], [0, 0, -380])
    assert not moment.any()
    assert any("ORIGIN" in note for note in notes)


def test_type_3_polynomial_shifts_the_centre_of_pressure_and_nothing_else():
    rng = np.random.default_rng(6)
    channels = np.c_[rng.normal(0, 10, (SAMPLES, 4)), -rng.uniform(50, 300, (SAMPLES, 4))]
    polynomial = np.zeros(12)
    polynomial[5], polynomial[8] = 0.1, 1e-6  # dx = 0.1 x and dy = 1e-6 y³, in mm
    plain = signals(3, channels, origin=(0.12, 0.2, -0.05))
    bent = signals(3, channels, origin=(0.12, 0.2, -0.05), cop_polynomial=polynomial)
    force, moment, _ = wrench_on_surface(plain)
    new_force, new_moment, notes = wrench_on_surface(bent)
    x, y = -moment[:, 1] / force[:, 2], moment[:, 0] / force[:, 2]
    new_x, new_y = -new_moment[:, 1] / force[:, 2], new_moment[:, 0] / force[:, 2]
    np.testing.assert_allclose(new_force, force)
    np.testing.assert_allclose(new_moment[:, 2], moment[:, 2])
    np.testing.assert_allclose(new_x, 0.9 * x, atol=1e-12)
    np.testing.assert_allclose(new_y, y - 1e-6 * (y * 1000) ** 3 / 1000, atol=1e-12)
    assert len(notes) == 1


def calibration():
    rng = np.random.default_rng(8)
    return np.diag([1.5, 1.5, 6.0, 700.0, 700.0, 400.0]) + rng.normal(0, 0.01, (6, 6))


def test_type_4_goes_through_its_calibration_matrix(load):
    wrench = about_sensors(load) * np.r_[1, 1, 1, np.full(3, 1000.0)]
    volts = np.linalg.solve(calibration(), wrench.T).T
    plate = signals(4, volts, units=("V",) * 6, origin=R_SENSOR_SURFACE, calibration=calibration())
    check(plate, load)


def test_type_4_whose_scales_hold_the_calibration_is_not_calibrated_twice(load):
    wrench = about_sensors(load) * np.r_[1, 1, 1, np.full(3, 1000.0)]
    plate = signals(4, wrench, units=("V",) * 6, origin=R_SENSOR_SURFACE, calibration=calibration())
    scales = np.diag(calibration()) * 0.03
    scales[3:] *= 1000
    plate = PlatformSignals(**{**plate.__dict__, "scales": scales})
    check(plate, load, notes=1)
