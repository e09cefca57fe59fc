"""`addb-viewer ablation`: what it costs that the forces of some steps are missing."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from addb_viewer.commands.ablation_table import Condition, as_json, print_conditions
from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, IgnoreReview, JsonFile, SettingsFile, SubjectFolder
from addb_viewer.commands.progress import terminal_progress
from addb_viewer.commands.reviewing import foot_named
from addb_viewer.commands.solving import Job, job_for
from addb_viewer.commands.torque_figure import torque_figure
from solver.capture.atomic import write_whole
from solver.capture.conditioning import shared_cutoff
from solver.dynamics.ablation import AblationSettings, AblationTrial, ablate
from solver.dynamics.hidden_steps import Step, every_third, frames_of, random_shares, steps_of
from solver.dynamics_stage import trial_data
from solver.errors import FitError
from solver.fit import Fit, TrialFit
from solver.kinematics.marker_matching import match_markers
from solver.pipeline import solve
from solver.progress import Progress, part
from solver.results.store import write_json
from solver.settings import Settings

FEWEST_STEPS = 2  # one is hidden, another one is seen
SOLVED = 0.1  # share of the work that is done after the markers' fit

OneTrial = Annotated[
    str | None,
    typer.Option("--trial", metavar="NAME", help="The trial; by default the one with the most right steps."),
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
        "--figure", metavar="FILE", help="Draw the right knee's torque to this SVG file.", dir_okay=False
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
            fit = _from_markers(job, part(progress, 0.0, SOLVED))
            chosen, foot, steps = _most_steps(fit)
            prepared = _prepared(fit, chosen, foot)
            conditions = _run(
                prepared,
                _choices(steps, fraction or (), repetitions, seed),
                _settings(job.settings, chosen),
                part(progress, SOLVED, 1.0),
            )
        print_conditions(chosen.capture.name, len(steps), conditions)
        if json is not None:
            about = {
                "trial": chosen.capture.name,
                "frames": chosen.motion.frames,
                "rate_hz": chosen.motion.rate,
                "mass_kg": fit.mass_kg,
                "right_steps": [list(step) for step in steps],
                "seed": seed,
            }
            write_json(json, about | as_json(conditions))
        if figure is not None:
            drawn = conditions[0].repetitions[0]
            write_whole(figure, torque_figure(chosen.motion.times, drawn, chosen.capture.name))


def _from_markers(job: Job, progress: Progress) -> Fit:
    """Scaling, kinematics, forces on feet and the mass; the trajectory fit is what is compared here."""
    alone = replace(job.settings, trajectory=replace(job.settings.trajectory, enabled=False))
    return solve(job.subject, alone, trials=job.trials, reviews=job.reviews, progress=progress)


def _most_steps(fit: Fit) -> tuple[TrialFit, int, list[Step]]:
    """The trial with the most right steps whose forces are known, the right foot's index, its steps."""
    found = []
    for trial in fit.trials:
        if trial.contacts is None:
            continue
        feet = trial.contacts.foot_bodies
        foot = feet.index(foot_named("right", feet) or feet[0])
        known = trial.contacts.in_contact[:, foot] & trial.forces_known
        found.append((trial, foot, steps_of(known, trial.motion.rate)))
    enough = [entry for entry in found if len(entry[2]) >= FEWEST_STEPS]
    if not enough:
        raise FitError(
            f"{fit.subject.folder}: no trial with {FEWEST_STEPS} right steps or more on a force plate; the "
            "ablation hides some of them and keeps the others."
        )
    return max(enough, key=lambda entry: len(entry[2]))


def _prepared(fit: Fit, trial: TrialFit, foot: int) -> AblationTrial:
    assert trial.contacts is not None
    assert trial.mask is not None
    match = match_markers(fit.skeleton, [trial.capture.markers])
    return AblationTrial(
        skeleton=match.skeleton(fit.skeleton),
        data=trial_data(trial, match),
        contacts=trial.contacts,
        mask=trial.mask,
        foot=foot,
    )


def _settings(settings: Settings, trial: TrialFit) -> AblationSettings:
    conditioning = settings.conditioning
    return AblationSettings(
        com=settings.com,
        trajectory=settings.trajectory,
        dynamics=settings.dynamics,
        cutoff_Hz=shared_cutoff(trial.motion.rate, conditioning),
        filter_order=conditioning.order,
    )


def _choices(
    steps: list[Step], fractions: list[float] | tuple[()], repetitions: int, seed: int
) -> dict[str, list[list[Step]]]:
    """Hidden steps by the name of their condition."""
    chosen = {"every third step": every_third(steps, repetitions)}
    for share, rng in zip(fractions, np.random.default_rng(seed).spawn(len(fractions)), strict=True):
        chosen[f"{share:.0%} of the steps"] = random_shares(steps, share, repetitions, rng)
    return chosen


def _run(
    trial: AblationTrial,
    choices: dict[str, list[list[Step]]],
    settings: AblationSettings,
    progress: Progress,
) -> list[Condition]:
    frames = trial.data.start.frames
    hidden = [frames_of(steps, frames) for several in choices.values() for steps in several]
    done = ablate(trial, hidden, settings, progress)
    return [Condition(name, tuple(next(done) for _ in several)) for name, several in choices.items()]
