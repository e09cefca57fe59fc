"""Lines of the knock-out's tables, and what recordings have together."""

from benchmarks.agreement_words import apart, figures, together
from benchmarks.fit_agreement import Agreement


def agreement(hip_deg, ankle_deg, off_hip):
    return Agreement(
        angle_rms_deg={"hip": hip_deg, "knee": 1.0, "ankle": 2.0},
        angle_rms_without_offset_deg={"hip": 0.5, "knee": 0.5, "ankle": 0.5},
        anatomical_rms_deg={"hip": 3.0, "knee": 1.0, "ankle": ankle_deg},
        centre_rms_m={"hip": 0.02, "knee": 0.01, "ankle": 0.01},
        off_turning_point_m={"hip": off_hip, "knee": None, "ankle": None},
        markers_used=40,
        marker_rms_m=0.005,
    )


def test_a_line():
    line = figures(agreement(4.0, None, (0.012, 0.034)))
    assert line.split()[:2] == ["40", "0.50"]
    assert "1.2 (3.4)" in line
    assert line.count("–") == 5  # an angle, and two pairs


def test_rms_over_recordings_of_what_is_known():
    both = [agreement(3.0, None, (0.01, 0.03)), agreement(4.0, 2.0, None)]
    line = together(both)
    assert "angles  3.5  1.0  2.0" in line
    assert "by landmarks  3.0  1.0  2.0" in line
    assert "off 1.0 (3.0)" in line


def test_what_no_recording_tells_is_a_dash():
    line = together([agreement(3.0, None, None)])
    assert line.count("–") == 7
    assert apart(agreement(3.0, None, None)).count("–") == 7
