"""Many subjects on one page."""

import re

import pytest

from addb_viewer.report.overview import COLUMNS, Entry, overview_page, write_overview

HOSTILE = "<img src=x>"


@pytest.fixture
def entries(report, tmp_path):
    name = "Zoë #1"
    return [
        Entry(name, tmp_path / name / "results" / "report.html", report, ""),
        Entry(HOSTILE, None, None, f"{HOSTILE}: cannot be read"),
    ]


def test_a_row_a_trial_with_a_link_to_its_report(entries, tmp_path):
    page = overview_page("lab", entries, (), tmp_path / "report.html")
    assert 'href="Zo%C3%AB%20%231/results/report.html"' in page
    assert "1 of 2 subjects have a report, with 1 trials. 34 of 40 frames are usable (85\u00a0%)." in page
    assert page.count('<th scope="col" aria-sort="none"><button type="button">') == len(COLUMNS)


def test_what_failed_stands_there_with_its_reason_as_text(entries, tmp_path):
    page = overview_page(HOSTILE, entries, (HOSTILE,), tmp_path / "report.html")
    assert "<img" not in page
    assert "no report: &lt;img src=x&gt;: cannot be read" in page


def test_figures_sort_by_their_share_of_the_bound(entries, report, tmp_path):
    page = overview_page("lab", entries, (), tmp_path / "report.html")
    figures = report.recording.trials[0].figures
    shares = [float(value) for value in re.findall(r'data-value="([^"]+)"', page)]
    assert shares[:2] == [40.0, 0.85]
    assert shares[2] == pytest.approx(figures.force_BW / 0.05, rel=1e-5)
    assert shares[4] == pytest.approx(figures.marker_rms_m / 0.02, rel=1e-5)


def test_it_is_written_whole(entries, tmp_path):
    file = write_overview("lab", entries, (), tmp_path / "report.html")
    assert file.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert [path.name for path in tmp_path.glob("*report*")] == ["report.html"]
