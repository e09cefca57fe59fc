"""The log of verdicts, one JSON line each, and the claim of the one watcher that judges a trial.

Lines are only ever added. One that a killed run left torn is passed over; one that says what has been said
already does not count, so that two watchers of a folder, on two machines, say everything once.
"""

import errno
import hashlib
import os
import socket
import time
import uuid
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import msgspec
import psutil

from solver.capture.atomic import made_folder
from solver.common.disk_errors import writing_failed
from solver.common.errors import ResultsError
from solver.common.operating_system import taken
from solver.common.typed_json import from_plain, plain

FOLDER = "watch"  # in a subject's results
LOG = "verdicts.jsonl"
PATIENCE_S = 10.0  # for the lock on the log, which is held while a line is written
ABANDONED_S = 15.0  # a claim that nobody has renewed for so long is a dead watcher's


class Stage(StrEnum):
    """What a line says of a trial; the last two end its judging."""

    FIRST = "first"  # checks that need no fit
    FIT = "fit"  # the fit's word, where the diagnosis takes longer
    VERDICT = "verdict"  # by fit and diagnosis
    STATIC = "static"  # it is a static trial


LAST = (Stage.VERDICT, Stage.STATIC)


class Colour(StrEnum):
    """Of a line, never without its sign."""

    GREEN = "green"
    YELLOW = "yellow"
    RED = "red"
    NONE = "none"  # nothing is judged


@dataclass(frozen=True)
class VerdictLine:
    """One line of the log."""

    trial: str
    files: str  # SHA-256 of each of the trial's files, markers first
    stage: Stage
    colour: Colour
    words: str  # the verdict
    to_do: str  # now, in the laboratory
    when: str  # ISO 8601, UTC
    seconds: float  # since the files were at rest
    good: bool = False  # its torques can be used
    activity: str = ""  # walk, run, …
    right_steps: int = 0  # wholly on plates
    left_steps: int = 0
    off_zero: tuple[str, ...] = ()  # plates whose zero level was off
    names: tuple[str, ...] = ()  # "id target" of what the diagnosis named
    about: tuple[str, ...] = ()  # what `to_do` tells: branch of the catalogue of causes, and target
    against: str = ""  # why the plan does not count it
    missed: tuple[str, ...] = ()  # which foot missed which plate, in words

    @property
    def is_last(self) -> bool:
        """Whether its trial is judged."""
        return self.stage in LAST


def log_folder(results: Path) -> Path:
    """Where the log of a subject lies, in its results folder."""
    return results / FOLDER


def read_log(folder: Path) -> list[VerdictLine]:
    """What the log says, in order; torn and repeated lines left out, none where there is no log."""
    try:
        text = (folder / LOG).read_bytes()
    except FileNotFoundError:
        return []
    except OSError as error:
        raise ResultsError(f"{folder / LOG}: cannot be read ({error.strerror}).") from error
    return list(_said_once(_parsed(text)))


def _parsed(text: bytes) -> Iterator[VerdictLine]:
    for line in text.split(b"\n"):
        with suppress(msgspec.DecodeError, ValueError):  # torn, or of another version
            yield from_plain(msgspec.json.decode(line), VerdictLine)


def _said_once(lines: Iterable[VerdictLine]) -> Iterator[VerdictLine]:
    """Without lines of a stage that the same files have reached: the first counts."""
    files: dict[str, str] = {}
    said: dict[str, set[Stage]] = {}
    for line in lines:
        if files.get(line.trial) != line.files:
            files[line.trial], said[line.trial] = line.files, set()
        stages = said[line.trial]
        if line.stage not in stages and stages.isdisjoint(LAST):
            stages.add(line.stage)
            yield line


def present(lines: Sequence[VerdictLine]) -> dict[str, VerdictLine]:
    """By trial, its newest line; former verdicts on files that were replaced are superseded. Oldest first."""
    newest: dict[str, VerdictLine] = {}
    for line in lines:
        newest.pop(line.trial, None)
        newest[line.trial] = line
    return newest


def append(folder: Path, line: VerdictLine) -> bool:
    """Add a line, unless it has been said; whether it was added.

    Raises:
        ResultsError: it cannot be written, as on a full disk; what was written of it counts for nothing.
    """
    made_folder(folder)
    try:
        with _alone(folder):
            before = read_log(folder)
            if len(list(_said_once([*before, line]))) == len(before):
                return False
            _write(folder / LOG, msgspec.json.encode(plain(line)))
    except OSError as error:
        raise ResultsError(writing_failed(folder / LOG, error)) from error
    return True


def _write(log: Path, line: bytes) -> None:
    with log.open("a+b", buffering=0) as file:
        end = file.seek(0, os.SEEK_END)
        file.seek(max(0, end - 1))
        torn = b"\n" if end and file.read(1) != b"\n" else b""
        whole = torn + line + b"\n"
        if file.write(whole) != len(whole):  # the disk is full: what is there is torn
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        os.fsync(file.fileno())


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """While no other watcher writes here, where this file system has locks; else readers see to it."""
    handle = os.open(folder / ".lock", os.O_WRONLY | os.O_CREAT, 0o644)
    try:
        taken(handle, PATIENCE_S)
        yield
    finally:
        os.close(handle)


@dataclass(frozen=True)
class Claim:
    """That this watcher judges a trial now; renewed while it lives, anybody's once it is abandoned."""

    file: Path
    owner: str

    def renew(self) -> None:
        """Say that its owner lives."""
        with suppress(OSError):
            os.utime(self.file)

    def release(self) -> None:
        """Let others judge the trial, unless somebody has taken the claim over."""
        with suppress(OSError):
            if self.file.read_text() == self.owner:
                self.file.unlink()


def claim(folder: Path, trial: str) -> Claim | None:
    """Claim a trial; None while another watcher has it.

    Raises:
        ResultsError: nothing can be written there.
    """
    made_folder(folder)
    file = folder / f".claim-{hashlib.sha256(trial.encode()).hexdigest()[:16]}"
    own = Claim(file, f"{socket.gethostname()} {os.getpid()} {uuid.uuid4().hex}")
    try:
        with _alone(folder):
            if _is_abandoned(file):
                file.unlink(missing_ok=True)
            with file.open("x") as made:
                made.write(own.owner)
    except FileExistsError:
        return None
    except OSError as error:
        with suppress(OSError):  # a full disk leaves it empty, and nobody's
            file.unlink()
        raise ResultsError(writing_failed(file, error)) from error
    return own


def _is_abandoned(file: Path) -> bool:
    """Its owner is dead, or by the clock of the machine that holds the folder it was not renewed for long."""
    try:
        last, owner = file.stat().st_mtime, file.read_text().split()
    except FileNotFoundError:
        return False
    if len(owner) == 3 and owner[0] == socket.gethostname() and not psutil.pid_exists(int(owner[1])):
        return True
    probe = file.with_name(f".now-{uuid.uuid4().hex}")
    probe.touch()
    try:
        return probe.stat().st_mtime - last > ABANDONED_S
    finally:
        probe.unlink(missing_ok=True)


def now_utc() -> str:
    """The time as lines have it."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
