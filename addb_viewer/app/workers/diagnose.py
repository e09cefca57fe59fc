"""`addb-viewer diagnose` for the app: `python -m` this module with SUBJECT and RESULTS; progress as lines."""

import sys
from pathlib import Path

import typer

from addb_viewer.app.jobs.turns import wait_for_turn
from addb_viewer.app.jobs.worker_process import print_progress
from addb_viewer.jobs.diagnosing import diagnosed
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.solving import job_for


def main() -> int:
    """Run on `sys.argv`; errors become one line on stderr."""
    folder, results = map(Path, sys.argv[1:])
    try:
        with errors_as_lines(debug=False):
            wait_for_turn(print_progress)
            diagnosed(job_for(folder, out=results), print_progress)
    except typer.Exit as ending:
        return ending.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
