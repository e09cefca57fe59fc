"""`addb-viewer flags`: what people have flagged, as text, JSON, CSV or review.json."""

from pathlib import Path
from typing import Annotated, Any

import typer

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, JsonFile, SubjectFolder
from addb_viewer.commands.reviewing import described, subject_in, trial_of
from addb_viewer.review_store import has_log, open_log
from annotations.folding import folded
from annotations.ranges_csv import ranges_csv
from annotations.review_json import export_labels
from annotations.trial_review import FlaggedRange, TrialReview
from solver.capture.atomic import write_whole
from solver.capture.capture import Subject, TrialFiles
from solver.capture.trial import read_trial
from solver.results.store import write_json

OneTrial = Annotated[str | None, typer.Argument(metavar="[TRIAL]", help="This trial only.")]
CsvFile = Annotated[
    Path | None, typer.Option("--csv", metavar="FILE", help="Write the ranges as CSV.", dir_okay=False)
]
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
        reviews = _reviews(opened, trials, history)
        if json is not None:
            write_json(json, {"trials": [_figures(review) for review in reviews]})
        if csv is not None:
            write_whole(csv, ranges_csv(reviews))
        if review_json is not None:
            for review, files in zip(reviews, trials, strict=True):
                _export(review, files, review_json)


def _export(review: TrialReview, files: TrialFiles, folder: Path) -> None:
    if not review.decided:
        typer.echo(f"note: {review.trial}: nobody has reviewed it here; no review.json written")
        return
    for path in export_labels(review, read_trial(files).markers.frames, folder):
        typer.echo(path)


def _reviews(subject: Subject, trials: list[TrialFiles], history: bool) -> list[TrialReview]:
    """The reviews of the trials, each printed as soon as it is read."""
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
    return reviews


def _print(review: TrialReview, files: TrialFiles) -> None:
    by = f" ({review.status_author})" if review.status_author else ""
    nothing = "" if review.flags else ", nothing flagged"
    decides = ", its review.json decides" if files.reviews and not review.decided else ""
    typer.echo(f"{review.trial}: {review.status}{by}{nothing}{decides}")
    rows = [_row(flag) for flag in review.flags]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        typer.echo("  " + "  ".join(map(str.ljust, row, widths)).rstrip())
    for activity in review.activities:
        kind = " ".join(filter(None, (activity.activity, activity.subclass)))
        typer.echo(f"  {activity.start}:{activity.end}  {kind} ({activity.author}, edit {activity.edit})")
    for conflict in review.conflicts:
        typer.echo(f"note: {review.trial}: {conflict}")


def _row(flag: FlaggedRange) -> tuple[str, ...]:
    return (
        f"{flag.start}:{flag.end}",
        flag.foot or "both",
        flag.reason,
        f"{flag.source} ({flag.author}, edit {flag.edit})",
        flag.note,
    )


def _figures(review: TrialReview) -> dict[str, Any]:
    return {
        "name": review.trial,
        "status": review.status.value,
        "status_author": review.status_author,
        "missing": [
            {
                "range": [flag.start, flag.end],
                "foot": flag.foot,
                "reason": flag.reason,
                "source": flag.source.value,
                "author": flag.author,
                "edit": flag.edit,
                "note": flag.note,
            }
            for flag in review.flags
        ],
        "activities": [
            {"range": [a.start, a.end], "activity": a.activity, "subclass": a.subclass, "author": a.author}
            for a in review.activities
        ],
        "conflicts": [str(conflict) for conflict in review.conflicts],
    }
