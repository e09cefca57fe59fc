"""A subject's first fit for the app: `python -m` this module with SUBJECT and RESULTS; progress as lines.

It is kept as by `addb-viewer fit --quick`, at the lowest priority: people's own work goes first.
"""

import os
import sys
from pathlib import Path

import typer

from addb_viewer.app.jobs.worker_process import LOWEST, end_in_order, give_way, print_progress
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.solving import job_for, kept_fit


def main() -> int:
    """Run on `sys.argv`; errors become one line on stderr."""
    end_in_order()
    give_way(os.getpid(), LOWEST)
    folder, results = Path(sys.argv[1]), Path(sys.argv[2])
    try:
        with errors_as_lines(debug=False):
            kept_fit(job_for(folder, out=results), progress=print_progress)
    except typer.Exit as ending:
        return ending.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
