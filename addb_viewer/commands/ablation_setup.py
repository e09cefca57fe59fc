"""What an ablation needs of a subject: a trial with all of its forces, its steps, which ones to hide."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.commands.reviewing import foot_named
from addb_viewer.jobs.solving import Job
from solver.capture.plates.conditioning import shared_cutoff
from solver.common.errors import FitError
from solver.common.progress import Progress
from solver.dynamics.cross_validation.ablation import AblationSettings, AblationTrial
from solver.dynamics.cross_validation.hidden_steps import (
    Step,
    every_third,
    frames_of,
    random_shares,
    steps_of,
)
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.pipeline import solve
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
        border=round(job.settings.detection.border_s * trial.motion.rate),
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
