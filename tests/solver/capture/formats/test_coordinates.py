"""Coordinates in degrees or radians."""

import numpy as np
import pytest

from solver.capture.formats.coordinates import coordinates_from_storage, write_coordinates
from solver.capture.formats.storage import read_storage, write_storage

NAMES = ("pelvis_tilt", "pelvis_rotation", "pelvis_tx", "knee_angle_r", "knee_angle_r_beta")
ROTATIONAL = {"pelvis_tilt", "pelvis_rotation", "knee_angle_r"}
TIMES = np.arange(101) / 100


def gait():
    """Walking a loop: the heading turns by more than a whole turn, in radians."""
    knee = 0.5 + 0.5 * np.sin(8 * TIMES)
    return np.column_stack([0.1 * np.cos(9 * TIMES), 8 * TIMES, 1.2 * TIMES, knee, knee])


@pytest.mark.parametrize("in_degrees", [True, False])
def test_what_is_written_reads_back_in_radians(tmp_path, in_degrees):
    path = tmp_path / "ik.mot"
    write_coordinates(path, NAMES, TIMES, gait(), rotational=ROTATIONAL, in_degrees=in_degrees)
    storage = read_storage(path)
    assert storage.in_degrees is in_degrees
    if in_degrees:
        np.testing.assert_allclose(storage.column("knee_angle_r"), gait()[:, 3] * 57.29577951308232)
        np.testing.assert_allclose(storage.column("knee_angle_r_beta"), gait()[:, 4])
    coordinates = coordinates_from_storage(storage, ROTATIONAL)
    assert coordinates.names == NAMES
    assert coordinates.notes == ()
    np.testing.assert_allclose(coordinates.values, gait(), atol=1e-9)


@pytest.mark.parametrize(("scale", "unit"), [(180 / np.pi, "degrees"), (1, "radians")])
def test_without_the_header_key_the_data_decide_and_the_notes_say_so(tmp_path, scale, unit):
    path = tmp_path / "ik.mot"
    values = gait() * [scale, scale, 1, scale, 1]
    write_storage(path, NAMES, TIMES, values)
    path.write_text("\n".join(line for line in path.read_text().splitlines() if "inDegrees" not in line))
    coordinates = coordinates_from_storage(read_storage(path), ROTATIONAL)
    np.testing.assert_allclose(coordinates.values, gait(), atol=1e-9)
    assert f"{unit} assumed" in coordinates.notes[-1]


@pytest.mark.real
def test_beta_is_in_radians_in_opensims_files_in_degrees(real_data):
    storage = read_storage(real_data / "opencap_subject6" / "reference" / "walking1_expert_ik.mot")
    knees = coordinates_from_storage(storage, {"knee_angle_r"})
    columns = [knees.names.index(name) for name in ("knee_angle_r", "knee_angle_r_beta")]
    np.testing.assert_allclose(knees.values[:, columns[0]], knees.values[:, columns[1]], atol=1e-6)


@pytest.mark.real
def test_a_real_file_without_the_key_is_in_radians(real_data):
    storage = read_storage(real_data / "synthetic_arnold2013_subject01" / "coordinates.sto")
    angles = {name for name in storage.labels if not name.endswith(("_tx", "_ty", "_tz"))}
    coordinates = coordinates_from_storage(storage, angles)
    np.testing.assert_array_equal(coordinates.values, storage.values)
    assert "radians assumed" in coordinates.notes[-1]
