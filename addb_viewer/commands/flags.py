"""`addb-viewer flags` and `agreement`: what people have flagged, and how far two of them agree."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from addb_viewer.commands.decide import described, tell_unreadable, unreadable_figures
from addb_viewer.commands.options import Debug, JsonFile, SubjectFolder, file_to_write, replaceable
from addb_viewer.jobs.command_errors import errors_as_lines
from addb_viewer.jobs.review_store import has_log, open_log
from addb_viewer.jobs.reviewing import capture_of, subject_in, trial_of
from annotations.agreement import Agreement
from annotations.agreement import agreement as compared
from annotations.events import Status
from annotations.folding import folded
from annotations.log import ReviewLog
from annotations.ranges_csv import ranges_csv
from annotations.review_errors import ReviewError
from annotations.review_json import export_labels, lost_in_review_json
from annotations.trial_review import ActivityRange, ClearedRange, FlaggedRange, TrialReview
from solver.capture.atomic import write_whole
from solver.capture.capture import Subject, TrialFiles

OneTrial = Annotated[str | None, typer.Argument(metavar="[TRIAL]", help="This trial only.")]
CsvFile = Annotated[Path | None, file_to_write("--csv", "Write the ranges as CSV.", replaceable)]
ReviewFolder = Annotated[
    Path | None,
    typer.Option(
        "--review-json", metavar="DIR", help="Write AddBiomechanics' review.json here.", file_okay=False
    ),
]
History = Annotated[bool, typer.Option("--history", help="List every edit, with its number and date.")]


def flags(
    subject: SubjectFolder,
    trial: OneTrial = None,
    json: JsonFile = None,
    csv: CsvFile = None,
    review_json: ReviewFolder = None,
    history: History = False,
    debug: Debug = False,
) -> None:
    """List the flagged ranges of a subject, who flagged them, and where reviewers disagree."""
    with errors_as_lines(debug):
        opened = subject_in(subject)
        trials = [trial_of(opened, trial)] if trial is not None else list(opened.trials)
        reviews = _reviews(opened, trials, history, trial)
        if json is not None:
            from solver.fitting.results.store import write_json  # noqa: PLC0415 (slow to load)

            write_json(json, {"trials": [_figures(review) for review in reviews]})
        if csv is not None:
            write_whole(csv, ranges_csv(reviews))
        if review_json is not None:
            for review, files in zip(reviews, trials, strict=True):
                _export(opened, review, files, review_json)


def _export(subject: Subject, review: TrialReview, files: TrialFiles, folder: Path) -> None:
    if not review.decided:
        typer.echo(f"note: {review.trial}: nobody has reviewed it here; no review.json written")
        return
    for path in export_labels(review, capture_of(subject, files).markers.frames, folder):
        typer.echo(path)
    if review.status is not Status.FINISHED:
        typer.echo(
            f"note: {review.trial}: not finished; what detection alone leaves out is not in its review.json"
        )
    lost = lost_in_review_json(review)
    if lost:
        typer.echo(f"note: {review.trial}: review.json has no place for {', '.join(lost)}; --csv has")


def _reviews(
    subject: Subject, trials: list[TrialFiles], history: bool, only: str | None
) -> list[TrialReview]:
    """The reviews of the trials, each printed as soon as it is read; then what cannot be read."""
    if not has_log(subject.folder):
        reviews = [folded(trial.name, (), subject.foot_bodies) for trial in trials]
        for review, trial in zip(reviews, trials, strict=True):
            _print(review, trial)
        return reviews
    with open_log(subject.folder) as log:
        reviews = []
        for trial in trials:
            if history:
                for edit in log.history(trial.name):
                    typer.echo(f"{trial.name}: {described(edit)}")
            reviews.append(log.review(trial.name, subject.foot_bodies))
            _print(reviews[-1], trial)
        tell_unreadable(log, only)
    return reviews


def _print(review: TrialReview, files: TrialFiles) -> None:
    about = ", ".join(filter(None, (review.status_author, review.status_note)))
    by = f" ({about})" if about else ""
    flags = (*review.flags, *(review.stays_out or ()))
    nothing = "" if flags else ", nothing flagged"
    own = "its review.json" if files.reviews else f"the review in {files.markers.name}"
    decides = f", {own} decides" if files.has_review and not review.is_imported else ""
    typer.echo(f"{review.trial}: {review.status}{by}{nothing}{decides}")
    rows = [_row(flag) for flag in flags]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        typer.echo("  " + "  ".join(map(str.ljust, row, widths)).rstrip())
    for activity in review.activities:
        by = f"({activity.author}, edit {activity.edit})"
        line = f"  {activity.start}:{activity.end}  {activity.label} {by}  {activity.note}"
        typer.echo(line.rstrip())
    for conflict in review.conflicts:
        typer.echo(f"note: {review.trial}: {conflict}")


def _row(flag: FlaggedRange) -> tuple[str, ...]:
    sure = "" if flag.confidence is None else f" {flag.confidence:.2f}"
    return (
        f"{flag.start}:{flag.end}",
        flag.foot or "both",
        flag.reason,
        f"{flag.source}{sure} ({flag.author}, edit {flag.edit})",
        flag.note,
    )


def _figures(review: TrialReview) -> dict[str, Any]:
    return {
        "name": review.trial,
        "status": review.status.value,
        "status_author": review.status_author,
        "status_note": review.status_note,
        "missing": [_flag(flag) for flag in review.flags],
        "stays_out": None if review.stays_out is None else [_flag(flag) for flag in review.stays_out],
        "cleared": [_range(one, "foot", "source", "author", "edit", "note") for one in review.cleared],
        "activities": [
            _range(one, "activity", "subclass", "author", "edit", "note") for one in review.activities
        ],
        "conflicts": [str(conflict) for conflict in review.conflicts],
        "unreadable": unreadable_figures(review.unreadable),
    }


def _flag(flag: FlaggedRange) -> dict[str, Any]:
    return _range(flag, "foot", "reason", "source", "author", "edit", "note", "confidence", "detector")


def _range(one: FlaggedRange | ClearedRange | ActivityRange, *names: str) -> dict[str, Any]:
    return {"range": [one.start, one.end], **{name: getattr(one, name) for name in names}}


Reviewer = Annotated[str, typer.Argument(metavar="REVIEWER", help="Name of a reviewer, or imported.")]


def agreement(
    subject: SubjectFolder, one: Reviewer, other: Reviewer, json: JsonFile = None, debug: Debug = False
) -> None:
    """Compare two reviewers' flags, and activities, on the trials that both have judged."""
    with errors_as_lines(debug):
        opened = subject_in(subject)
        if not has_log(subject):
            raise ReviewError(f"{subject}: nobody has flagged anything yet")
        with open_log(subject) as log:
            tell_unreadable(log)
            trials = _common_trials(log, opened, one, other)
            found = [_compared(log, opened, trial, (one, other)) for trial in trials]
        for figures in found:
            typer.echo(f"{figures['name']}: {_line(figures)}")
            if figures["activities"] is not None:
                typer.echo(f"{figures['name']}, activities: {_line(figures['activities'])}")
        if json is not None:
            from solver.fitting.results.store import write_json  # noqa: PLC0415 (slow to load)

            write_json(json, {"reviewers": [one, other], "trials": found})


def _common_trials(log: ReviewLog, subject: Subject, one: str, other: str) -> list[str]:
    edits = log.history()
    for name in (one, other):
        known = sorted({edit.author for edit in edits})
        if name not in known:
            raise ReviewError(f"{subject.folder}: no reviewer '{name}'; reviewers: {', '.join(known)}")
    judged = {name: {edit.trial for edit in edits if edit.author == name} for name in (one, other)}
    common = [trial.name for trial in subject.trials if trial.name in judged[one] & judged[other]]
    if not common:
        raise ReviewError(f"{subject.folder}: no trial has edits of both {one} and {other}")
    return common


def _compared(log: ReviewLog, subject: Subject, trial: str, reviewers: tuple[str, str]) -> dict[str, Any]:
    files = next(files for files in subject.trials if files.name == trial)
    frames = capture_of(subject, files).markers.frames
    opinions = [log.review(trial, subject.foot_bodies, by=name) for name in reviewers]
    one, other = (opinion.missing(frames) for opinion in opinions)
    unreadable = dict.fromkeys(row for opinion in opinions for row in opinion.unreadable)
    figures = {
        "name": trial,
        **_agreement_figures(compared(one, other)),
        "activities": None,
        "unreadable": unreadable_figures(tuple(unreadable)),
    }
    if all(opinion.activities for opinion in opinions):
        one, other = (opinion.activity_labels(frames)[:, None] for opinion in opinions)
        figures["activities"] = _agreement_figures(compared(one, other))
    return figures


def _agreement_figures(found: Agreement) -> dict[str, Any]:
    return {
        "kappa": None if math.isnan(found.kappa) else found.kappa,
        "same": found.same,
        "differ": [list(run) for run in found.differ],
    }


def _line(figures: Mapping[str, Any]) -> str:
    kappa = "–" if figures["kappa"] is None else f"{figures['kappa']:.2f}"
    apart = ", ".join(f"{start}:{end}" for start, end in figures["differ"]) or "nowhere"
    return f"κ {kappa}, {figures['same']:.1%} the same; differ on {apart}"
