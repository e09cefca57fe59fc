"""`addb-viewer agreement`: how far two reviewers agree, and on which frames they do not."""

import math
from typing import Annotated, Any

import typer

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, JsonFile, SubjectFolder
from addb_viewer.commands.reviewing import subject_in
from addb_viewer.review_store import has_log, open_log
from annotations.agreement import agreement as compared
from annotations.errors import ReviewError
from annotations.log import ReviewLog
from solver.capture.capture import Subject
from solver.capture.trial import read_trial
from solver.results.store import write_json

Reviewer = Annotated[str, typer.Argument(metavar="REVIEWER", help="Name of a reviewer, or imported.")]


def agreement(
    subject: SubjectFolder, one: Reviewer, other: Reviewer, json: JsonFile = None, debug: Debug = False
) -> None:
    """Compare two reviewers' flags on the trials that both have judged."""
    with errors_as_lines(debug):
        opened = subject_in(subject)
        if not has_log(subject):
            raise ReviewError(f"{subject}: nobody has flagged anything yet")
        with open_log(subject) as log:
            trials = _common_trials(log, opened, one, other)
            found = [_compared(log, opened, trial, (one, other)) for trial in trials]
        for figures in found:
            kappa = "–" if figures["kappa"] is None else f"{figures['kappa']:.2f}"
            apart = ", ".join(f"{start}:{end}" for start, end in figures["differ"]) or "nowhere"
            typer.echo(f"{figures['name']}: κ {kappa}, {figures['same']:.1%} the same; differ on {apart}")
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
    frames = read_trial(files).markers.frames
    one, other = (log.review(trial, subject.foot_bodies, by=name).missing(frames) for name in reviewers)
    result = compared(one, other)
    return {
        "name": trial,
        "kappa": None if math.isnan(result.kappa) else result.kappa,
        "same": result.same,
        "differ": [list(run) for run in result.differ],
    }
