"""`fit` after its summary: the other layouts of held-out forces."""

import json
from dataclasses import replace

import pytest

from addb_viewer.jobs import solving
from solver.dynamics.cross_validation.held_out_layouts import LAYOUTS
from solver.fitting.results.store import default_folder, load_fit, save_fit
from tests.solver.fitting.results.test_held_out_file import layout


@pytest.fixture
def judging(command_line, monkeypatch):
    """Layouts come one after the other; `stops_at` is the number of the one before which somebody stops."""

    class Judging:
        stops_at = None
        before_each = staticmethod(lambda: None)

    def due(fit):
        return LAYOUTS[len(fit.held_out_layouts) :]

    def completing(fit, _, progress, *, extension, came):
        for k, (kind, number) in enumerate(due(fit)):
            if Judging.stops_at == len(fit.held_out_layouts) + k:
                raise KeyboardInterrupt
            Judging.before_each()
            progress("dynamics", 0.5)
            came(layout(number, kind))
        return fit

    monkeypatch.setattr(solving, "layouts_due", due)
    monkeypatch.setattr(solving, "complete_held_out", completing)
    return Judging


def kept(command_line):
    return load_fit(default_folder(command_line.subject.folder), command_line.subject.folder)


def test_all_layouts_follow_the_summary_and_are_kept_and_printed(command_line, judging, tmp_path):
    run = command_line("fit", command_line.subject.folder, "--json", tmp_path / "figures.json")
    assert run.exit_code == 0
    assert run.stdout.index("written:") < run.stdout.index("held out in 6 layouts")
    assert len(kept(command_line).held_out_layouts) == len(LAYOUTS)
    figures = json.loads((tmp_path / "figures.json").read_text(encoding="utf-8"))
    assert figures["trials"][0]["held_out_layouts"]["layouts"] == len(LAYOUTS)


def test_quick_ends_without_them_and_a_later_fit_solves_nothing_and_makes_them(command_line, judging):
    run = command_line("fit", command_line.subject.folder, "--quick")
    assert "held out in" not in run.stdout
    assert kept(command_line).held_out_layouts == ()
    run = command_line("fit", command_line.subject.folder)
    assert "unchanged" in run.stdout
    assert "held out in 6 layouts" in run.stdout
    assert len(command_line.solves) == 1
    assert len(kept(command_line).held_out_layouts) == len(LAYOUTS)


def test_ctrl_c_keeps_the_fit_and_the_layouts_that_came_and_the_next_fit_goes_on(command_line, judging):
    judging.stops_at = 4
    run = command_line("fit", command_line.subject.folder)
    assert run.exit_code == 130
    assert "the fit is kept. held-out forces: 4 of 9 layouts are evaluated so far" in run.stderr
    assert "held out in 4 layouts" in run.stdout
    assert len(kept(command_line).held_out_layouts) == 4
    judging.stops_at, came = None, []
    judging.before_each = staticmethod(lambda: came.append(1))
    assert command_line("fit", command_line.subject.folder).exit_code == 0
    assert len(came) == len(LAYOUTS) - 4
    assert len(kept(command_line).held_out_layouts) == len(LAYOUTS)


def test_another_fit_in_its_place_ends_the_judging(command_line, judging):
    folder = command_line.subject.folder

    def somebody_fits():
        save_fit(replace(kept(command_line), held_out_layouts=()), default_folder(folder))

    judging.before_each = staticmethod(somebody_fits)
    run = command_line("fit", folder)
    assert run.exit_code == 0
    assert "another fit has taken the place" in run.stdout
    assert kept(command_line).held_out_layouts == ()
