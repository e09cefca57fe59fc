"""`addb-viewer recover` and `restore`: what a session log still holds, and its edits back in the store."""

from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.commands.reviewing import tell_unreadable
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.review_store import open_log
from addb_viewer.jobs.reviewing import capture_of, subject_in, trial_of
from addb_viewer.jobs.subject_checks import check_trials
from addb_viewer.recordings.mcap_recovery import Found
from addb_viewer.recordings.mcap_recovery import recover as recovered
from addb_viewer.recordings.restoring import check_identity, edits_in
from addb_viewer.recordings.restoring import restore as restored
from solver.capture.capture import Subject
from solver.common.errors import CaptureError, ResultsError

McapFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="An MCAP file that this program wrote, cut or whole.")
]
WholeFile = Annotated[
    Path | None,
    typer.Option("--out", metavar="FILE", help="Where to; FILE.recovered.mcap by default.", dir_okay=False),
]


def recover(file: McapFile, out: WholeFile = None, debug: Debug = False) -> None:
    """Write a whole MCAP file with everything that can be read of one whose writer was killed."""
    with errors_as_lines(debug):
        to = out or file.with_name(f"{file.stem}.recovered.mcap")
        if to.exists():
            raise ResultsError(f"{to}: is there already and stays as it is; name another with --out")
        typer.echo(_said(file, recovered(file, to)))
        typer.echo(to)


def restore(file: McapFile, subject: SubjectFolder, debug: Debug = False) -> None:
    """Put the edits that a session log holds into the subject's review, those that it lacks."""
    with errors_as_lines(debug):
        opened, edits = subject_in(subject), edits_in(file)
        if not edits:
            raise ResultsError(f"{file}: holds no edits of a review")
        names = sorted({edit.trial for edit in edits})
        check_trials(opened, names)
        check_identity(file, edits, opened.name, _frames(opened, names))
        with open_log(subject) as log:
            done = restored(edits, log)
            tell_unreadable(log)
        typer.echo(f"edits restored: {done.added}; there already: {done.there}")
        if done.added and not done.with_dates:
            typer.echo("note: they stand behind the edits that were there, under the date of now")


def _frames(subject: Subject, trials: list[str]) -> dict[str, int]:
    frames = {}
    for name in trials:
        with suppress(CaptureError):  # a trial that cannot be read gets its edits back all the same
            frames[name] = capture_of(subject, trial_of(subject, name)).markers.frames
    return frames


def _said(file: Path, found: Found) -> str:
    state = "whole" if found.is_whole else "cut"
    last = datetime.fromtimestamp(found.last_time_ns / 1e9, UTC)
    damaged = f", {found.damaged_chunks} chunks cannot be read" if found.damaged_chunks else ""
    until = f"; the last at {last:%Y-%m-%d %H:%M:%S} UTC" if last.year > 1970 else ""
    return (
        f"{file}: {state}; {found.messages.total()} messages on {len(found.messages)} topics "
        f"in {found.chunks} chunks, {found.attachments} attachments{damaged}{until}"
    )
