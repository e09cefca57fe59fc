"""Force plates that Cortex wrote beside a TRC: which column is what, and where the moment belongs."""

import numpy as np
import pytest

from solver.capture.formats.cortex_forces import read_cortex_forces
from solver.capture.formats.recording_files import read_forces
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import CaptureError

NAMES = "#Sample\tFX1\tFY1\tFZ1\tX1\tY1\tZ1\tMZ1\tFX2\tFY2\tFZ2\tX2\tY2\tZ2\tMZ2"
ROWS = (
    "1\t0\t0\t0\t300\t0\t200\t0\t-20\t700\t5\t910\t0\t-210\t-1500",
    "2" + "\t0" * 7 + "\t-21\t710" + "\t0" * 5,
)
HEAD = "[Force Data]\nNumberOfForcePlates=2\nSampleRate=450.0\nNumberOfSamples=2"


@pytest.fixture
def written(tmp_path):
    def write(head=HEAD, names=NAMES, rows=ROWS):
        path = tmp_path / "Walk.forces"
        path.write_text("\n".join([head, names, *rows, ""]))
        return path

    return write


def test_plates_in_newtons_metres_and_newton_metres(written):
    table = read_forces(written())
    assert [plate.name for plate in table.plates] == ["plate 1", "plate 2"]
    force, point, moment = (table.values[:, part] for part in ([9, 10, 11], [12, 13, 14], [15, 16, 17]))
    assert (table.plates[1].force, table.plates[1].point, table.plates[1].moment) == (
        (9, 10, 11),
        (12, 13, 14),
        (15, 16, 17),
    )
    np.testing.assert_allclose(force[0], [-20, 700, 5])
    np.testing.assert_allclose(point[0], [0.91, 0, -0.21])
    np.testing.assert_allclose(moment[0], [0, -1.5, 0])
    np.testing.assert_allclose(table.times, [0, 1 / 450])
    assert table.rate == 450


def test_the_moment_is_about_whichever_axis_points_up(written):
    table = read_cortex_forces(written(rows=["1" + "\t0" * 7 + "\t-20\t5\t700\t910\t210\t0\t-1500"]))
    np.testing.assert_allclose(table.values[0, 15:], [0, 0, -1.5])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"head": "[Force Data]"}, "SampleRate"),
        ({"rows": ()}, "no row of data"),
        ({"names": NAMES.replace("MZ2", "M2")}, "MZ2"),
        ({"names": "#Sample\tF1"}, "FX1"),
    ],
)
def test_what_is_missing_is_said(written, changed, message):
    with pytest.raises(CaptureError, match=message):
        read_cortex_forces(written(**changed))


def test_they_are_the_forces_of_the_markers_of_their_name(written):
    forces = written()
    keys = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits"
    rows = "1\t0\t1\t900\t1\n2\t0.01\t2\t900\t1\n"
    forces.with_name("walk.trc").write_text(f"{keys}\n100\t100\t2\t1\tmm\nFrame#\tTime\tLASI\t\t\n\n{rows}")
    (trial,) = open_subject(forces.parent).trials
    assert trial.forces == forces
