"""A solve for the app: `python -m` this module with SUBJECT, RESULTS and AUTHOR; progress as lines.

The kept fit stays as it is: the new one goes among the solves, for somebody to keep or to discard.
"""

import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

import typer

from addb_viewer.app.solves import finish, new_folder
from addb_viewer.app.work import progress_line
from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.solving import job_for
from solver.errors import ResultsError
from solver.fit import Fit
from solver.pipeline import can_resolve, resolve, solve
from solver.progress import Progress, part
from solver.results.store import check_place, has_fit, load_fit, save_fit
from solver.review_stage import predicting_withheld

RESOLVED = 0.4  # share of a re-solve's work before the withheld blocks


def main() -> int:
    """Run on `sys.argv`; errors become one line on stderr."""
    folder, results, author = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    try:
        with errors_as_lines(debug=False):
            print(_solved(folder, results, author, _print_progress))
    except typer.Exit as ending:
        return ending.exit_code
    return 0


def _solved(folder: Path, results: Path, author: str, progress: Progress) -> str:
    began = time.monotonic()
    job = job_for(folder, out=results)
    check_place(results)
    kept = _kept(results, folder)
    if kept is not None and can_resolve(
        kept, job.subject, job.subject.trials, job.settings, extension=job.extension
    ):
        fit = resolve(
            replace(kept, subject=job.subject),
            job.reviews,
            job.settings,
            part(progress, 0.0, RESOLVED),
            extension=job.extension,
        )
        fit = predicting_withheld(fit, job.settings, part(progress, RESOLVED, 1.0), job.extension)
    else:
        fit = solve(
            job.subject, job.settings, reviews=job.reviews, extension=job.extension, progress=progress
        )
    place = new_folder(results)
    try:
        save_fit(fit, place)
        finish(place, by=author, seconds=time.monotonic() - began)
    except BaseException:
        shutil.rmtree(place, ignore_errors=True)
        raise
    return place.name


def _kept(results: Path, folder: Path) -> Fit | None:
    if not has_fit(results):
        return None
    try:
        return load_fit(results, folder)
    except ResultsError:
        return None


def _print_progress(stage: str, fraction: float) -> None:
    print(progress_line(stage, fraction), flush=True)


if __name__ == "__main__":
    sys.exit(main())
