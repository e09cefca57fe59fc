"""How commands fail: status and one line, whatever was raised."""

import errno
import warnings

import pytest
import typer

from addb_viewer.jobs.command_errors import errors_as_lines
from solver.common.errors import Cancelled, CaptureError, FitError


def outcome(error, capsys, debug=False):
    with pytest.raises(typer.Exit) as exit_, errors_as_lines(debug):
        raise error
    return exit_.value.exit_code, capsys.readouterr()


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (CaptureError("grf.mot: line 3: 'a' is no number"), 1, "grf.mot: line 3: 'a' is no number"),
        (FitError("two\nlines   here"), 1, "two lines here"),
        (FileNotFoundError(2, "No such file or directory", "a.trc"), 1, "a.trc: No such file or directory"),
        (OSError("disk on fire"), 1, "disk on fire"),
        (TypeError("odd"), 1, "unexpected TypeError: odd (run with --debug for the traceback)"),
        (KeyboardInterrupt(), 130, "stopped; nothing was written"),
        (Cancelled("stopped during scaling"), 130, "stopped; nothing was written"),
    ],
)
def test_one_line_on_stderr(error, status, line, capsys):
    code, printed = outcome(error, capsys)
    assert code == status
    assert printed.err == f"addb-viewer: {line}\n"
    assert printed.out == ""


def test_a_full_disk_is_told_with_file_room_and_advice_wherever_it_is_met(capsys, tmp_path):
    file = tmp_path / "a.txt"
    code, printed = outcome(OSError(errno.ENOSPC, "No space left on device", str(file)), capsys)
    assert code == 1
    assert printed.err.startswith(f"addb-viewer: {file}: cannot write here (No space left on device, ")
    assert printed.err.endswith(" MB free); free some space, or choose another output folder.\n")


def test_debug_shows_the_traceback(capsys):
    code, printed = outcome(ZeroDivisionError("division by zero"), capsys, debug=True)
    assert code == 1
    assert "Traceback (most recent call last)" in printed.err
    assert printed.err.endswith("addb-viewer: unexpected ZeroDivisionError: division by zero\n")


def test_library_warnings_are_for_debugging(capsys):
    for debug in (False, True):
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            with errors_as_lines(debug):
                warnings.warn("mean of empty slice", RuntimeWarning, stacklevel=1)
        assert bool(seen) is debug


def test_wrong_use_stays_wrong_use():
    with pytest.raises(typer.BadParameter), errors_as_lines(debug=False):
        raise typer.BadParameter("no such folder")
