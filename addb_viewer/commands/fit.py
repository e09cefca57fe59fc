"""`addb-viewer fit`: kinematics and dynamics of a subject; the results are kept and summed up."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
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
    Force,
    IgnoreReview,
    JsonFile,
    MapFile,
    Out,
    SettingsFile,
    Trials,
    WithoutExtension,
)
from addb_viewer.jobs.command_errors import FAILED, errors_as_lines
from addb_viewer.jobs.solving import job_for, solved
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.text.note_words import by_kind
from addb_viewer.text.summary_table import print_summary
from addb_viewer.trial_view.kept_verdicts import kept_verdicts
from addb_viewer.trial_view.trial_verdict import TrialVerdict
from solver.capture.capture import UnusedFile
from solver.capture.formats.text_table import some_of
from solver.common.typed_json import from_plain, plain
from solver.fitting.fit_result import Fit
from solver.fitting.fit_summary import FitSummary
from solver.fitting.results.store import write_json
from solver.fitting.summary import summary

Notes = Annotated[
    bool,
    typer.Option("--notes", help="Print all that was noted, and every file that is not used, and why."),
]
NAMED = 3  # in one line


def fit(
    subject: SubjectOrRoot,
    out: Out = None,
    trial: Trials = None,
    settings: SettingsFile = None,
    map_: MapFile = None,
    ignore_review: IgnoreReview = False,
    without_extension: WithoutExtension = False,
    force: Force = False,
    json: JsonFile = None,
    notes: Notes = False,
    jobs: Jobs = 1,
    csv: CsvFile = None,
    debug: Debug = False,
) -> None:
    """Fit the skeleton to a subject's recordings, keep the results and print the summary.

    Unchanged inputs are not solved again; where only flags changed, the fit begins at the kept one. With
    --trial a kept fit that has other trials as well stays.

    Of a folder of several subjects each is fitted in a process of its own; what fails is told at the end.
    """
    with errors_as_lines(debug):
        root = several(subject)
        if root is not None:
            words = options(
                trial=trial,
                settings=settings and settings.absolute(),
                map_=map_ and map_.absolute(),
                ignore_review=ignore_review,
                without_extension=without_extension,
                force=force,
                debug=debug,
            )
            work = Work("fit", words, out, key_findings, unchanged="unchanged: kept fit of")
            run_on_all(root, work, jobs, json, csv)
            return
        check_one(csv, jobs)
        job = job_for(
            subject,
            out=out,
            trials=trial,
            settings_file=settings,
            map_file=map_,
            ignore_review=ignore_review,
            without_extension=without_extension,
        )
        with terminal_progress() as progress:
            done = solved(job, force=force, progress=progress)
        fit = replace(done.fit, subject=replace(done.fit.subject, unused=job.subject.unused))
        figures = summary(fit, files=[str(path) for path in done.files])
        if json is not None:
            write_json(json, plain(figures))
        reviewed = done.files and not ignore_review
        good_for = _good_for(kept_verdicts(job.subject, job.results)) if reviewed else []
        if good_for and out is None:
            good_for.append(f"next: addb-viewer open {shlex.quote(str(subject))}")
        print_summary(
            figures if done.new else replace(figures, files=()),
            notes=notes,
            closing=[*unused_lines(fit.unused, whole=notes), *filter(None, [done.said]), *good_for],
        )
        if fit.unread:
            for unread in fit.unread:
                typer.echo(f"addb-viewer: {unread.file.file}: {unread.file.reason}", err=True)
            typer.echo(f"addb-viewer: fitted without {_counted(fit)}, see above", err=True)
            raise typer.Exit(FAILED)


def key_findings(figures: dict[str, Any], _: str = "") -> Row:
    """A subject's figures, as `fit --json` wrote them, in a row: of all trials, the worst."""
    found = from_plain(figures, FitSummary)
    trials = found.trials

    def worst(values: Iterable[float | None]) -> float | None:
        return max((value for value in values if value is not None), default=None)

    rms = worst(trial.marker_rms_m for trial in trials)
    return {
        "mass kg": found.subject.mass_kg,
        "trials": len(trials),
        "frames": sum(trial.frames for trial in trials),
        "used": sum(trial.frames_with_force_used for trial in trials),
        "marker RMS cm": None if rms is None else 100 * rms,
        "force BW": worst(trial.force_BW for trial in trials),
        "moment BW·h": worst(trial.moment_BWh for trial in trials),
        "to decide": sum(kind.needs_decision for kind in by_kind(found.notes)),
    }


def _good_for(verdicts: Mapping[str, TrialVerdict]) -> list[str]:
    """What each trial is good for, as the app's first line; of more than a few, which are good for what."""
    if len(verdicts) <= NAMED:
        return [f"{name}: {verdict.line.text}" for name, verdict in verdicts.items()]
    trials: dict[str, list[str]] = {}
    for name, verdict in verdicts.items():
        trials.setdefault(f"{verdict.line.sign} {verdict.line.use}", []).append(name)
    return [f"{use}: {some_of(names)}" for use, names in trials.items()]


def _counted(fit: Fit) -> str:
    """How many of the wanted trials could not be read."""
    trials = [trial.name for trial in fit.unread if trial.name]
    said = [f"{len(trials)} of {len(trials) + len(fit.trials)} trials"] if trials else []
    if len(trials) < len(fit.unread):
        said.append("the static trial")
    return " and ".join(said)


def unused_lines(files: Sequence[UnusedFile], *, whole: bool) -> list[str]:
    """Which files of a subject's folder are not used, the most harmful first.

    Args:
        files: as `open_subject` found them.
        whole: each with its reason.
    """
    if not files:
        return []
    count = f"{len(files)} file{'s' * (len(files) > 1)} of the folder not used"
    if whole:
        return [f"{count}:", *(f"  {file.file}: {file.reason}" for file in files)]
    more = ", …" if len(files) > NAMED else ""
    reasons = {file.reason for file in files}
    why = f" ({reasons.pop()})" if len(reasons) == 1 else "; --notes says why"
    return [f"{count}: {', '.join(file.file for file in files[:NAMED])}{more}{why}"]
