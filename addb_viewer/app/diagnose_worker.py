"""`addb-viewer diagnose` for the app: `python -m` this module with SUBJECT and RESULTS; progress as lines."""

import sys
from pathlib import Path

import typer

from addb_viewer.app.work import progress_line
from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.solving import job_for
from addb_viewer.kept_diagnosis import keep
from solver.diagnosis.diagnose import diagnose
from solver.diagnosis.report import as_json
from solver.progress import Progress
from solver.provenance import provenance_of
from solver.results.store import check_place
from solver.settings import as_dict


def diagnose_and_keep(folder: Path, results: Path, progress: Progress) -> Path:
    """Diagnose all trials of a subject and keep the answer.

    Args:
        folder: the subject's.
        results: where the answer goes.
        progress: told the stage and the fraction done.

    Returns:
        The file that holds it.
    """
    job = job_for(folder, out=results)
    check_place(job.results)
    made_of = {
        "provenance": provenance_of(job.subject, job.subject.trials, job.reviews),
        "settings": as_dict(job.settings),
    }
    found = diagnose(job.subject, job.settings, trials=job.trials, reviews=job.reviews, progress=progress)
    figures = as_json(found) | {"notes": [*job.subject.notes, *found.notes]}
    return keep(figures, made_of, job.results)


def main() -> int:
    """Run on `sys.argv`; errors become one line on stderr."""
    folder, results = map(Path, sys.argv[1:])
    try:
        with errors_as_lines(debug=False):
            diagnose_and_keep(folder, results, _print_progress)
    except typer.Exit as ending:
        return ending.exit_code
    return 0


def _print_progress(stage: str, fraction: float) -> None:
    print(progress_line(stage, fraction), flush=True)


if __name__ == "__main__":
    sys.exit(main())
