"""Programs and servers killed while edits are recorded: what was acknowledged is there after that."""

import random
import sqlite3
import subprocess
import sys
import textwrap
import time

import pytest

from annotations.database import is_url
from annotations.events import FlagRange
from annotations.log import ReviewLog
from tests.patience import PATIENCE_S

EDITS = 100
KILLS = 4

RECORDS_FOREVER = """
    import itertools, random, sys
    from annotations.review_errors import ReviewError
    from annotations.events import FlagRange
    from annotations.log import ReviewLog

    log = ReviewLog.open(sys.argv[1])
    for k in itertools.count():
        match random.randrange(6):
            case 0:
                try:
                    log.undo("walk", "anna")
                except ReviewError:
                    continue
            case 1:
                try:
                    log.redo("walk", "anna")
                except ReviewError:
                    continue
            case _:
                log.append("walk", FlagRange(k, k + 1, "manualReview"), "anna")
        print(log.revision(), flush=True)
"""


def recording(place):
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(RECORDS_FOREVER), str(place)],
        stdout=subprocess.PIPE,
        text=True,
    )


def killed_after(program, acknowledged, seconds):
    """The edits that the program was told are recorded: some, and those of some more time."""
    told = [int(program.stdout.readline()) for _ in range(acknowledged)]
    time.sleep(seconds)
    program.kill()
    told += [int(line) for line in program.stdout.read().splitlines(keepends=True) if line.endswith("\n")]
    program.wait(timeout=PATIENCE_S)
    return told


def check_soundness(path):
    with sqlite3.connect(path) as raw:
        assert raw.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    raw.close()


@pytest.mark.slow
def test_every_acknowledged_edit_survives_its_program_being_killed_at_any_moment(place):
    moments = random.Random(5)
    told, kills = [], 0
    while kills < KILLS or len(told) < EDITS:
        told += killed_after(recording(place), EDITS // KILLS - 5, moments.uniform(0, 0.03))
        kills += 1
        if not is_url(place):
            check_soundness(place)
        with ReviewLog.open(place) as log:
            found = [edit.number for edit in log.history("walk")]
            log.review("walk", ("calcn_r", "calcn_l"))
        assert set(told) <= set(found)
        assert len(found) <= len(told) + kills  # those that were on their way
    assert found == sorted(found)


def test_every_acknowledged_edit_survives_a_crash_of_the_server(postgresql):
    place = postgresql.new_place()
    program = recording(place)
    told = [int(program.stdout.readline()) for _ in range(EDITS // 4)]
    postgresql.stop("immediate")
    told += [int(line) for line in program.stdout.read().splitlines()]  # it ends for want of a server
    program.wait(timeout=PATIENCE_S)
    postgresql.start()
    with ReviewLog.open(place) as log:
        found = [edit.number for edit in log.history("walk")]
        assert set(told) <= set(found)
        assert len(found) <= len(told) + 1
        assert log.append("walk", FlagRange(0, 1, "manualReview"), "anna") > max(found)


def test_a_log_that_is_open_goes_on_after_the_server_was_started_again(postgresql):
    with ReviewLog.open(postgresql.new_place()) as log:
        log.append("walk", FlagRange(0, 1, "manualReview"), "anna")
        postgresql.stop()
        postgresql.start()
        log.append("walk", FlagRange(1, 2, "manualReview"), "anna")
        assert [edit.event.start for edit in log.history()] == [0, 1]
