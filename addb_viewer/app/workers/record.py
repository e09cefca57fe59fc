"""Recordings and reports for the app: `python -m` this module; progress as lines, then the files written.

It writes fits as they lie on the disk, a solve that nobody has kept yet among them, and solves nothing.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import typer

from addb_viewer.app.jobs.worker_process import end_in_order, print_progress
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.review_store import whole_log
from addb_viewer.report.reporting import page_of
from addb_viewer.trial_view.recording import ON_ONE_PAGE, Recording, recording_of
from solver.capture.atomic import made_folder
from solver.fitting.fit import Fit
from solver.fitting.results.store import load_fit

FIT_READ = 0.2  # share of the work before the first file is begun


def main() -> int:
    """Run on `sys.argv`; errors become one line on stderr."""
    end_in_order()
    asked = _arguments(sys.argv[1:])
    try:
        with errors_as_lines(debug=False):
            print_progress("reading the fit", 0.0)
            fit = load_fit(asked.fit, asked.subject)
            share = (1.0 - FIT_READ) / len(asked.files)
            for i, file in enumerate(asked.files):
                print_progress(f"writing {file.name}", FIT_READ + i * share)
                made_folder(file.parent)
                print(_write(fit, asked, file))
            print_progress("written", 1.0)
    except typer.Exit as ending:
        return ending.exit_code
    return 0


def _arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("subject", type=Path)
    parser.add_argument("results", type=Path, help="where the diagnosis lies")
    parser.add_argument("fit", type=Path, help="folder of the fit")
    parser.add_argument("files", type=Path, nargs="+", help=".html, .rrd or .mcap")
    parser.add_argument("--previous", type=Path, help="folder of the fit that it is compared with")
    parser.add_argument("--trial", help="this one only")
    return parser.parse_args(arguments)


def _write(fit: Fit, asked: argparse.Namespace, file: Path) -> Path:
    if file.suffix == ".html":
        is_form = file.name.endswith(ON_ONE_PAGE)
        return page_of(fit, asked.results, file, trials=_trials(asked), one_page=is_form)[0]
    if file.suffix == ".mcap":
        from addb_viewer.recordings.mcap_recording import write_mcap  # noqa: PLC0415 (slow to load)

        return write_mcap(_recording(fit, asked), file)
    from addb_viewer.recordings.rrd_recording import write_rrd  # noqa: PLC0415 (slow to load)

    return write_rrd(_recording(fit, asked), file)


def _recording(fit: Fit, asked: argparse.Namespace) -> Recording:
    previous = None if asked.previous is None else load_fit(asked.previous, asked.subject)
    diagnosis = kept(asked.results)
    return recording_of(
        fit,
        trials=_trials(asked),
        previous=previous,
        diagnosis=diagnosis[0] if diagnosis else None,
        edits=whole_log(asked.subject).edits,
    )


def _trials(asked: argparse.Namespace) -> list[str] | None:
    return None if asked.trial is None else [asked.trial]


if __name__ == "__main__":
    sys.exit(main())
