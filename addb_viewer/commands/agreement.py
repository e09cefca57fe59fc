"""`addb-viewer agreement`: how far two reviewers agree, and on which frames they do not."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

import typer

from addb_viewer.commands.options import Debug, JsonFile, SubjectFolder
from addb_viewer.commands.reviewing import tell_unreadable, unreadable_figures
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.review_store import has_log, open_log
from addb_viewer.jobs.reviewing import capture_of, subject_in
from annotations.agreement import Agreement
from annotations.agreement import agreement as compared
from annotations.errors import ReviewError
from annotations.log import ReviewLog
from solver.capture.capture import Subject
from solver.fitting.results.store import write_json

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
        **_figures(compared(one, other)),
        "activities": None,
        "unreadable": unreadable_figures(tuple(unreadable)),
    }
    if all(opinion.activities for opinion in opinions):
        one, other = (opinion.activity_labels(frames)[:, None] for opinion in opinions)
        figures["activities"] = _figures(compared(one, other))
    return figures


def _figures(found: Agreement) -> dict[str, Any]:
    return {
        "kappa": None if math.isnan(found.kappa) else found.kappa,
        "same": found.same,
        "differ": [list(run) for run in found.differ],
    }


def _line(figures: Mapping[str, Any]) -> str:
    kappa = "–" if figures["kappa"] is None else f"{figures['kappa']:.2f}"
    apart = ", ".join(f"{start}:{end}" for start, end in figures["differ"]) or "nowhere"
    return f"κ {kappa}, {figures['same']:.1%} the same; differ on {apart}"
