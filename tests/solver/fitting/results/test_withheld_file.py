"""Layouts of withheld forces beside a fit that was written before."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import ResultsError
from solver.dynamics.cross_validation.heldout import WithheldBlocks, WithheldLayout
from solver.fitting.results.store import add_withheld, default_folder, load_fit, present_solve, save_fit
from solver.fitting.summary import summary
from tests.solver.fitting.results.test_store import assert_same


def layout(number, kind="blocks", trial="walk"):
    rng = np.random.default_rng(number)
    blocks = WithheldBlocks(
        np.array([[0, 2], [3, 4]]), np.array([2, 1]), rng.random((2, 2)), rng.random((2, 2)), (6.0, 8.0)
    )
    return WithheldLayout(kind, number, {trial: blocks})


@pytest.fixture
def folder(small_fit):
    folder = default_folder(small_fit.subject.folder)
    save_fit(small_fit, folder)
    return folder


def test_layouts_that_come_later_are_read_with_the_fit(small_fit, folder):
    solve = present_solve(folder)
    assert load_fit(folder, small_fit.subject.folder).withheld == ()
    fit = small_fit
    for number in range(2):
        fit = replace(fit, withheld=(*fit.withheld, layout(number)))
        assert add_withheld(fit, folder, solve)
    back = load_fit(folder, small_fit.subject.folder)
    assert_same(back.withheld[0].trials["walk"], fit.withheld[0].trials["walk"])
    assert_same(back.withheld[1].trials["walk"], fit.withheld[1].trials["walk"])
    figures = summary(back)["trials"]
    assert figures[0]["withheld"]["layouts"] == 2
    assert figures[0]["withheld"]["blocks"]["pieces"] == 4
    assert figures[1]["withheld"]["blocks"] is None  # a trial without forces


def test_a_fit_written_again_takes_its_layouts_along(small_fit, folder):
    fit = replace(small_fit, withheld=(layout(0), layout(0, "steps")))
    save_fit(fit, folder)
    back = load_fit(folder, small_fit.subject.folder).withheld
    assert [(each.kind, each.number) for each in back] == [("blocks", 0), ("steps", 0)]


def test_layouts_of_a_fit_that_was_replaced_meanwhile_are_not_given_to_the_new_one(small_fit, folder):
    solve = present_solve(folder)
    save_fit(small_fit, folder)
    files = sorted(folder.rglob("*"))
    assert not add_withheld(replace(small_fit, withheld=(layout(0),)), folder, solve)
    assert sorted(folder.rglob("*")) == files


def test_a_file_of_a_later_version_is_left_alone_and_a_broken_one_is_named(small_fit, folder):
    file = folder / present_solve(folder) / "withheld.json"
    file.write_text('{"format": 99, "layouts": "something new"}')
    assert load_fit(folder, small_fit.subject.folder).withheld == ()
    for broken in ("{", '{"format": 1}', '{"format": 1, "layouts": [3]}', "[]"):
        file.write_text(broken)
        with pytest.raises(ResultsError, match=r"withheld\.json"):
            load_fit(folder, small_fit.subject.folder)
