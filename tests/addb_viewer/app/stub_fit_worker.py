"""Stands for the worker of a fit: writes a fit's head, or does what the subject's name says."""

import json
import sys
import time
from pathlib import Path

from addb_viewer.jobs.processes import print_progress
from solver.common.operating_system import end_in_order
from solver.common.typed_json import plain
from tests.addb_viewer.fit_figures import of_subject, of_trial

FOREVER_S = 600.0


def main():
    end_in_order()
    folder, results = Path(sys.argv[1]), Path(sys.argv[2])
    print_progress("solving", 0.5)
    if "broken" in folder.name:
        sys.stderr.write(f"addb-viewer: {folder}/walk.trc: the markers end within a line\n")
        return 1
    if "long" in folder.name:
        time.sleep(FOREVER_S)
    results.mkdir()
    (results / "fit.json").write_text(json.dumps(plain(of_subject(of_trial(frames=5)))))
    if "old" in folder.name:
        sys.stderr.write(f"addb-viewer: the kept fit is out of date ({folder}/walk.trc)\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
