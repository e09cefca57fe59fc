"""A program that is killed while it records edits: what it was told is on the disk is there."""

import signal
import sqlite3
import subprocess
import sys
import textwrap

import pytest

from annotations.log import ReviewLog

RECORDS_FOREVER = """
    import itertools, sys
    from annotations.events import FlagRange
    from annotations.log import ReviewLog

    log = ReviewLog.open(sys.argv[1])
    for k in itertools.count():
        print(log.append("walk", FlagRange(k, k + 1, "manualReview"), "anna"), flush=True)
"""


@pytest.mark.parametrize("acknowledged", [1, 60, 300])
def test_every_acknowledged_edit_survives(path, acknowledged):
    program = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(RECORDS_FOREVER), path], stdout=subprocess.PIPE, text=True
    )
    assert program.stdout is not None
    told = [int(program.stdout.readline()) for _ in range(acknowledged)]
    program.send_signal(signal.SIGKILL)
    rest = program.stdout.read()  # what readline() holds back included
    program.wait(timeout=20)
    told += [int(line) for line in rest.splitlines(keepends=True) if line.endswith("\n")]
    with ReviewLog.open(path) as log:
        edits = log.history("walk")
        number = log.append("walk", edits[0].event, "ben")
    found = [edit.number for edit in edits]
    assert found[: len(told)] == told
    assert len(found) <= len(told) + 1  # the one that was on its way
    assert [edit.event.start for edit in edits] == list(range(len(edits)))
    assert number == found[-1] + 1
    with sqlite3.connect(path) as raw:
        assert raw.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    raw.close()
