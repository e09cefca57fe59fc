"""Whatever comes from files is text."""

import html
import json
import re

from addb_viewer.report.markup import Safe, bar, data_script, element, pairs, swatch, table, text, told
from addb_viewer.text.sections import Section
from addb_viewer.trial_view.palette import GREEN

HOSTILE = "</script><img src=x onerror='alert(1)'>&\"`rm`"


def test_text_is_escaped_and_what_was_made_here_is_not():
    assert "<img" not in text(HOSTILE)
    assert html.unescape(re.sub("</?code>", "`", text(HOSTILE))) == HOSTILE
    assert text(Safe("<b>")) == "<b>"


def test_figures_stay_with_their_units_and_commands_stand_out():
    assert text("12 N, see `addb-viewer fit`") == "12\u00a0N, see <code>addb-viewer fit</code>"


def test_attributes_and_cells_are_escaped_too():
    assert "<img" not in element("p", HOSTILE, title=HOSTILE, data_x=HOSTILE)
    assert element("p", "a", class_="b", data_x="c") == '<p class="b" data-x="c">a</p>'
    assert "<img" not in table((HOSTILE,), [(HOSTILE, HOSTILE)])
    assert "<img" not in pairs([(HOSTILE, HOSTILE)])
    assert "<img" not in told(Section(HOSTILE, (HOSTILE,), (("when", HOSTILE),)))


def test_entries_and_commands_get_a_line_each():
    rows = (("when", "walk, 1; run, 2"), ("what to do", "Look. To flag: a 1. To flag: a 2."))
    page = told(Section("Cause", rows=rows))
    assert "walk, 1<br>run, 2" in page
    assert "Look.<br>To flag: a 1.<br>To flag: a 2." in page


def test_plain_values_for_a_script_cannot_end_its_element():
    script = data_script("it", {HOSTILE: [1.5, None]})
    inside = script.removeprefix('<script type="application/json" id="it">').removesuffix("</script>")
    assert not set("<>&") & set(inside)
    assert json.loads(inside) == {HOSTILE: [1.5, None]}


def test_bars_stay_in_their_room():
    assert "width:100.0%" in bar(5.3)
    assert "width:0.0%" in bar(-1.0)
    assert GREEN.css in swatch(GREEN)
