"""Lay a set of recordings out as found and let the first commands of a newcomer run over it."""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.recordings import program_version

COMMANDS = ("init", "fit", "diagnose")
LONGEST_S = 1800
DESCRIPTIONS = ("subject.toml", "_subject.json", "settings.toml", "markers.toml")
LEFT_BEHIND = ("reference", "results")
CRASHED = re.compile(r"Traceback \(most recent call last\)|unexpected \w+(Error|Exception|Warning)\b")


@dataclass(frozen=True)
class Visit:
    """What the commands said of one set, and where its copy lies."""

    folder: str  # of the copy
    code: str  # of the program, as it was
    status: dict[str, int]  # by command
    said: dict[str, str]  # by command, with what went to stderr
    seconds: dict[str, float]

    @property
    def everything(self) -> str:
        """All that a user was told."""
        return "\n".join(self.said.values())

    @property
    def crashed(self) -> list[str]:
        """Commands that ended in a fault of the program."""
        late = [name for name, status in self.status.items() if status == -1]
        return late + [name for name, text in self.said.items() if CRASHED.search(text)]

    @property
    def subjects(self) -> list[Path]:
        """Folders of subjects whose fit is kept."""
        return sorted(file.parents[1] for file in Path(self.folder).rglob("results/fit.json"))


def visited(source: Path, out: Path) -> Visit:
    """The kept visit of this code to this set, else a new one.

    Args:
        source: the set.
        out: where its copy and the answers lie.
    """
    kept, code = out / "visit.json", program_version()
    if kept.exists():
        found = Visit(**json.loads(kept.read_text(encoding="utf-8")))
        if found.code == code:
            return found
    shutil.rmtree(out, ignore_errors=True)
    copy = out / source.name
    shutil.copytree(source, copy, ignore=_not_as_found)
    subprocess.run(["chmod", "-R", "u+w", str(copy)], check=True)
    status, said, seconds = {}, {}, {}
    for command in COMMANDS:
        begin = time.perf_counter()
        status[command], said[command] = _run([command, str(copy)], copy)
        seconds[command] = time.perf_counter() - begin
    visit = Visit(str(copy), code, status, said, seconds)
    kept.write_text(json.dumps(asdict(visit), indent=1), encoding="utf-8")
    return visit


def _not_as_found(folder: str, names: list[str]) -> set[str]:
    """Descriptions that were written for the program, and what others made of the recordings."""
    return {name for name in names if name in DESCRIPTIONS or name in LEFT_BEHIND}


def _run(arguments: Sequence[str], copy: Path) -> tuple[int, str]:
    """Exit status and all output, with the copy's place left out; −1 where it never ended."""
    environment = os.environ | {"COLUMNS": "200", "NO_COLOR": "1"}
    command = [sys.executable, "-m", "addb_viewer", *arguments]
    try:
        done = subprocess.run(
            command,
            check=False,
            capture_output=True,
            timeout=LONGEST_S,
            env=environment,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        return -1, f"stopped after {LONGEST_S} s"
    text = (done.stdout + done.stderr).decode("utf-8", "replace")
    return done.returncode, text.replace(str(copy), copy.name)
