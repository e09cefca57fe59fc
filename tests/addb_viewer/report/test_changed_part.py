"""What the fit to forces changed, on the report's page."""

from addb_viewer.report.subject_page import subject_page
from addb_viewer.text.change_words import change_sentence


def test_a_report_has_the_sentence_at_the_top_and_the_table_below(report):
    page = subject_page(report)
    told = change_sentence(report.recording.trials[0].figures.change)
    assert "knee" in told
    top, below = page.split('id="recorded"')
    assert "The fit to forces moved the joints by" in top
    assert "What the fit to forces changed in the motion" in below
    assert all(head in below for head in ("Coordinate", "4–6\u00a0Hz", "Peak speed"))
