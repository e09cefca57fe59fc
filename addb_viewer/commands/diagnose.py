"""`addb-viewer diagnose`: what is wrong with a subject's recordings, why, and what to do about it."""

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

import typer

from addb_viewer.commands.many import (
    CsvFile,
    Jobs,
    Row,
    SubjectOrRoot,
    Work,
    check_one,
    options,
    run_on_all,
    several,
)
from addb_viewer.commands.options import (
    Debug,
    IgnoreReview,
    JsonFile,
    Out,
    SettingsFile,
    Trials,
)
from addb_viewer.jobs.diagnosing import diagnosed, kept_of
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.solving import Job, job_for
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.text.diagnosis_vocabulary import capital, title
from addb_viewer.text.diagnosis_words import page, screen
from addb_viewer.text.sections import Section, as_text
from solver.diagnosis.causes.catalogue import IDS, MARKER_IDS
from solver.fitting.results.store import write_json

CAUSES = (*IDS, *MARKER_IDS)
Why = Annotated[
    str | None,
    typer.Option(
        "--why",
        metavar="ID",
        help="Say what was decided on a cause, and why, in place of the whole answer.",
    ),
]

Full = Annotated[
    bool,
    typer.Option("--full", help="Print the whole answer: direct checks, certainty, what else it could be."),
]
IN_MARKERS = "It is sought in the markers, before forces; what was found there stands in the whole answer."
NEVER_PROPOSED = (
    "It was never proposed: at every step of the search others promised more, or this recording has no place "
    "for it, or of the size that would help there is no such thing."
)

Figures = Mapping[str, Any]


def diagnose(
    subject: SubjectOrRoot,
    out: Out = None,
    trial: Trials = None,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    json: JsonFile = None,
    why: Why = None,
    full: Full = False,
    jobs: Jobs = 1,
    csv: CsvFile = None,
    debug: Debug = False,
) -> None:
    """Say what is wrong with the recordings, name the cause, and say how sure that is.

    Trials are looked at together: they share plates, clocks and the person's masses.
    """
    if json is not None and not json.absolute().parent.is_dir():
        raise typer.BadParameter(f"no folder {json.parent} to write into", param_hint="--json")
    if why is not None and why not in CAUSES:
        near = get_close_matches(why, CAUSES, n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise typer.BadParameter(f"no cause has the id '{why}'{hint}", param_hint="--why")
    with errors_as_lines(debug):

        def job_of(folder: Path, results: Path | None) -> Job:
            return job_for(
                folder,
                out=results,
                trials=trial,
                settings_file=settings,
                ignore_review=ignore_review,
                without_extension=True,
            )

        root = several(subject)
        if root is not None:
            if why is not None:
                raise typer.BadParameter("of one subject only", param_hint="--why")
            place, words = (
                root.path,
                options(
                    trial=trial,
                    settings=settings and settings.absolute(),
                    ignore_review=ignore_review,
                    debug=debug,
                ),
            )

            def still_true(folder: Path) -> dict[str, Any] | None:
                return kept_of(job_of(folder, out and out / folder.relative_to(place)))

            run_on_all(root, Work("diagnose", words, out, key_findings, kept=still_true), jobs, json, csv)
            return
        check_one(csv, jobs)
        job = job_of(subject, out)
        with terminal_progress() as progress:
            figures, file = diagnosed(job, progress, why)
        if json is not None:
            write_json(json, figures)
        if why is None:
            print_diagnosis(figures, file, full=full)
        else:
            for line in as_text(decisions_on(figures, why)):
                typer.echo(line)


def key_findings(figures: dict[str, Any], _: str = "") -> Row:
    """A subject's verdict and causes in a row."""
    named = [f"{effect['id']} ({effect['target']})" for effect in figures["effects"]]
    return {"trials": len(figures["trials"]), "verdict": figures["verdict"], "causes": "; ".join(named)}


def print_diagnosis(figures: Mapping[str, Any], file: Path, *, full: bool = False) -> None:
    """A screen, or the whole page, on stdout, and where the figures are."""
    for line in as_text(page(figures) if full else screen(figures)):
        typer.echo(line)
    typer.echo(f"\nwritten: {file}{'' if full else '; --full says more'}")


def decisions_on(figures: Figures, id: str) -> list[Section]:
    """Of each place at which a cause was tried: what every check said, up to the one at which it fell.

    Args:
        figures: in the shape of `diagnose --json`, made with this id.
        id: of the cause.
    """
    tried = [_told(one) for one in figures.get("decisions", ()) if one["id"] == id]
    return tried or [Section(f"{id}: not tried", (IN_MARKERS if id in MARKER_IDS else NEVER_PROPOSED,))]


def _told(one: Figures) -> Section:
    fell = next((c["name"] for c in one["checks"] if not c["passed"]), None)
    verdict = "named" if one["named"] else f"fell at '{fell}'"
    rows = tuple((c["name"] if c["passed"] else f"{c['name']}, no", c["reason"]) for c in one["checks"])
    return Section(f"{capital(title(one))}: {verdict}", (), rows)
