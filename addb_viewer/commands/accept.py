"""`addb-viewer accept` and `reject`: whether later fits are to use the causes that the diagnosis named."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, IgnoreReview, JsonFile, Out, SettingsFile, SubjectFolder
from addb_viewer.commands.reviewing import Author, author_named
from addb_viewer.jobs.accepted_exchanges import exchange_in_words
from addb_viewer.jobs.accepting import Accepted, accepted, rejected
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.solving import job_for, last_fit
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.text.extension_words import what_accepting_changes
from addb_viewer.text.sections import as_text
from solver.dynamics.trajectory.extension import Cause
from solver.fitting.fit import Fit
from solver.fitting.results.extension_log import ACCEPT
from solver.fitting.results.store import write_json

ALONE = "fits use the recorded forces alone"
Causes = Annotated[
    list[str] | None,
    typer.Option(
        "--cause",
        metavar="ID[:TARGET]",
        help="This cause alone, as `clock_offset:all`; may be given several times. What was decided about "
        "others stays.",
    ),
]


def accept(
    subject: SubjectFolder,
    cause: Causes = None,
    out: Out = None,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    author: Author = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Accept the causes of the last diagnosis: from now on fits use them beside the recorded forces.

    The trajectories are fitted without and with them, and what that gains is told. Exchanged labels are
    exchanged back in every fit; a slip and soft tissue lie in the markers alone and cannot be part of it.
    """
    if json is not None and not json.absolute().parent.is_dir():
        raise typer.BadParameter(f"no folder {json.parent} to write into", param_hint="--json")
    with errors_as_lines(debug):
        job = job_for(
            subject, out=out, settings_file=settings, ignore_review=ignore_review, without_extension=True
        )
        by = author_named(author)
        with terminal_progress() as progress:
            done = accepted(job, by=by, only=_meant(cause, job.results), progress=progress)
        if json is not None:
            write_json(json, done.told)
        if done.file is not None:
            for line in as_text([what_accepting_changes(done.told)]):
                typer.echo(line)
            typer.echo()
        _tell(done, last_fit(job))


def reject(
    subject: SubjectFolder,
    cause: Causes = None,
    out: Out = None,
    author: Author = None,
    debug: Debug = False,
) -> None:
    """Reject the causes of the last diagnosis: from now on fits use the recorded forces alone.

    With `--cause` that one alone; others that are accepted stay so, and are fitted once more without it.
    """
    with errors_as_lines(debug):
        job = job_for(subject, out=out, without_extension=True)
        by = author_named(author)
        with terminal_progress() as progress:
            decision = rejected(job, by=by, only=_meant(cause, job.results), progress=progress)
        refused = decision.rejected if decision.kind == ACCEPT else decision.causes
        rest = f"fits use {_listed(decision.causes)}" if decision.kind == ACCEPT else ALONE
        typer.echo(f"rejected by {by}: {_listed(refused) or 'the diagnosis'}; {rest}")


def _listed(causes: Sequence[Cause]) -> str:
    return ", ".join(f"{cause.id} ({cause.target})" for cause in causes)


def _meant(said: list[str] | None, results: Path) -> list[tuple[str, str]] | None:
    """Ids and targets of the causes that somebody named; an id alone where only one cause has it."""
    if not said:
        return None
    figures, _ = kept(results) or ({"effects": []}, {})
    named = [(effect["id"], effect["target"]) for effect in figures["effects"]]
    meant = []
    for text in said:
        id_, colon, target = text.partition(":")
        found = [key for key in named if key[0] == id_ and (not colon or key[1] == target)]
        if len(found) > 1:
            listed = ", ".join(f"{one}:{of}" for one, of in found)
            raise typer.BadParameter(f"'{text}' is several causes: {listed}", param_hint="--cause")
        meant.append(found[0] if found else (id_, target))
    return meant


def _tell(done: Accepted, fit: Fit | None) -> None:
    """What was decided; of exchanged labels, whether the last fit exchanged them without being told."""
    typer.echo(f"accepted by {done.by}: {done.extension.sentence}; the next fit uses it")
    for exchange in done.extension.exchanges:
        typer.echo(exchange_in_words(exchange, fit))
    if done.left_out:
        typer.echo(f"left out, because they lie in the markers alone: {', '.join(done.left_out)}")
    for causes, why in (
        (done.undone, "reading the files puts it right in every fit"),
        (done.flagged, "its frames are flagged, and no fit uses them"),
    ):
        if causes:
            listed = ", ".join(f"{id_} ({target})" for id_, target in causes)
            typer.echo(f"left out, because {why}: {listed}")
    if done.file is not None:
        typer.echo(f"written: {done.file}")
