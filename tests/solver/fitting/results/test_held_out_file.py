"""Layouts of held-out forces beside a fit that was written before."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import ResultsError
from solver.common.typed_json import plain
from solver.dynamics.cross_validation.held_out import HeldOutBlocks, HeldOutLayout
from solver.fitting.results.store import add_held_out, default_folder, load_fit, present_solve, save_fit
from solver.fitting.summary import summary
from tests.solver.fitting.results.test_store import assert_same


def layout(number, kind="blocks", trial="walk"):
    rng = np.random.default_rng(number)
    blocks = HeldOutBlocks(
        np.array([[0, 2], [3, 4]]), np.array([2, 1]), rng.random((2, 2)), rng.random((2, 2)), (6.0, 8.0)
    )
    return HeldOutLayout(kind, number, {trial: blocks})


@pytest.fixture
def folder(small_fit):
    folder = default_folder(small_fit.subject.folder)
    save_fit(small_fit, folder)
    return folder


def test_layouts_that_come_later_are_read_with_the_fit(small_fit, folder):
    solve = present_solve(folder)
    assert load_fit(folder, small_fit.subject.folder).held_out_layouts == ()
    fit = small_fit
    for number in range(2):
        fit = replace(fit, held_out_layouts=(*fit.held_out_layouts, layout(number)))
        assert add_held_out(fit, folder, solve)
    back = load_fit(folder, small_fit.subject.folder)
    assert_same(back.held_out_layouts[0].trials["walk"], fit.held_out_layouts[0].trials["walk"])
    assert_same(back.held_out_layouts[1].trials["walk"], fit.held_out_layouts[1].trials["walk"])
    figures = plain(summary(back))["trials"]
    assert figures[0]["held_out_layouts"]["layouts"] == 2
    assert figures[0]["held_out_layouts"]["blocks"]["pieces"] == 4
    assert figures[1]["held_out_layouts"]["blocks"] is None  # a trial without forces


def test_a_fit_written_again_takes_its_layouts_along(small_fit, folder):
    fit = replace(small_fit, held_out_layouts=(layout(0), layout(0, "steps")))
    save_fit(fit, folder)
    back = load_fit(folder, small_fit.subject.folder).held_out_layouts
    assert [(each.kind, each.number) for each in back] == [("blocks", 0), ("steps", 0)]


def test_layouts_of_a_fit_that_was_replaced_meanwhile_are_not_given_to_the_new_one(small_fit, folder):
    solve = present_solve(folder)
    save_fit(small_fit, folder)
    files = sorted(folder.rglob("*"))
    assert not add_held_out(replace(small_fit, held_out_layouts=(layout(0),)), folder, solve)
    assert sorted(folder.rglob("*")) == files


def test_a_file_of_a_later_version_is_left_alone_and_a_broken_one_is_named(small_fit, folder):
    file = folder / present_solve(folder) / "held_out.json"
    file.write_text('{"format": 99, "layouts": "something new"}')
    assert load_fit(folder, small_fit.subject.folder).held_out_layouts == ()
    for broken in ("{", '{"format": 1}', '{"format": 1, "layouts": [3]}', "[]"):
        file.write_text(broken)
        with pytest.raises(ResultsError, match=r"held_out\.json"):
            load_fit(folder, small_fit.subject.folder)
