"""Sections of a page: a program replaces its own and nothing else."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.sections import replaced, write_section

NAMES = ("zoo", "damages", "diagnosis", "diagnosis_speed", "diagnosis score --page")  # some begin alike
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
