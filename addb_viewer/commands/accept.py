"""`addb-viewer accept` and `reject`: whether later fits are to use the causes that the diagnosis named."""

import typer

from addb_viewer.accepted_exchanges import exchange_in_words
from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, IgnoreReview, JsonFile, Out, SettingsFile, SubjectFolder
from addb_viewer.commands.reviewing import Author, author_named
from addb_viewer.extension_words import what_accepting_changes
from addb_viewer.jobs.accepting import Accepted, accepted, rejected
from addb_viewer.jobs.solving import job_for, last_fit
from addb_viewer.sections import as_text
from addb_viewer.terminal_progress import terminal_progress
from solver.fit import Fit
from solver.results.store import write_json


def accept(
    subject: SubjectFolder,
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
            done = accepted(job, by=by, progress=progress)
        if json is not None:
            write_json(json, done.told)
        if done.file is not None:
            for line in as_text([what_accepting_changes(done.told)]):
                typer.echo(line)
            typer.echo()
        _tell(done, last_fit(job))


def reject(
    subject: SubjectFolder,
    out: Out = None,
    author: Author = None,
    debug: Debug = False,
) -> None:
    """Reject the causes of the last diagnosis: from now on fits use the recorded forces alone."""
    with errors_as_lines(debug):
        job = job_for(subject, out=out, without_extension=True)
        by = author_named(author)
        decision = rejected(job, by=by)
        said = ", ".join(f"{c.id} ({c.target})" for c in decision.causes) or "the diagnosis"
        typer.echo(f"rejected by {by}: {said}; fits use the recorded forces alone")


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
