"""Joint centres of fits, judged by raw markers."""

import pytest

from benchmarks.labels_of_fit import raw_columns, understood_labels
from benchmarks.marker_knockout import agreement, markers_alone
from solver.capture.subject.subject import open_subject
from solver.fitting.pipeline import solve


@pytest.mark.slow
@pytest.mark.real
def test_the_model_of_a_recording_made_with_it_is_right(real_data):
    """Also at the knee, which glides; no marker is on the feet."""
    found = agreement(open_subject(real_data / "synthetic_arnold2013_subject01"), "trial").off_turning_point_m
    for joint in ("hip", "knee"):
        alone, with_model = found[joint]
        assert with_model < 0.001 < alone
    assert found["ankle"] is None


@pytest.mark.real
def test_computed_joint_centres_are_no_raw_markers(real_data):
    subject = open_subject(real_data / "opencap_subject4")
    fit = solve(subject, markers_alone(), trials=["walking1"])
    names = fit.trials[0].capture.markers.names
    on_thigh = {names[c] for c in raw_columns(fit, understood_labels(fit))["femur_r"]}
    assert {"r_knee", "r_thigh1"} <= on_thigh
    assert "R_HJC" in names
    assert "R_HJC" not in on_thigh
