"""Two names never give one file."""

from hypothesis import given
from hypothesis import strategies as st

from solver.capture.file_names import LONGEST_BYTES, distinct
from solver.export.places import file_stem


def test_names_that_look_alike_get_numbers_and_a_plain_one_keeps_its_own():
    names = ["walk(1)", "walk[1]", "walk_1_", "Walk 1 ", "Müller", "Möller", "run"]
    assert distinct(names, file_stem) == {
        "walk(1)": "walk_1_-2",
        "walk[1]": "walk_1_-3",
        "walk_1_": "walk_1_",
        "Walk 1 ": "Walk_1_-4",
        "Müller": "M_ller",
        "Möller": "M_ller-2",
        "run": "run",
    }


@given(st.lists(st.text(min_size=1), unique=True))
def test_no_two_stems_are_one_file_even_where_capitals_do_not_count(names):
    stems = distinct(names, file_stem)
    assert list(stems) == names
    assert len({stem.casefold() for stem in stems.values()}) == len(names)
    assert all(len(stem.encode()) <= LONGEST_BYTES for stem in stems.values())
