"""A process that was started to end with its parent does: nobody holds its stdin any more."""

import os
import signal
import subprocess
import sys

import pytest

from addb_viewer.jobs.environment import ENDS_WITH_STDIN
from tests.patience import PATIENCE_S

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals as exit status")


def command(environment):
    """One that would wait for its input for ever."""
    return subprocess.Popen(
        [sys.executable, "-c", WAITS],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, **environment},
    )


WAITS = """
import time
import addb_viewer.commands.cli as cli

cli.app = lambda: (print("begun", flush=True), time.sleep(600))
cli.main()
"""


def test_it_ends_when_the_parent_lets_go():
    process = command({ENDS_WITH_STDIN: "1"})
    assert process.stdout.readline() == b"begun\n"
    assert process.poll() is None
    process.stdin.close()
    assert process.wait(PATIENCE_S) == -signal.SIGTERM
    process.stdout.close()


def test_other_processes_do_not_look_at_their_input():
    process = command({})
    assert process.stdout.readline() == b"begun\n"
    process.stdin.close()
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1.0)
    process.kill()
    process.wait(PATIENCE_S)
    process.stdout.close()
