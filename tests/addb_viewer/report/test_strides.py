"""Strides, and joints over them, in the report."""

import re

import pytest

from addb_viewer.report.joints_part import joints_part
from addb_viewer.report.motion_part import strides_part
from solver.export.gait_tables import gaits_of
from solver.fitting.summary import summary
from tests.addb_viewer.fit_figures import of_trial


@pytest.mark.real
def test_a_treadmill_walk_has_a_stride_of_the_right_foot(recorded_fit):
    fit = recorded_fit("walk_gait2354_subject01")
    gaits = gaits_of(fit)
    part = strides_part(gaits)
    assert part is not None
    assert "<h3>Strides</h3>" in part
    assert "<td>right</td><td>1</td>" in part
    assert "m/s" in part
    assert "steps/min" in part
    figures = {trial.name: trial for trial in summary(fit).trials}
    joints = joints_part(fit, gaits, figures)
    assert re.findall(r"<figcaption><b>([^<]*)</b> ([^<]*)", joints) == [
        (f"{motion} {kind}", f"[{unit}]")
        for motion in ("Hip flexion", "Hip adduction", "Knee extension", "Ankle dorsiflexion")
        for kind, unit in (("angle", "°"), ("torque", "N·m"), ("power", "W"))
    ]
    assert "right, 1 stride" in joints  # in this model the knee's angle is negative where it is flexed
    assert not re.search(r"nan|_[rl]\b", joints)
    told = joints.replace("\xa0", " ")
    assert re.search(r"Torques ± \d+ N·m at the hip, ± \d+ N·m at the knee, ± \d+ N·m at the ankle \(", told)
    assert joints_part(fit, gaits, {}) is None


def test_nobody_strides(small_fit):
    assert strides_part(gaits_of(small_fit)) is None
    assert joints_part(small_fit, gaits_of(small_fit), {"walk": of_trial()}) is None
