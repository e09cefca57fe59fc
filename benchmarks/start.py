"""Processor time from a word in a shell to its answer, each in an interpreter of its own.

python -m benchmarks.start SUBJECT
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

TIMES = 5  # the least is the program's own; the others had to share a cache
UNTIL_SOLVING = """
import os, sys
from addb_viewer.commands import cli
from addb_viewer.jobs import solving
def solve(*_, **__):
    os._exit(0)
solving.solve = solve
cli.main()
"""
SHOWN = (
    ("--version", ["-m", "addb_viewer", "--version"], 0.4),
    ("--help", ["-m", "addb_viewer", "--help"], 0.4),
    ("flags SUBJECT", ["-m", "addb_viewer", "flags", "SUBJECT"], 1.0),
    (
        "fit SUBJECT, until it solves",
        ["-c", UNTIL_SOLVING, "fit", "SUBJECT", "--force", "--out", "RESULTS"],
        1.5,
    ),
)


def processor_seconds(words: list[str]) -> float:
    """User and system time of a child process [s]."""
    before = os.times()
    run = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    after = os.times()
    if run.returncode:
        sys.exit(run.stderr)
    return after.children_user - before.children_user + after.children_system - before.children_system


def main(subject: Path) -> None:
    """Print the least of a few runs of each."""
    with tempfile.TemporaryDirectory() as results:
        places = {"SUBJECT": str(subject), "RESULTS": results}
        for name, words, aim in SHOWN:
            least = min(processor_seconds([places.get(word, word) for word in words]) for _ in range(TIMES))
            print(f"{name:30} {least:5.2f} s of processor time (aim {aim:g})")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
