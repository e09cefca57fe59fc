"""The command line with a solve made by hand behind it."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from addb_viewer.commands.cli import app
from solver.capture.capture import Subject
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.fit_result import Fit
from solver.fitting.provenance import provenance_of
from solver.fitting.settings import as_dict


@dataclass
class CommandLine:
    """Runs commands; `solves` counts what reached the solver, `failure` is what it raises instead."""

    subject: Subject
    solves: list[tuple[str, ...] | None] = field(default_factory=list)
    reviews: list[Mapping[str, object]] = field(default_factory=list)  # handed over with each solve
    extensions: list[Extension | None] = field(default_factory=list)  # likewise
    notes: list[tuple[str, ...]] = field(default_factory=list)  # of the subject, likewise
    failure: BaseException | None = None

    def __call__(self, *arguments: object) -> Result:
        return CliRunner().invoke(app, [os.fspath(a) if isinstance(a, Path) else str(a) for a in arguments])


@pytest.fixture
def command_line(small_fit: Fit, monkeypatch: pytest.MonkeyPatch) -> CommandLine:
    """The app on the folder of `small_fit`, whose files exist, solved by returning `small_fit`."""
    subject = small_fit.subject
    for trial in subject.trials:
        trial.markers.parent.mkdir(parents=True)
        trial.markers.write_text(f"markers of {trial.name}")
    line = CommandLine(subject)

    def solve(subject, settings, *, trials, reviews, progress, extension=None, **_):
        line.solves.append(trials)
        line.reviews.append(reviews)
        line.extensions.append(extension)
        line.notes.append(subject.notes)
        progress("inverse kinematics", 0.5)
        if line.failure is not None:
            raise line.failure
        chosen = [trial for trial in subject.trials if trials is None or trial.name in trials]
        names = [trial.name for trial in chosen]
        return replace(
            small_fit,
            trials=tuple(fit for fit in small_fit.trials if fit.capture.name in names),
            settings=as_dict(settings),
            provenance=provenance_of(subject, chosen, reviews, extension),
        )

    monkeypatch.setattr("addb_viewer.jobs.solving.solve", solve)
    monkeypatch.setattr(
        "addb_viewer.jobs.solving.open_subject", lambda folder, awaits: replace(subject, folder=folder)
    )
    return line
