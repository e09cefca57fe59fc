"""Stands for the worker of a solve: the last fit again, with the masks that the review now asks for.

Only who waits for a solve needs it: no motion changes. Arguments and last word are those of the app's worker.
"""

import sys
from dataclasses import replace
from pathlib import Path

from addb_viewer.app.subjects.library import library_of
from addb_viewer.jobs.review_store import open_log
from addb_viewer.jobs.stored_solves import add
from addb_viewer.trial_view.forces_in_use import mask_now
from solver.capture.subject.subject import open_subject


def main() -> int:
    """Run on `sys.argv`."""
    folder, results, author = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    library = library_of(open_subject(folder))
    assert library.fit is not None
    trials = []
    with open_log(folder) as log:
        for trial in library.fit.trials:
            name = trial.capture.name
            mask = mask_now(library.replay(name), log.review(name, library.subject.foot_bodies))
            trials.append(trial if trial.mask is None or mask is None else replace(trial, mask=mask))
    print(add(replace(library.fit, trials=tuple(trials)), results, by=author, seconds=0.1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
