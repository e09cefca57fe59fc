"""A solve for the app: `python -m` this module with SUBJECT, RESULTS and AUTHOR; progress as lines.

The kept fit stays as it is: the new one goes among the solves, for somebody to keep or to discard. Its number
is the last thing said.
"""

import sys
import time
from pathlib import Path

import typer

from addb_viewer.app.jobs.turns import wait_for_turn
from addb_viewer.app.jobs.worker_process import end_in_order, print_progress
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.solving import computed, job_for, last_fit
from addb_viewer.jobs.stored_solves import add
from solver.fitting.results.store import check_place


def main() -> int:
    """Run on `sys.argv`; errors become one line on stderr."""
    end_in_order()
    folder, results, author = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    try:
        with errors_as_lines(debug=False):
            wait_for_turn(print_progress)
            began = time.monotonic()
            job = job_for(folder, out=results)
            check_place(results)
            fit, _ = computed(job, last_fit(job), print_progress)
            print(add(fit, results, by=author, seconds=time.monotonic() - began))
    except typer.Exit as ending:
        return ending.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
