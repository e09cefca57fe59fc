"""Layouts of held-out forces for the app: `python -m` this module with SUBJECT, RESULTS and FIT.

FIT is the folder of a fit; progress comes as lines. Each layout is kept beside the fit when it comes, so that
ending this, at once and whatever it does, loses the present one alone.
"""

import os
import sys
from pathlib import Path

import typer

from addb_viewer.app.jobs.worker_process import LOWEST, give_way, print_progress
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.holding_out import FitReplacedError, HoldingOut
from addb_viewer.jobs.solving import job_for
from solver.common.errors import ResultsError
from solver.fitting.pipeline import can_resolve
from solver.fitting.results.store import load_fit, present_solve


def main() -> int:
    """Run on `sys.argv`; errors become one line on stderr."""
    give_way(os.getpid(), LOWEST)
    folder, results, place = (Path(argument) for argument in sys.argv[1:4])
    try:
        with errors_as_lines(debug=False):
            job = job_for(folder, out=results)
            solve = present_solve(place)
            fit = load_fit(place, folder)
            names = {*(trial.capture.name for trial in fit.trials), *(trial.name for trial in fit.unread)}
            trials = [trial for trial in job.subject.trials if trial.name in names]
            if not can_resolve(fit, job.subject, trials, job.settings, extension=job.extension):
                raise ResultsError(
                    f"{place}: files, settings or accepted causes have changed since this fit was made. "
                    "Solve again: held-out forces are judged after it."
                )
            try:
                HoldingOut(fit, place, solve).run(job.settings, print_progress, job.extension)
            except FitReplacedError:
                print("another fit has taken the place of this one")
    except typer.Exit as ending:
        return ending.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
