"""How a command fails: one clear line on stderr and an exit status, never a traceback unless asked for."""

import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path

import typer

from annotations.review_errors import ReviewError
from solver.capture.capture import Subject
from solver.capture.formats.b3d.places import DECISIONS, recording_of
from solver.common.disk_errors import ONLY_WRITING, writing_failed
from solver.common.errors import Cancelled, CaptureError, SolverError
from solver.common.file_names import readable

FAILED = 1  # the data or the solve
STOPPED = 130  # by Ctrl-C, as shells count it


@contextmanager
def errors_as_lines(debug: bool) -> Iterator[None]:
    """Turn what goes wrong inside into one line on stderr and the exit status.

    Args:
        debug: print the traceback and library warnings as well.
    """
    try:
        with warnings.catch_warnings():
            if not debug:
                warnings.simplefilter("ignore")
            yield
    except (typer.Exit, typer.BadParameter, BrokenPipeError):
        raise
    except (KeyboardInterrupt, Cancelled):
        _fail("stopped; nothing was written", STOPPED, debug)
    except (SolverError, ReviewError) as error:
        _fail(str(error), FAILED, debug)
    except OSError as error:
        _fail(_described(error), FAILED, debug)
    except Exception as error:
        line = f"unexpected {type(error).__name__}: {error}"
        _fail(line if debug else f"{line} (run with --debug for the traceback)", FAILED, debug)


def warn(said: str) -> None:
    """One line on stderr about what was done all the same; none where there is nothing to say."""
    if said:
        typer.echo(f"addb-viewer: {readable(' '.join(said.split()))}", err=True)


def _described(error: OSError) -> str:
    if error.errno in ONLY_WRITING:
        return writing_failed(Path(error.filename or "."), error)
    if error.filename is None or error.strerror is None:
        return str(error)
    return f"{error.filename}: {error.strerror}"


def _fail(message: str, status: int, debug: bool) -> None:
    if debug:
        traceback.print_exc()
    warn(message)
    raise typer.Exit(status)


def check_folder(folder: Path) -> None:
    """Refuse a subject folder that isn't there."""
    if not folder.is_dir() and recording_of(folder) is None:
        given = str(folder).removesuffix(DECISIONS)
        if folder.is_file():
            raise CaptureError(f"{given}: this is a file; give the folder that holds it, or a .b3d file")
        raise CaptureError(
            f"{given}: no such folder; give the folder that holds the recordings, or a .b3d file"
        )


def check_trials(subject: Subject, wanted: Sequence[str]) -> None:
    """Refuse a trial that the subject doesn't have."""
    known = [trial.name for trial in subject.trials]
    for name in wanted:
        if name not in known:
            near = get_close_matches(name, known) or known
            raise CaptureError(f"{subject.folder}: no trial '{name}'; nearest: {', '.join(near)}")
