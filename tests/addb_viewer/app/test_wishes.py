import pytest

from addb_viewer.app.shell.go_to import GoTo, OpenRow, Select, wish


@pytest.mark.parametrize(
    ("text", "meant"),
    [("57", GoTo(57)), (" 0 ", GoTo(0)), ("120:180", Select(120, 180)), ("#3", OpenRow(3))],
)
def test_whole_wishes(text, meant):
    assert wish(text) == meant


@pytest.mark.parametrize(
    "text", ["", "12:", ":12", "20:10", "5:5", "-3", "1.5", "#", "x", "9" * 40, "１２:<b>"]
)
def test_what_is_not_or_not_yet_a_wish_is_none(text):
    assert wish(text) is None
