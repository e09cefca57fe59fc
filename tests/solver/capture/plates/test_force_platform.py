import numpy as np
import pytest

from solver.capture.formats.c3d_contents import open_c3d
from solver.capture.plates.force_platform import force_platforms, plate_axes
from solver.common.errors import CaptureError

LABELS = ("A", "B")
UNITS = ("N",) * 3 + ("Nmm",) * 3


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
    plates = [
        plate_of(2, np.ones((20, 6)), units=UNITS),
        plate_of(kind, np.ones((20, 8))),
    ]
    path = write_c3d(tmp_path / "a.c3d", points, LABELS, plates=plates)
    with pytest.raises(CaptureError, match=f"plate 2: force platforms of type {kind} cannot be read"):
        force_platforms(open_c3d(path), 1e-3)


def test_no_plates_and_no_samples(tmp_path, write_c3d, points):
    assert force_platforms(open_c3d(write_c3d(tmp_path / "a.c3d", points, LABELS)), 1e-3) == ((), ())
    used = write_c3d(tmp_path / "b.c3d", points, LABELS, FORCE_PLATFORM__USED=[2])
    platforms, notes = force_platforms(open_c3d(used), 1e-3)
    assert platforms == ()
    assert "no analog samples" in notes[0]
