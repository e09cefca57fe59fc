"""Rates and tables, and sections of a page, of which a program replaces its own and nothing else."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.markdown import replaced, table, wilson, write_section

NAMES = ("zoo", "damages", "speed", "speed app", "speed app --page")  # some begin alike
TEXTS = st.text(st.characters(exclude_categories=("Cs",)), max_size=60).filter(
    lambda text: "<!--" not in text
)
PAGE = """# Title

<!-- made by python -m benchmarks.zoo -->

old

<!-- end of benchmarks.zoo -->

By hand.
"""


def test_a_section_is_replaced_between_its_markers():
    assert replaced(PAGE, "zoo", "new\n") == PAGE.replace("old", "new")


def test_a_new_section_comes_to_the_end():
    whole = "<!-- made by python -m benchmarks.damages -->\n\nnew\n\n<!-- end of benchmarks.damages -->\n"
    assert replaced(PAGE, "damages", "new") == f"{PAGE}\n{whole}"
    assert replaced("", "zoo", "old") == PAGE.removeprefix("# Title\n\n").removesuffix("\nBy hand.\n")


def test_a_section_without_an_end_is_not_guessed():
    with pytest.raises(ValueError, match=r"without '<!-- end of benchmarks\.zoo -->'"):
        replaced(PAGE.replace("end of", "the end of"), "zoo", "new")


@given(TEXTS, st.dictionaries(st.sampled_from(NAMES), TEXTS, min_size=1), st.data())
def test_the_same_text_twice_is_the_same_page_and_other_sections_stay(head, sections, data):
    page = head
    for name, text in sections.items():
        page = replaced(page, name, text)
    name, text = data.draw(st.sampled_from(sorted(sections))), data.draw(TEXTS)
    once = replaced(page, name, text)
    assert replaced(once, name, text) == once
    assert replaced(once, name, sections[name]) == page
    for other in set(sections) - {name}:
        assert replaced(once, other, sections[other]) == once


def test_a_page_that_is_not_there_is_made(tmp_path):
    page = tmp_path / "PAGE.md"
    write_section(page, "zoo", "old")
    write_section(page, "zoo", "größer")
    assert page.read_text(encoding="utf-8") == replaced("", "zoo", "größer")


def test_wilsons_interval_against_the_quadratic_it_solves():
    """Its ends are the rates p for which (p̂ − p)² = z² p (1 − p) / n."""
    for hits, count in ((0, 150), (3, 150), (95, 100), (28.5, 30)):
        for end in wilson(hits, count):
            p = hits / count
            assert (p - end) ** 2 == pytest.approx(1.959964**2 * end * (1 - end) / count, abs=1e-12)


def test_two_percent_need_about_a_hundred_and_fifty_clean_recordings_without_an_alarm():
    assert wilson(0, 150)[1] == pytest.approx(0.025, abs=0.001)


def test_a_table_is_markdown():
    assert table(["a", "b"], [[1, "x"]]) == "| a | b |\n|---|---|\n| 1 | x |"
