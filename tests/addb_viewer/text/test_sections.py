"""Lines of a page: wrapped, labelled, figures beside their units."""

import pytest

from addb_viewer.text.sections import NO_BREAK, Section, as_text, unbroken


def test_rows_hang_below_their_texts_and_headings_are_loud():
    lines = as_text([Section("Cause 1: a step", ("One line.",), (("when", "now and then"), ("so", "x")))], 20)
    assert lines == ["CAUSE 1: a step", "  One line.", "  when  now and then", "  so    x"]


@pytest.mark.parametrize("width", range(20, 60))
def test_no_line_begins_with_a_unit(width):
    text = "between 11 and 14 N with 95 % certainty, 687 N (22 ×), 32 N·m and 5 mm at 3 s of 12 trials"
    lines = as_text([Section("", (text,))], width)
    assert " ".join(" ".join(lines).split()) == text
    assert not any(line.strip().startswith(("N", "%", "×", "mm")) for line in lines)


def test_words_after_a_figure_may_be_parted_from_it():
    assert unbroken("2 causes, 3 more") == "2 causes, 3 more"
    assert unbroken("2 N, 3 m") == f"2{NO_BREAK}N, 3{NO_BREAK}m"
