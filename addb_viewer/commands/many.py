"""One command on all subjects below a folder, each in a process of its own: a broken one stops none."""

import csv
import io
import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich import box
from rich.table import Table
from rich.text import Text

from addb_viewer.commands.options import file_to_write, written
from addb_viewer.jobs.command_errors import FAILED, STOPPED, check_folder
from addb_viewer.jobs.processes import THREADS, Processes, Start
from addb_viewer.jobs.root_folder import RootFolder, open_root
from addb_viewer.text.summary_table import console
from solver.capture.atomic import write_whole
from solver.capture.formats.b3d.places import is_b3d, recording_of, subject_folder_of
from solver.capture.formats.recording_files import is_recording
from solver.capture.subject.opened_subject import DESCRIPTIONS, NoSubjectError, open_subject
from solver.common.errors import CaptureError
from solver.common.small_files import json_content
from solver.fitting.results.store import write_json


class Status(StrEnum):
    """How a subject ended."""

    DONE = "done"
    KEPT = "kept"  # nothing had changed since the last time
    FAILED = "failed"


@dataclass(frozen=True)
class Outcome:
    """One subject."""

    subject: str  # its folder below the root
    status: Status
    seconds: float  # [s] on the clock
    reason: str  # of a failure; else what the command warned of
    row: Mapping[str, str | float | None]  # figures in short, by name with unit
    figures: Mapping[str, Any]  # of the command's own JSON
    warnings: tuple[str, ...] = ()  # lines of the command's own summary, from the exclamation mark on

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "subject": self.subject,
            "status": self.status.value,
            "seconds": round(self.seconds, 1),
            "reason": self.reason,
            "summary": dict(self.row),
            "figures": dict(self.figures),
        }


def line_of(outcome: Outcome) -> str:
    """One line: the subject, how it ended, its figures."""
    figures = ", ".join(f"{name} {_shown(value)}" for name, value in outcome.row.items() if value is not None)
    said = (
        outcome.reason
        if outcome.status is Status.FAILED
        else "; ".join(filter(None, [figures, outcome.reason]))
    )
    return f"{outcome.subject}: {outcome.status} ({outcome.seconds:.0f} s){': ' * bool(said)}{said}"


def print_table(outcomes: Sequence[Outcome]) -> None:
    """All subjects with their figures on stdout."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("subject", overflow="fold", min_width=8)
    table.add_column("", no_wrap=True)
    heads = _heads(outcomes)
    for head in heads:
        table.add_column(Text(head), justify="right", overflow="fold")
    for outcome in outcomes:
        style = "red" if outcome.status is Status.FAILED else ""
        cells = [Text(_shown(outcome.row.get(head))) for head in heads]
        table.add_row(Text(outcome.subject), Text(outcome.status, style=style), *cells)
    console().print(table)


def write_csv(file: Path, outcomes: Sequence[Outcome]) -> None:
    """The table, with the reasons of failures."""
    heads = _heads(outcomes)
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["subject", "status", "seconds", *heads, "reason"])
    for outcome in outcomes:
        values = ["" if outcome.row.get(head) is None else outcome.row[head] for head in heads]
        rows.writerow([outcome.subject, outcome.status, f"{outcome.seconds:.1f}", *values, outcome.reason])
    write_whole(file, text.getvalue())


def _heads(outcomes: Sequence[Outcome]) -> list[str]:
    return list(dict.fromkeys(head for outcome in outcomes for head in outcome.row))


def _shown(value: str | float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


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
        open_subject(folder)
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
    outcomes: dict[str, Outcome] = {}

    def done(_: str, outcome: Outcome | None) -> None:
        assert outcome is not None
        outcomes[outcome.subject] = outcome
        count = len(root.names)
        say(f"{len(outcomes):>{len(str(count))}}/{count}  {line_of(outcome)}")
        for warning in outcome.warnings:
            say(f"    {warning}")

    with tempfile.TemporaryDirectory() as scratch:
        do = partial(_one, root, work, Path(scratch), _environment(jobs))
        Processes(jobs).run(root.names, do, done)
    return [outcomes[name] for name in root.names] + _broken(root)


def write_outcomes(outcomes: Sequence[Outcome], json: Path | None, csv: Path | None) -> None:
    """Write what became of each subject, with its figures."""
    if json is not None:
        write_json(json, {"subjects": [outcome.as_json() for outcome in outcomes]})
    if csv is not None:
        write_csv(csv, outcomes)


def _one(
    root: RootFolder,
    work: Work,
    scratch: Path,
    environment: dict[str, str],
    name: str,
    start: Start,
) -> Outcome:
    began, folder = time.monotonic(), root.path / name
    try:
        figures = work.kept(folder)
        row = {} if figures is None else work.row(figures, "")
    except Exception:  # the command itself says what is wrong, in its own process
        figures = None
    if figures is not None:
        return Outcome(name, Status.KEPT, time.monotonic() - began, "", row, figures)
    figures_file = scratch / f"{root.names.index(name)}.json"
    words = ["addb_viewer", work.command, str(folder), *work.words]
    if work.out is not None:
        words += ["--out", str(work.out / name)]
    if work.has_json:
        words += ["--json", str(figures_file)]
    ended = start(words, environment)
    seconds = time.monotonic() - began
    figures = json_content(figures_file) if figures_file.is_file() else {}
    row = work.row(figures, ended.said) if figures or not (ended.status or work.has_json) else {}
    warnings = tuple(line for line in ended.said.splitlines() if line.startswith("! "))
    if ended.status:
        return Outcome(name, Status.FAILED, seconds, ended.reason, row, figures, warnings)
    kept = bool(work.unchanged) and work.unchanged in ended.said
    status = Status.KEPT if kept else Status.DONE
    return Outcome(name, status, seconds, ended.own_words, row, figures, warnings)


def _environment(jobs: int) -> dict[str, str]:
    """That of the processes: together they use no more threads than there are cores."""
    if jobs == 1:
        return {}
    each = str(max(1, (os.cpu_count() or 1) // jobs))
    return {name: each for name in THREADS if name not in os.environ}


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


SubjectOrRoot = Annotated[
    Path,
    typer.Argument(
        metavar="SUBJECT",
        help="A subject's folder, a .b3d file, or a folder of several subjects.",
        callback=subject_folder_of,
    ),
]
Jobs = Annotated[
    int, typer.Option("--jobs", metavar="N", help="Of several subjects, how many at a time.", min=1)
]
CsvFile = Annotated[
    Path | None, file_to_write("--csv", "Of several subjects, write a line each as CSV.", written)
]


def check_one(csv: Path | None, jobs: int) -> None:
    """Refuse of one subject what is for several."""
    if csv is not None:
        raise typer.BadParameter("is a table of several subjects; this is one", param_hint="--csv")
    if jobs > 1:
        raise typer.BadParameter("is for several subjects; this is one", param_hint="--jobs")


def run_on_all(root: RootFolder, work: Work, jobs: int, json: Path | None, csv: Path | None) -> None:
    """Run a command on all subjects, print the table and the failures, and end with a status.

    Raises:
        Exit: some failed, or it was stopped.
    """
    try:
        outcomes = done_to_all(root, work, jobs, typer.echo)
    except KeyboardInterrupt as stop:
        typer.echo("addb-viewer: stopped; what was finished is kept, and the same command goes on", err=True)
        raise typer.Exit(STOPPED) from stop
    print_table(outcomes)
    write_outcomes(outcomes, json, csv)
    failed = [outcome for outcome in outcomes if outcome.status is Status.FAILED]
    for outcome in failed:
        typer.echo(f"addb-viewer: {outcome.subject}: {outcome.reason}", err=True)
    if failed:
        typer.echo(f"addb-viewer: {len(failed)} of {len(outcomes)} subjects failed, see above", err=True)
        raise typer.Exit(FAILED)
