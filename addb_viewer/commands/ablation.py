"""`addb-viewer ablation`: what it costs that the forces of some steps are missing."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.ablation_setup import Experiment, choices_of, experiment_on
from addb_viewer.commands.ablation_table import Condition, as_json, print_conditions
from addb_viewer.commands.options import (
    Debug,
    IgnoreReview,
    JsonFile,
    SettingsFile,
    SubjectFolder,
    replaceable,
)
from addb_viewer.commands.torque_figure import torque_figure
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.solving import job_for
from addb_viewer.jobs.terminal_progress import terminal_progress
from solver.capture.atomic import write_whole
from solver.common.file_names import readable
from solver.common.progress import Progress, part
from solver.dynamics.cross_validation.ablation import ablate
from solver.dynamics.cross_validation.hidden_steps import Step
from solver.fitting.results.store import write_json

SOLVED = 0.1  # share of the work that is done after the markers' fit

OneTrial = Annotated[
    str | None,
    typer.Option(
        "--trial",
        metavar="NAME",
        parser=readable,
        help="The trial; by default the one with the most right steps.",
    ),
]
Repetitions = Annotated[
    int, typer.Option("--repetitions", metavar="N", help="Choices of hidden steps per fraction.", min=1)
]
Fractions = Annotated[
    list[float] | None,
    typer.Option(
        "--fraction",
        metavar="SHARE",
        help="Also hide this share of the right steps, chosen at random; may be given several times.",
    ),
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Of the random choices.", min=0)]
Figure = Annotated[
    Path | None,
    typer.Option(
        "--figure",
        metavar="FILE",
        help="Draw the right knee's torque to this SVG file.",
        dir_okay=False,
        callback=replaceable,
    ),
]


def ablation(
    subject: SubjectFolder,
    trial: OneTrial = None,
    repetitions: Repetitions = 10,
    fraction: Fractions = None,
    seed: Seed = 0,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    json: JsonFile = None,
    figure: Figure = None,
    debug: Debug = False,
) -> None:
    """Hide the forces of right steps, fit without them, and compare with the fit that sees them."""
    for target, option in ((json, "--json"), (figure, "--figure")):
        if target is not None and not target.absolute().parent.is_dir():
            raise typer.BadParameter(f"no folder {target.parent} to write into", param_hint=option)
    if not all(0 < share < 1 for share in fraction or ()):
        raise typer.BadParameter("a share lies between 0 and 1, as in 0.3", param_hint="--fraction")
    with errors_as_lines(debug):
        job = job_for(
            subject, trials=[trial] if trial else None, settings_file=settings, ignore_review=ignore_review
        )
        with terminal_progress() as progress:
            experiment = experiment_on(job, part(progress, 0.0, SOLVED))
            choices = choices_of(experiment.steps, fraction or (), repetitions, seed)
            conditions = _run(experiment, choices, part(progress, SOLVED, 1.0))
        print_conditions(experiment.name, len(experiment.steps), conditions)
        if json is not None:
            write_json(json, experiment.about() | {"seed": seed} | as_json(conditions))
        if figure is not None:
            drawn = conditions[0].repetitions[0]
            write_whole(figure, torque_figure(experiment.times, drawn, experiment.name))


def _run(experiment: Experiment, choices: dict[str, list[list[Step]]], progress: Progress) -> list[Condition]:
    hidden = [experiment.hidden(steps) for several in choices.values() for steps in several]
    done = ablate(experiment.trial, hidden, experiment.settings, progress)
    return [Condition(name, tuple(next(done) for _ in several)) for name, several in choices.items()]
