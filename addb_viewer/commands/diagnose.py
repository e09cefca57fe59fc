"""`addb-viewer diagnose`, `detect`, `accept` and `reject`: what is wrong, and what is decided about it."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

import typer
from rich import box
from rich.table import Table

from addb_viewer.commands.decide import Author, author_named
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
    SubjectFolder,
    Trials,
)
from addb_viewer.jobs.accepting import Accepted, accepted, exchange_in_words, rejected
from addb_viewer.jobs.command_errors import errors_as_lines
from addb_viewer.jobs.diagnosing import diagnosed, kept_of
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.solving import Job, job_for, judged, last_fit
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.text.diagnosis_vocabulary import capital, title
from addb_viewer.text.diagnosis_words import page, screen
from addb_viewer.text.evidence_words import evidence_words
from addb_viewer.text.extension_words import what_accepting_changes
from addb_viewer.text.sections import Section, as_text
from addb_viewer.text.summary_table import console
from annotations.wording import sure_words
from solver.common.typed_json import plain
from solver.contact.detected_ranges import missing_force
from solver.contact.detection import detect as proposals_for
from solver.contact.detection_settings import DetectionSettings
from solver.diagnosis.causes.catalogue import IDS, MARKER_IDS
from solver.diagnosis.diagnosis_report import Decided, DiagnosisReport, Rival
from solver.dynamics.trajectory.extension import Cause
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.results.extension_log import ACCEPT
from solver.fitting.results.store import write_json

WIDTH_OF_A_PIPE = 250  # [characters] where no terminal says how wide it is


def detect(
    subject: SubjectFolder,
    trial: Trials = None,
    settings: SettingsFile = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """List the frames whose force is missing or wrong: which foot's, why, and how sure that is."""
    with errors_as_lines(debug):
        job = job_for(subject, trials=trial, settings_file=settings)
        with terminal_progress() as progress:
            fit = judged(job, progress)
        figures = [_figures(t, fit, job.settings.detection) for t in fit.trials]
        if json is not None:
            write_json(json, {"trials": figures})
        for figure in figures:
            _print(figure)


def _figures(trial: TrialFit, fit: Fit, settings: DetectionSettings) -> dict[str, Any]:
    """In the shape of `detect --json`."""
    feet = trial.contacts.foot_bodies if trial.contacts else fit.subject.foot_bodies
    # a fit has nothing to judge there
    without_plates = trial.contacts is None or not trial.contacts.has_plates
    proposals = trial.proposals
    if without_plates:
        proposals = proposals_for(fit.skeleton, trial.motion, None, (), settings=settings)
    missing = missing_force(proposals, feet, trial.motion.frames, settings.confidence)
    return {
        "name": trial.capture.name,
        "frames": trial.motion.frames,
        "missing": [
            {
                "range": list(p.range),
                "foot": p.foot,
                "reason": p.reason,
                "confidence": p.confidence,
                "evidence": p.evidence,
            }
            for p in proposals
        ],
        "mask": missing.any(axis=1).tolist(),
    }


def _print(figures: dict[str, Any]) -> None:
    lost = sum(figures["mask"])
    typer.echo(f"{figures['name']}: force is missing on {lost} of {figures['frames']} frames")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for head in ("frames", "foot", "reason", "sure", "because"):
        table.add_column(head, no_wrap=True)
    for proposal in figures["missing"]:
        start, end = proposal["range"]
        sure, numbers = sure_words(proposal["confidence"]), evidence_words(proposal["evidence"])
        table.add_row(f"{start}:{end}", proposal["foot"] or "all", proposal["reason"], sure, numbers)
    if table.row_count:
        console(WIDTH_OF_A_PIPE).print(table)


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
                held = kept_of(job_of(folder, out and out / folder.relative_to(place)))
                return None if held is None else held.as_json()

            run_on_all(root, Work("diagnose", words, out, key_findings, kept=still_true), jobs, json, csv)
            return
        check_one(csv, jobs)
        job = job_of(subject, out)
        with terminal_progress() as progress:
            figures, file = diagnosed(job, progress, why)
        if json is not None:
            write_json(json, figures.as_json())
        if why is None:
            print_diagnosis(figures, file, full=full)
        else:
            for line in as_text(decisions_on(figures, why)):
                typer.echo(line)


def key_findings(figures: dict[str, Any], _: str = "") -> Row:
    """A subject's verdict and causes in a row."""
    named = [f"{effect['id']} ({effect['target']})" for effect in figures["effects"]]
    return {"trials": len(figures["trials"]), "verdict": figures["verdict"], "causes": "; ".join(named)}


def print_diagnosis(figures: DiagnosisReport, file: Path, *, full: bool = False) -> None:
    """A screen, or the whole page, on stdout, and where the figures are."""
    for line in as_text(page(figures) if full else screen(figures)):
        typer.echo(line)
    typer.echo(f"\nwritten: {file}{'' if full else '; --full says more'}")


def decisions_on(figures: DiagnosisReport, id: str) -> list[Section]:
    """Of each place at which a cause was tried: what every check said, up to the one at which it fell.

    Args:
        figures: made with this id.
        id: of the cause.
    """
    tried = [_told(one) for one in figures.decisions if one.id == id]
    return tried or [Section(f"{id}: not tried", (IN_MARKERS if id in MARKER_IDS else NEVER_PROPOSED,))]


def _told(one: Decided) -> Section:
    fell = next((c.name for c in one.checks if not c.passed), None)
    verdict = "named" if one.named else f"fell at '{fell}'"
    rows = tuple((c.name if c.passed else f"{c.name}, no", c.reason) for c in one.checks)
    return Section(f"{capital(title(Rival(one.id, one.target)))}: {verdict}", (), rows)


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
    with errors_as_lines(debug):
        job = job_for(
            subject, out=out, settings_file=settings, ignore_review=ignore_review, without_extension=True
        )
        by = author_named(author)
        with terminal_progress() as progress:
            done = accepted(job, by=by, only=_meant(cause, job.results), progress=progress)
        if json is not None:
            write_json(json, plain(done.gain))
        if done.file is not None:
            for line in as_text([what_accepting_changes(done.gain)]):
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
    diagnosis = kept(results)
    named = [(effect.id, effect.target) for effect in diagnosis[0].effects] if diagnosis else []
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
