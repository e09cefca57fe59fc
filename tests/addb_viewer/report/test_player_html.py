"""The player's place on the page."""

import re
from importlib.resources import files

from addb_viewer.report.subject_page import player_html


def test_everything_that_the_script_looks_for_is_there():
    script = files("addb_viewer.report").joinpath("player.js").read_text(encoding="utf-8")
    page = player_html(["walk"], 7)
    wanted = set(re.findall(r'find\("(\w+)"\)', script))
    assert wanted == set(re.findall(r'data-role="(\w+)"', page))
    assert 'data-frame="7"' in page


def test_trials_can_be_chosen_where_there_are_several():
    assert "hidden" in player_html(["walk"], 0)
    page = player_html(["walk", "<run>"], 0)
    assert "hidden" not in page.replace('aria-hidden="true"', "")
    assert '<option value="1">&lt;run&gt;</option>' in page
