"""`addb-viewer ablation`: what it costs that the forces of some steps are missing."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from html import escape
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from jaxtyping import Bool, Float
from rich import box
from rich.table import Table
from rich.text import Text

from addb_viewer.commands.decide import foot_named
from addb_viewer.commands.options import (
    Debug,
    IgnoreReview,
    JsonFile,
    SettingsFile,
    SubjectFolder,
    file_to_write,
    written,
)
from addb_viewer.jobs.command_errors import errors_as_lines
from addb_viewer.jobs.solving import Job, job_for
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.text.summary_table import console
from addb_viewer.trial_view.chart_html import nice_ticks
from solver.capture.atomic import write_whole
from solver.capture.plates.conditioning import shared_cutoff
from solver.common.errors import FitError
from solver.common.file_names import readable
from solver.common.progress import Progress, part
from solver.common.true_runs import runs
from solver.contact.detection_settings import BORDER_S
from solver.dynamics.cross_validation.force_ablation import (
    FITTED,
    MARKERS,
    STARTED,
    AblationSettings,
    AblationTrial,
    ArmFigures,
    Repetition,
    ablate,
)
from solver.dynamics.cross_validation.held_out_layouts import (
    Step,
    every_third,
    frames_of,
    random_shares,
    steps_of,
)
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.results.store import write_json
from solver.fitting.seen_part import seen_part
from solver.fitting.settings import Settings
from solver.fitting.trajectory_stage import trial_data
from solver.kinematics.marker_matching import match_markers

FEWEST_STEPS = 2  # one is hidden, another one is seen


@dataclass(frozen=True)
class Experiment:
    """A trial, the right foot's steps on its plates, and the settings of all stages."""

    name: str
    trial: AblationTrial
    settings: AblationSettings
    steps: list[Step]
    border: int  # frames that are hidden with a step on either side: as far as the forces' filter spreads

    @property
    def times(self) -> Float[np.ndarray, " frames"]:
        """Of the frames [s]."""
        return self.trial.data.start.times

    def hidden(self, steps: list[Step]) -> Bool[np.ndarray, " frames"]:
        """Frames on which these steps' forces are hidden."""
        return frames_of(steps, self.trial.data.start.frames, self.border)

    def about(self) -> dict[str, object]:
        """What the figures are of, for JSON."""
        return {
            "trial": self.name,
            "frames": self.trial.data.start.frames,
            "rate_hz": self.trial.data.start.rate,
            "mass_kg": self.trial.skeleton.mass,
            "right_steps": [list(step) for step in self.steps],
            "border_frames": self.border,
        }


def experiment_on(job: Job, progress: Progress) -> Experiment:
    """Scaling, kinematics, forces on feet and the mass; the trajectory fit is what the arms compare.

    The trial is the one with the most right steps whose forces are known.

    Raises:
        FitError: there is none with two of them.
    """
    alone = replace(job.settings, trajectory=replace(job.settings.trajectory, enabled=False))
    fit = solve(job.subject, alone, trials=job.trials, reviews=job.reviews, progress=progress)
    trial, foot, steps = _most_steps(fit)
    return Experiment(
        name=trial.capture.name,
        trial=_with_all_forces(fit, trial, foot),
        settings=_settings(job.settings, trial),
        steps=steps,
        border=round(BORDER_S * trial.motion.rate),
    )


def choices_of(
    steps: list[Step], fractions: Sequence[float], repetitions: int, seed: int
) -> dict[str, list[list[Step]]]:
    """Hidden steps by the name of their condition: every third one, and random shares.

    Args:
        steps: of one foot.
        fractions: shares of them, between 0 and 1.
        repetitions: choices per condition, at most.
        seed: of the random choices.
    """
    chosen = {"every third step": every_third(steps, repetitions)}
    for share, rng in zip(fractions, np.random.default_rng(seed).spawn(len(fractions)), strict=True):
        chosen[f"{share:.0%} of the steps"] = random_shares(steps, share, repetitions, rng)
    return chosen


def _most_steps(fit: Fit) -> tuple[TrialFit, int, list[Step]]:
    """The trial with the most right steps whose forces are known, the right foot's index, its steps."""
    found = []
    for trial in map(seen_part, fit.trials):
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


def _with_all_forces(fit: Fit, trial: TrialFit, foot: int) -> AblationTrial:
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


_COLUMNS = {  # figure: head, factor to the head's unit, format
    "residual_N": ("seen frames\nforce N", 1, ".1f"),
    "residual_Nm": ("\nmoment N·m", 1, ".1f"),
    "marker_rms_m": ("all frames\nmarker cm", 100, ".2f"),
    "hidden_N": ("hidden frames\nforce N", 1, ".0f"),
    "hidden_Nm": ("\nmoment N·m", 1, ".0f"),
    "knee_Nm": ("all frames\nknee N·m", 1, ".1f"),
}
_LEGEND = (
    "RMS. seen: frames whose forces the oracle and ours both see. hidden: what the motion demands less the "
    "hidden measurement. knee: right knee's torque less the oracle's. ±: standard deviation over the choices."
)


@dataclass(frozen=True)
class Condition:
    """How steps were chosen, and what came of each choice."""

    name: str
    repetitions: tuple[Repetition, ...]

    def values(self, arm: str, figure: str) -> list[float]:
        """One figure of an arm, by repetition; without those that have no frame to judge."""
        found = [getattr(r.figures[arm], figure) for r in self.repetitions]
        return [value for value in found if math.isfinite(value)]


def print_conditions(trial: str, steps: int, conditions: list[Condition]) -> None:
    """Print a table per condition."""
    terminal = console()
    terminal.print(Text(f"{trial}: {steps} right steps"))
    for condition in conditions:
        terminal.print(_table(condition))
    terminal.print(_LEGEND, style="dim")
    for note in dict.fromkeys(n for c in conditions for r in c.repetitions for n in r.notes):
        terminal.print(Text(f"note: {note}"), soft_wrap=True)


def as_json(conditions: list[Condition]) -> dict[str, object]:
    """Means, standard deviations (null for a single one) and single figures, SI units."""
    return {
        "conditions": [
            {
                "name": condition.name,
                "repetitions": len(condition.repetitions),
                "arms": {
                    arm: {figure: _statistics(condition.values(arm, figure)) for figure in asdict(figures)}
                    for arm, figures in condition.repetitions[0].figures.items()
                },
                "runs": [_run_as_json(repetition) for repetition in condition.repetitions],
            }
            for condition in conditions
        ]
    }


def _run_as_json(repetition: Repetition) -> dict[str, object]:
    """Hidden ranges, figures by arm (null where there is no frame to judge), notes."""
    return {
        "hidden": [list(run) for run in runs(repetition.held_out)],
        "arms": {arm: _numbers(figures) for arm, figures in repetition.figures.items()},
        "notes": list(repetition.notes),
    }


def _table(condition: Condition) -> Table:
    count = len(condition.repetitions)
    title = f"{condition.name} hidden, {count} choice{'s' if count > 1 else ''}"
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=title, title_justify="left")
    table.add_column("arm")
    for head, _, _ in _COLUMNS.values():
        table.add_column(head, justify="right", no_wrap=True)
    for arm in condition.repetitions[0].figures:
        table.add_row(
            arm,
            *(
                _cell(condition.values(arm, figure), factor, form)
                for figure, (_, factor, form) in _COLUMNS.items()
            ),
        )
    return table


def _cell(values: list[float], factor: float, form: str) -> str:
    statistics = _statistics(values)
    mean, std = statistics["mean"], statistics["std"]
    if mean is None:
        return "–"
    return format(factor * mean, form) + (f" ± {factor * std:{form}}" if std is not None else "")


def _statistics(values: list[float]) -> dict[str, float | None]:
    return {
        "mean": float(np.mean(values)) if values else None,
        "std": float(np.std(values, ddof=1)) if len(values) > 1 else None,
    }


def _numbers(figures: ArmFigures) -> dict[str, float | None]:
    return {name: value if math.isfinite(value) else None for name, value in asdict(figures).items()}


# Okabe and Ito's colours: told apart by colour-blind readers too; the oracle below, ours on top
_LINES = (
    (STARTED["piecewise"], "#E69F00", 1.0),
    (MARKERS, "#999999", 1.0),
    (FITTED["piecewise"], "#D55E00", 1.2),
    (FITTED["oracle"], "#0072B2", 2.4),
    (FITTED["ours"], "#000000", 1.2),
)
_PER_SECOND, _NARROWEST, _WIDEST = 160, 700, 3000  # [px] of the curves
_HEIGHT, _LEFT, _TOP, _BOTTOM = 320, 62, 56, 44  # [px]
_MARGIN = 0.35  # of the oracle's range; curves beyond it are cut off


def torque_figure(times: Float[np.ndarray, " frames"], repetition: Repetition, trial: str) -> str:
    """Draw the torque over time, the hidden frames shaded.

    Args:
        times: of the frames [s].
        repetition: whose arms.
        trial: for the title.
    """
    width = float(np.clip(_PER_SECOND * (times[-1] - times[0]), _NARROWEST, _WIDEST))
    oracle = repetition.knee_torque[FITTED["oracle"]]
    spare = _MARGIN * max(float(np.ptp(oracle)), 1.0)
    low, high = float(oracle.min()) - spare, float(oracle.max()) + spare

    def x(t: float) -> float:
        return _LEFT + width * (t - times[0]) / (times[-1] - times[0])

    def y(torque: float) -> float:
        return _TOP + _HEIGHT * (high - torque) / (high - low)

    parts = [
        f'<text x="{_LEFT}" y="18" font-size="14">Right knee: joint torque, {escape(trial)}; '
        "shaded: force hidden</text>",
        f'<clipPath id="plot"><rect x="{_LEFT}" y="{_TOP}" width="{width:.0f}" height="{_HEIGHT}"/>'
        "</clipPath>",
    ]
    step = 1 / (times[1] - times[0])
    for start, end in runs(repetition.held_out):
        left, right = x(times[start]), x(times[end - 1] + 1 / step)
        parts.append(
            f'<rect x="{left:.1f}" y="{_TOP}" width="{right - left:.1f}" height="{_HEIGHT}" '
            'fill="#eeeeee" clip-path="url(#plot)"/>'
        )
    for value in nice_ticks(low, high, 8):
        parts.append(
            f'<line x1="{_LEFT}" x2="{_LEFT + width:.0f}" y1="{y(value):.1f}" y2="{y(value):.1f}" '
            'stroke="#cccccc"/>'
            f'<text x="{_LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:g}</text>'
        )
    for value in nice_ticks(float(times[0]), float(times[-1]), 8):
        parts.append(
            f'<text x="{x(value):.1f}" y="{_TOP + _HEIGHT + 16}" text-anchor="middle">{value:g}</text>'
        )
    legend = float(_LEFT)
    for arm, colour, stroke in _LINES:
        points = " ".join(
            f"{x(t):.1f},{y(v):.1f}" for t, v in zip(times, repetition.knee_torque[arm], strict=True)
        )
        parts.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{stroke}" '
            'clip-path="url(#plot)"/>'
        )
        parts.append(f'<text x="{legend:.0f}" y="40" fill="{colour}">{escape(arm)}</text>')
        legend += 7.0 * len(arm) + 18
    middle = _TOP + _HEIGHT / 2
    parts += [
        f'<text x="{_LEFT + width / 2:.0f}" y="{_TOP + _HEIGHT + 34}" text-anchor="middle">time [s]</text>',
        f'<text x="14" y="{middle:.0f}" text-anchor="middle" transform="rotate(-90 14 {middle:.0f})">'
        "torque [N·m]</text>",
    ]
    whole = (_LEFT + width + 20, _TOP + _HEIGHT + _BOTTOM)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {whole[0]:.0f} {whole[1]}" '
        f'width="{whole[0]:.0f}" height="{whole[1]}" font-family="sans-serif" font-size="12">\n'
        '<rect width="100%" height="100%" fill="white"/>\n' + "\n".join(parts) + "\n</svg>\n"
    )


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
    Path | None, file_to_write("--figure", "Draw the right knee's torque to this SVG file.", written)
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
