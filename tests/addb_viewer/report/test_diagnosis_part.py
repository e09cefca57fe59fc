"""The diagnosis on the page."""

from dataclasses import replace

from addb_viewer.report.content import DiagnosisShown
from addb_viewer.report.subject_page import diagnosis_part, gain_bars


def test_the_cause_in_words_and_figures_with_the_residual_before_and_after(report):
    page = diagnosis_part(report)
    assert "Cause 1 of 1: forces shifted in time against the markers" in page
    assert "The forces were recorded &lt;late&gt;." in page
    assert "12 ± 2\u00a0ms" in page
    assert (
        page.index("What is wrong") < page.index("without and with the named causes") < page.index("Cause 1")
    )
    assert "a note of the diagnosis" not in page  # it stands among the report's notes


def test_bars_of_a_common_scale(diagnosis):
    page = gain_bars(diagnosis.gain)
    assert "width:100.0%" in page
    assert f"width:{100 * 12 / 41:.1f}%" in page
    assert "41\u00a0N" in page
    assert "Moment" not in page


def test_a_clean_recording(report, diagnosis):
    clean = replace(diagnosis, verdict="clean", effects=(), gain={})
    page = diagnosis_part(replace(report, diagnosis=DiagnosisShown(clean, "")))
    assert "against what is ordinary" in page
    assert "Nothing wrong was found" in page


def test_no_diagnosis_says_why(report):
    assert diagnosis_part(replace(report, diagnosis=DiagnosisShown(absent="Because."))) == "<p>Because.</p>"


def test_who_decided_about_it(report):
    shown = replace(report.diagnosis, decision="Accepted by <anna>.")
    assert "Accepted by &lt;anna&gt;." in diagnosis_part(replace(report, diagnosis=shown))
