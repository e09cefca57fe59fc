"""The feet's thresholds chosen on half of the persons and judged on the other half."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from solver.contact.sole import soles
from solver.fitting.results.store import load_fit
from solver.gait.events import GaitEvent, events_of, stances_from_feet
from solver.gait.foot_motion import FootMotion, foot_motion
from solver.gait.settings import GAIT, GaitSettings
from solver.skeleton.forward import body_poses

GRID = {
    "contact_share": (0.3, 0.35, 0.4, 0.45, 0.5),
    "most_contact_m_s": (1.8, 2.1, 2.4, 2.7, 3.0),
    "off_factor": (0.6, 0.7, 0.8, 0.9, 1.0),
    "off_power": (0.5, 0.6, 0.7, 0.8, 0.9),
}


@dataclass(frozen=True)
class Feet:
    """What the thresholds are put to: the feet's motion in one recording."""

    motion: FootMotion
    bodies: tuple[str, ...]

    def events(self, settings: GaitSettings) -> tuple[GaitEvent, ...]:
        """Those that thresholds make of it."""
        return events_of(stances_from_feet(self.motion))


def feet_of(folder: Path, trial: str) -> Feet:
    """The feet of a kept fit."""
    fit = load_fit(folder / "results", folder)
    found = next(one for one in fit.trials if one.capture.name == trial)
    assert found.contacts is not None
    motion = found.kinematics_only.motion if found.kinematics_only else found.motion
    R, p = body_poses(fit.skeleton, motion.q)
    bodies = found.contacts.foot_bodies
    corners = [sole.corners_ground(R, p) for sole in soles(fit.skeleton, bodies)]
    return Feet(foot_motion(corners, p[:, 0], motion.times, GAIT), tuple(bodies))


def chosen_elsewhere(
    persons: Mapping[str, Sequence[str]], score: Callable[[str, GaitSettings], float]
) -> dict[str, GaitSettings]:
    """For each recording the thresholds that are best on the other half of the persons: every other one.

    Args:
        persons: recordings of each, in the table's order.
        score: of a recording with thresholds; less is better.
    """
    halves = [list(persons)[k::2] for k in range(2)]
    chosen = {}
    for half, other in zip(halves, reversed(halves), strict=True):
        best = min(_candidates(), key=lambda settings: _mean_score(persons, half, score, settings))
        chosen |= {recording: best for person in other for recording in persons[person]}
    return chosen


def _mean_score(
    persons: Mapping[str, Sequence[str]],
    half: Sequence[str],
    score: Callable[[str, GaitSettings], float],
    settings: GaitSettings,
) -> float:
    """A person counts once, however many recordings there are of them."""
    return float(np.mean([np.mean([score(name, settings) for name in persons[person]]) for person in half]))


def _candidates() -> list[GaitSettings]:
    return [replace(GAIT, **dict(zip(GRID, values, strict=True))) for values in product(*GRID.values())]


def words(settings: GaitSettings) -> str:
    """The thresholds in short."""
    return ", ".join(f"{name} {getattr(settings, name):g}" for name in GRID)
