"""How a command fails: one clear line on stderr and an exit status, never a traceback unless asked for."""

import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer

from annotations.errors import ReviewError
from solver.common.disk_errors import ONLY_WRITING, writing_failed
from solver.common.errors import Cancelled, SolverError
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
