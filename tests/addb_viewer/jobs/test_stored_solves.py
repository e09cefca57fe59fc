"""Solves on the disk: only whole ones are shown, and keeping one loses none."""

import json
import os
import shutil
import time
from dataclasses import replace
from pathlib import Path

import pytest

from addb_viewer.jobs.stored_solves import (
    ABANDONED_S,
    DISCARDED,
    KEPT,
    MADE,
    MOST,
    NEW,
    REPLACED,
    discard,
    finish,
    keep,
    new_folder,
    prune,
    stored_solves,
)
from solver.common.errors import ResultsError
from solver.fitting.results.store import load_fit, save_fit


@pytest.fixture
def results(small_fit):
    folder = small_fit.subject.folder / "results"
    save_fit(small_fit, folder)
    return folder


@pytest.fixture
def solved(small_fit, results):
    def made(mass_kg):
        folder = new_folder(results)
        save_fit(replace(small_fit, mass_kg=mass_kg), folder)
        finish(folder, by="Zoë", seconds=3.5)
        return stored_solves(results)[-1]

    return made


def mass(results):
    return json.loads((results / "fit.json").read_text())["subject"]["mass_kg"]


def test_a_new_solve_leaves_the_kept_fit_alone(results, solved):
    new = solved(90.0)
    assert (new.by, new.state, new.seconds) == ("Zoë", NEW, 3.5)
    assert mass(results) == 100.0
    assert new.figures.subject.mass_kg == 90.0


def test_half_a_solve_is_not_shown(results, small_fit):
    save_fit(small_fit, new_folder(results))  # killed before it was finished
    (new_folder(results) / MADE).write_text('{"by": "Zoë", "when": "2026-')
    new_folder(results)
    assert stored_solves(results) == ()
    assert new_folder(results).name == "4"


def test_what_killed_programs_left_goes_but_neither_whole_solves_nor_one_being_written(
    results, solved, small_fit
):
    whole, half, new = solved(90.0).folder, new_folder(results), new_folder(results)
    save_fit(small_fit, half)
    save_fit(small_fit, new)
    long_ago = time.time() - 2 * ABANDONED_S
    for folder in (whole, half):
        for path in (folder, *folder.rglob("*")):
            os.utime(path, (long_ago, long_ago))
    prune(results)
    assert [whole.exists(), half.exists(), new.exists()] == [True, False, True]


def test_keeping_replaces_the_fit_and_puts_the_one_before_aside(results, solved, small_fit):
    keep(solved(90.0), results, small_fit.subject.folder)
    assert mass(results) == 90.0
    assert [(s.state, s.figures.subject.mass_kg) for s in stored_solves(results)] == [
        (KEPT, 90.0),
        (REPLACED, 100.0),
    ]
    keep(solved(80.0), results, small_fit.subject.folder)
    assert [(s.state, s.figures.subject.mass_kg) for s in stored_solves(results)] == [
        (REPLACED, 90.0),
        (REPLACED, 100.0),
        (KEPT, 80.0),
    ]
    assert load_fit(results, small_fit.subject.folder).mass_kg == 80.0
    assert load_fit(stored_solves(results)[0].folder, small_fit.subject.folder).mass_kg == 90.0


def test_discarding_keeps_the_fit_and_the_history(results, solved):
    discard(solved(90.0))
    assert mass(results) == 100.0
    assert [s.state for s in stored_solves(results)] == [DISCARDED]


def test_the_oldest_are_forgotten_but_never_the_kept_one(results, solved, small_fit):
    for k in range(MOST + 3):
        discard(solved(50.0 + k))
    kept = keep(solved(90.0), results, small_fit.subject.folder)
    left = stored_solves(results)
    assert len(left) <= MOST + 1  # the fit that was put aside comes on top
    assert kept.number in [s.number for s in left]


def test_a_solve_whose_removal_is_interrupted_is_not_shown(results, solved, small_fit, monkeypatch):
    for k in range(MOST + 1):
        last = solved(50.0 + k)
    removed = shutil.rmtree

    def killed(folder, **options):
        if Path(folder).parent.name == "solves":
            raise OSError("power off")
        removed(folder, **options)

    monkeypatch.setattr(shutil, "rmtree", killed)
    oldest = stored_solves(results)[0]
    keep(last, results, small_fit.subject.folder)
    assert oldest.folder.exists()
    assert oldest.number not in [solve.number for solve in stored_solves(results)]


def test_a_torn_solve_is_refused_and_the_fit_stays(results, solved, small_fit):
    new = solved(90.0)
    next(new.folder.glob("solve-*/skeleton.json")).write_text("{")
    with pytest.raises(ResultsError):
        keep(new, results, small_fit.subject.folder)
    assert mass(results) == 100.0
