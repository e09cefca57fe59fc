"""What a report is made of."""

from addb_viewer.report.content import SubjectReport
from addb_viewer.trial_view.recorded_subject import recording_of


def test_the_frames_of_each_trial(small_fit):
    report = SubjectReport(recording_of(small_fit))
    assert [(kept.count, kept.frames) for kept in report.kept] == [(3, 4), (0, 4)]
    assert report.diagnosis.figures is None
    assert "--diagnose" in report.diagnosis.absent
