"""The solves of a subject that the app has made: each in a folder of its own until somebody keeps one.

    results/solves/3/fit.json, solve-1/   as `solver.fitting.results.store` writes a fit
    results/solves/3/made.json            who asked for it, when, what became of it; written last

A solve without made.json was never finished: it is not shown. Keeping one puts a copy of it in the place of
the subject's fit, in one step, and the fit that was there among the solves. No other program changes the
results folder meanwhile, and nothing that another one may be writing is removed.
"""

import contextlib
import os
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from solver.capture.atomic import made_folder
from solver.common.errors import ResultsError
from solver.common.small_files import json_content
from solver.fitting.fit_result import Fit
from solver.fitting.fit_summary import FitSummary, read_summary
from solver.fitting.results.named import named_in
from solver.fitting.results.store import has_fit, load_fit, save_fit, write_json
from solver.fitting.results.writing import writing

FOLDER, MADE = "solves", "made.json"
ABANDONED_S = 600.0  # unfinished for so long: writing one takes seconds, on a slow share perhaps a minute
MOST = 8  # solves on the disk; the oldest go first
NEW, KEPT, DISCARDED, REPLACED = "new", "kept", "discarded", "replaced"


@dataclass(frozen=True)
class Solve:
    """One solve on the disk."""

    number: int
    folder: Path
    by: str
    when: datetime  # UTC
    seconds: float | None  # that it took; None where the app did not make it
    state: str  # NEW, KEPT, DISCARDED or REPLACED
    figures: FitSummary
    decided_by: str | None = None  # who kept or discarded it


def stored_solves(results: Path) -> tuple[Solve, ...]:
    """The finished ones, oldest first; what cannot be read is left out."""
    found = []
    for number in _numbers(results):
        folder = results / FOLDER / str(number)
        try:
            made = json_content(folder / MADE)
            figures = read_summary(folder / "fit.json")
            when = datetime.fromisoformat(made["when"])
            solve = Solve(
                number,
                folder,
                made["by"],
                when,
                made["seconds"],
                made["state"],
                figures,
                made.get("decided_by"),
            )
        except (OSError, ValueError, KeyError, TypeError, ResultsError):
            continue
        found.append(solve)
    return tuple(found)


def waiting_solves(made: Sequence[Solve]) -> tuple[Solve, ...]:
    """Those that nobody has decided about, oldest first; of one person's only the last.

    Args:
        made: oldest first.
    """
    last = {solve.by: solve for solve in made if solve.state == NEW}
    return tuple(solve for solve in made if last.get(solve.by) is solve)


def add(fit: Fit, results: Path, *, by: str, seconds: float) -> int:
    """Put a new fit among the solves, whole or not at all; the subject's fit stays as it is.

    Args:
        fit: solved.
        results: folder of the subject's fit.
        by: who asked for it.
        seconds: that it took.

    Returns:
        Its number.
    """
    folder = new_folder(results)
    try:
        save_fit(fit, folder)
        finish(folder, by=by, seconds=seconds)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return int(folder.name)


def new_folder(results: Path) -> Path:
    """An empty folder for the next solve."""
    place = made_folder(results / FOLDER)
    number = max(_numbers(results), default=0) + 1
    while True:  # another program may take the number
        try:
            (place / str(number)).mkdir()
        except FileExistsError:
            number += 1
        else:
            return place / str(number)


def finish(
    folder: Path,
    *,
    by: str,
    seconds: float | None,
    state: str = NEW,
    when: datetime | None = None,
    decided_by: str | None = None,
) -> None:
    """Say that the fit in a solve's folder is whole; members as of `Solve`, `when` is now by default."""
    told = {"by": by, "when": (when or datetime.now(UTC)).isoformat(), "seconds": seconds, "state": state}
    write_json(folder / MADE, {**told, "decided_by": decided_by})


def keep(solve: Solve, results: Path, subject_folder: Path, by: str | None = None) -> Solve:
    """Make a solve the subject's fit; the one before is put among the solves.

    Args:
        solve: which.
        results: folder of the subject's fit.
        subject_folder: of the recordings.
        by: who decided so; None: nobody was asked.

    Raises:
        ResultsError: the solve cannot be read, or the results folder cannot be written to.
    """
    fit = load_fit(solve.folder, subject_folder)
    with writing(results):
        put_aside(results)
        save_fit(fit, results)
        kept = _marked(solve, KEPT, by)
        _forget_old(results, solve.number)
    return kept


def discard(solve: Solve, by: str | None = None) -> Solve:
    """Leave the subject's fit as it is; the solve stays in the history.

    Args:
        solve: which.
        by: who decided so; None: a newer one of the same person took its place.
    """
    return _marked(solve, DISCARDED, by)


def put_aside(results: Path) -> Path | None:
    """Put the subject's fit among the solves, before another one takes its place.

    One that lies there already only changes its state.

    Returns:
        Where it lies now; None where there is no fit.

    Raises:
        ResultsError: it cannot be copied.
    """
    with writing(results):
        return _put_aside(results) if has_fit(results) else None


def prune(results: Path) -> None:
    """Remove what killed programs have left half written; what cannot be removed stays, unseen."""
    for number in _numbers(results):
        folder = results / FOLDER / str(number)
        with contextlib.suppress(OSError):  # somebody else removes it just now
            age_s = time.time() - max(path.stat().st_mtime for path in (folder, *folder.rglob("*")))
            if not (folder / MADE).exists() and age_s > ABANDONED_S:
                shutil.rmtree(folder, ignore_errors=True)


def _marked(solve: Solve, state: str, by: str | None = None) -> Solve:
    decided_by = by or solve.decided_by
    finish(
        solve.folder, by=solve.by, seconds=solve.seconds, state=state, when=solve.when, decided_by=decided_by
    )
    return replace(solve, state=state, decided_by=decided_by)


def _put_aside(results: Path) -> Path:
    head = json_content(results / "fit.json")
    kept = [solve for solve in stored_solves(results) if solve.state == KEPT]
    for solve in kept:
        _marked(solve, REPLACED)
    if kept and _same_fit(json_content(kept[-1].folder / "fit.json"), head):
        return kept[-1].folder
    when = datetime.fromtimestamp((results / "fit.json").stat().st_mtime, UTC)
    folder = new_folder(results)
    try:
        present = named_in(results, head["solve"], results / "fit.json")
        shutil.copytree(present, folder / present.name)
        shutil.copy2(results / "fit.json", folder / "fit.json")
    except ResultsError:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    except OSError as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise ResultsError(f"{results}: the present fit cannot be put aside ({error}).") from error
    finish(folder, by="before this app", seconds=None, state=REPLACED, when=when)
    return folder


def _same_fit(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two `fit.json` are of one fit; else another program has replaced the one that was kept here."""
    place = {"solve": None, "files": None}
    return {**one, **place} == {**other, **place}


def _forget_old(results: Path, but: int) -> None:
    numbers = [solve.number for solve in stored_solves(results) if solve.number != but]
    for number in numbers[: max(0, len(numbers) - (MOST - 1))]:
        folder = results / FOLDER / str(number)
        with contextlib.suppress(OSError):  # then it stays, whole
            (folder / MADE).unlink(missing_ok=True)  # first: half removed, it is shown no more
            shutil.rmtree(folder, ignore_errors=True)


def _numbers(results: Path) -> list[int]:
    place = results / FOLDER
    if not place.is_dir():
        return []
    return sorted(int(name) for name in os.listdir(place) if name.isdecimal())
