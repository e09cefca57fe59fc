"""A report as plain values."""

import json

import pytest

from addb_viewer.commands.report import pages_written
from addb_viewer.report.overview import Entry


@pytest.fixture
def plain(report, tmp_path):
    entries = [Entry("Zoë", tmp_path / "report.html", report, ""), Entry("Bob", None, None, "cannot be read")]
    return pages_written(entries, tmp_path / "all.html")


def test_a_page_has_its_file_and_what_counts(plain, report, tmp_path):
    page = plain["pages"][0]
    assert (page["subject"], page["file"]) == ("Zoë", str(tmp_path / "report.html"))
    assert (page["verdict"], page["error"]) == ("explained", None)
    (trial,) = page["trials"]
    assert (trial["frames"], trial["usable_frames"]) == (40, 34)
    assert sum(end - start for start, end in trial["usable_ranges"]) == 34
    assert {"foot": "calcn_r", "reason": "notOverForcePlate", "ranges": [[30, 36]]} in trial["left_out"]
    assert trial["hicks"] == vars(report.recording.trials[0].figures.hicks)
    assert plain["overview"] == str(tmp_path / "all.html")


def test_a_subject_without_a_page_says_why(plain):
    assert plain["pages"][1] == {
        "subject": "Bob", "file": None, "error": "cannot be read", "trials": [], "verdict": None
    }  # fmt: skip


def test_nothing_in_it_is_more_than_json(plain):
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert pages_written([], None) == {"pages": [], "overview": None}
