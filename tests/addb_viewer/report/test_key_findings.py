"""The answers at the top."""

from dataclasses import replace

import numpy as np

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.key_findings import bounds_of, frames_sentence, key_findings, reasons
from addb_viewer.trial_view.recorded_subject import recording_of


def test_usable_frames_and_why_the_others_are_not(report):
    assert frames_sentence(report.kept) == "34 of 40 frames are usable (85 %)"
    assert reasons(report.kept) == ["6 frames, right foot: the foot stands where no plate is"]
    page = key_findings(report)
    assert "Usable: frames 0–29 (0.35–0.93\u00a0s) and 36–39 (1.07–1.13\u00a0s)." in page
    assert "the review in this program" in page


def test_reasons_of_several_trials_are_added_up(report):
    assert reasons(report.kept * 2) == ["12 frames, right foot: the foot stands where no plate is"]


def judged_as(report, **hicks):
    """The report with other verdicts."""
    (record,) = report.recording.trials
    figures = replace(record.figures, hicks=replace(record.figures.hicks, **hicks))
    return SubjectReport(replace(report.recording, trials=(replace(record, figures=figures),)))


def test_bounds_that_are_met_and_those_that_are_not(report):
    bounds = bounds_of(judged_as(report, linear=False, angular=True))
    assert bounds.words == "3 of 4 bounds are met"
    force = report.recording.trials[0].figures.linear_residual.rms_N
    assert bounds.beyond == (f"Residual force, RMS, bound 0.05 BW: {force:.1f} N",)
    fine = bounds_of(judged_as(report, **dict.fromkeys(vars(report.recording.trials[0].figures.hicks), True)))
    assert (fine.words, fine.beyond, fine.unknown) == ("All 4 bounds are met", (), ())


def test_the_largest_marker_error_has_a_name_and_a_frame(report):
    errors = report.recording.trials[0].replay.markers.errors
    ((frame,), (marker,)) = np.nonzero(errors == np.nanmax(errors))
    beyond = bounds_of(judged_as(report, marker_max=False)).beyond
    assert any(entry.endswith(f" cm (M{marker}, frame {frame})") for entry in beyond)


def test_a_subject_without_forces(small_fit):
    report = SubjectReport(recording_of(small_fit, trials=["no/forces"]))
    assert frames_sentence(report.kept) == "0 of 4 frames are usable (0 %)"
    assert 'class="card doubt"' in key_findings(report)
    bounds = bounds_of(report)
    assert bounds.words == "All 2 bounds are met"
    assert bounds.unknown == ("Residual force, RMS", "Residual moment, RMS")
    assert "no usable force recording" in key_findings(report)


def test_the_verdict_of_the_diagnosis(report):
    assert "A fault in the recordings, with a named cause" in key_findings(report)
    assert "No diagnosis" in key_findings(replace(report, diagnosis=type(report.diagnosis)()))
