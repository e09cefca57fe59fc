"""One command on all subjects below a folder, each in a process of its own: a broken one stops none."""

import os
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from addb_viewer.commands.many_table import Outcome, Status, line_of, write_csv
from addb_viewer.jobs.environment import ENDS_WITH_STDIN
from addb_viewer.jobs.own_packages import own_process
from addb_viewer.jobs.root_folder import RootFolder, open_root, reading_of
from addb_viewer.jobs.subject_checks import check_folder
from solver.capture.formats.b3d.places import is_b3d, recording_of
from solver.capture.formats.recording_files import is_recording
from solver.capture.subject.subject import DESCRIPTIONS, NoSubjectError, open_subject
from solver.common.errors import CaptureError
from solver.common.small_files import json_content
from solver.fitting.results.store import write_json

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_LEFT_OUT = " is left out: "  # as `open_root` says it

Row = dict[str, str | float | None]


@dataclass(frozen=True)
class Work:
    """What is done to each subject."""

    command: str
    words: tuple[str, ...]  # options of the command that all subjects share
    out: Path | None  # below which each subject's results go; None: beside its recordings
    row: Callable[[dict[str, Any], str], Row]  # figures of the command's JSON, and what it printed
    has_json: bool = True
    kept: Callable[[Path], dict[str, Any] | None] = lambda _: None  # figures that are still true
    unchanged: str = ""  # what the command prints where it took over what was kept


@dataclass
class _Processes:
    """Those that run, so that they can be ended."""

    running: set[subprocess.Popen] = field(default_factory=set)
    lock: threading.Lock = field(default_factory=threading.Lock)
    ended: bool = False

    def run(self, words: Sequence[str], environment: dict[str, str]) -> tuple[int, str, str]:
        with self.lock:
            if self.ended:
                raise InterruptedError
            process = subprocess.Popen(
                words,
                stdin=subprocess.PIPE,  # held open until we end, however we do
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                env={**environment, ENDS_WITH_STDIN: "1"},
            )
            self.running.add(process)
        said, complained = _all_said(process)
        with self.lock:
            self.running.discard(process)
        return process.returncode, said, complained

    def end(self) -> None:
        with self.lock:
            self.ended = True
            for process in self.running:
                process.terminate()


def _all_said(process: "subprocess.Popen[str]") -> tuple[str, str]:
    """Stdout and stderr to their ends, with stdin left open: `communicate` would close it."""
    assert process.stdout is not None
    assert process.stderr is not None
    assert process.stdin is not None
    with process.stdin, process.stdout as out, process.stderr as err, ThreadPoolExecutor(1) as reader:
        complained = reader.submit(err.read)
        said = out.read()
        process.wait()
        return said, complained.result()


def several(folder: Path) -> RootFolder | None:
    """The subjects below a folder; None where it is a subject itself, or nothing that has any.

    Raises:
        CaptureError: no such folder, or none of the subjects in it can be read.
    """
    check_folder(folder)
    if not folder.is_dir() or recording_of(folder) is not None:
        return None
    if any((folder / name).is_file() for name in DESCRIPTIONS):
        return None
    try:
        open_subject(folder, reading_of(folder))
    except CaptureError:
        pass
    else:
        return None
    try:
        root = open_root(folder)
    except NoSubjectError:
        return None  # the command itself says what was sought
    return None if root.names == (".",) else root


def options(**given: Any) -> tuple[str, ...]:
    """Options of a command line as they are typed, by the names of the command's parameters."""
    words: list[str] = []
    for name, value in given.items():
        option = f"--{name.strip('_').replace('_', '-')}"
        if value is True:
            words.append(option)
        elif value not in (None, False):
            each = value if isinstance(value, (list, tuple)) else [value]
            words += [word for one in each for word in (option, str(one))]
    return tuple(words)


def done_to_all(root: RootFolder, work: Work, jobs: int, say: Callable[[str], None]) -> list[Outcome]:
    """Run the command on every subject, `jobs` at a time; a line as each ends.

    Args:
        root: the folder.
        work: what is done.
        jobs: processes at a time.
        say: prints a line.

    Returns:
        In the order of the subjects' names, those that cannot be opened last.

    Raises:
        KeyboardInterrupt: stopped, by Ctrl-C or a polite kill; what was finished is kept.
    """
    for note in _without_recordings(root):
        say(f"note: {note}")
    outcomes = dict.fromkeys(root.names)
    processes = _Processes()
    count = len(root.names)
    with tempfile.TemporaryDirectory() as scratch, _polite_kill_is_ctrl_c():
        pool = ThreadPoolExecutor(jobs)
        ends = [
            pool.submit(_one, root, name, work, Path(scratch) / f"{k}.json", processes, _environment(jobs))
            for k, name in enumerate(root.names)
        ]
        try:
            for k, end in enumerate(as_completed(ends), start=1):
                outcome = end.result()
                outcomes[outcome.subject] = outcome
                say(f"{k:>{len(str(count))}}/{count}  {line_of(outcome)}")
                for warning in outcome.warnings:
                    say(f"    {warning}")
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            processes.end()
            pool.shutdown(wait=True)
            raise
        pool.shutdown()
    return [outcome for outcome in outcomes.values() if outcome is not None] + _broken(root)


def write_outcomes(outcomes: Sequence[Outcome], json: Path | None, csv: Path | None) -> None:
    """Write what became of each subject, with its figures."""
    if json is not None:
        write_json(json, {"subjects": [outcome.as_json() for outcome in outcomes]})
    if csv is not None:
        write_csv(csv, outcomes)


def _one(
    root: RootFolder,
    name: str,
    work: Work,
    figures_file: Path,
    processes: _Processes,
    environment: dict[str, str],
) -> Outcome:
    start, folder = time.monotonic(), root.path / name
    try:
        figures = work.kept(folder)
    except Exception:  # the command itself says what is wrong, in its own process
        figures = None
    if figures is not None:
        return Outcome(name, Status.KEPT, time.monotonic() - start, "", work.row(figures, ""), figures)
    words = [*own_process("addb_viewer"), work.command, str(folder), *work.words]
    if work.out is not None:
        words += ["--out", str(work.out / name)]
    if work.has_json:
        words += ["--json", str(figures_file)]
    status, said, complained = processes.run(words, environment)
    seconds = time.monotonic() - start
    figures = json_content(figures_file) if figures_file.is_file() else {}
    row = work.row(figures, said) if figures or not (status or work.has_json) else {}
    warnings = tuple(line for line in said.splitlines() if line.startswith("! "))
    if status:
        return Outcome(name, Status.FAILED, seconds, _reason(complained, status), row, figures, warnings)
    kept = bool(work.unchanged) and work.unchanged in said
    said = "; ".join(_own_lines(complained))
    return Outcome(name, Status.KEPT if kept else Status.DONE, seconds, said, row, figures, warnings)


def _reason(complained: str, status: int) -> str:
    """What a command said in its last words; a signal's number where something ended it."""
    own = _own_lines(complained)
    if own:
        return "; ".join(own)
    if status < 0:
        return f"ended by {signal.Signals(-status).name}; is there enough memory?"
    return complained.strip().splitlines()[-1] if complained.strip() else f"ended with status {status}"


def _own_lines(complained: str) -> list[str]:
    """What the command itself said on stderr."""
    mark = "addb-viewer: "
    return [line.removeprefix(mark) for line in complained.splitlines() if line.startswith(mark)]


def _environment(jobs: int) -> dict[str, str]:
    """That of the processes: together they use no more threads than there are cores."""
    if jobs == 1:
        return dict(os.environ)
    each = str(max(1, (os.cpu_count() or 1) // jobs))
    return {**dict.fromkeys(_THREADS, each), **os.environ}


def _broken(root: RootFolder) -> list[Outcome]:
    """Folders that hold recordings or a description and cannot be opened."""
    left_out = (note.partition(_LEFT_OUT) for note in root.notes)
    return [
        Outcome(name, Status.FAILED, 0.0, reason, {}, {})
        for name, said, reason in left_out
        if said and _holds_something(root.path / name)
    ]


def _without_recordings(root: RootFolder) -> list[str]:
    broken = {outcome.subject for outcome in _broken(root)}
    return [note for note in root.notes if note.partition(_LEFT_OUT)[0] not in broken]


def _holds_something(place: Path) -> bool:
    if place.is_file():
        return True
    return any(
        file.name in DESCRIPTIONS or is_recording(file) or is_b3d(file)
        for file in place.rglob("*")
        if file.is_file()
    )


@contextmanager
def _polite_kill_is_ctrl_c() -> Iterator[None]:
    """SIGTERM ends the subjects' processes as well; elsewhere than in the main thread nothing can."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
