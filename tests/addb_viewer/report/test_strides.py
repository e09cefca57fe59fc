"""Strides in the report."""

import pytest

from addb_viewer.report.motion_part import strides_part
from solver.capture.subject import open_subject
from solver.pipeline import solve
from solver.settings import Settings


@pytest.mark.real
def test_a_treadmill_walk_has_a_stride_of_the_right_foot(real_data):
    folder = real_data / "walk_gait2354_subject01"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    part = strides_part(solve(open_subject(folder), Settings()))
    assert part is not None
    assert "<h3>Strides</h3>" in part
    assert "<td>right</td><td>1</td>" in part
    assert "m/s" in part
    assert "steps/min" in part


def test_nobody_strides(small_fit):
    assert strides_part(small_fit) is None
