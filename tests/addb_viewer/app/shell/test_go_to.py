import pytest

from addb_viewer.app.shell.actions import GoTo, OpenRow, Select, entry


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("57", GoTo(57)),
        (" 0 ", GoTo(0)),
        ("#3", OpenRow(3)),
        *((typed, Select(120, 180)) for typed in ("120:180", "120–179", "120-179", "120 - 179")),
    ],
)
def test_what_is_written_whole_is_understood(text, meant):
    assert entry(text) == meant


@pytest.mark.parametrize(
    "text", ["", "12:", ":12", "20:10", "5:5", "-3", "1.5", "#", "x", "9" * 40, "１２:<b>"]
)
def test_what_is_not_or_not_yet_whole_is_none(text):
    assert entry(text) is None
