"""Suggestions against what is known: confusions of half seconds, and how often sure ones are right."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from benchmarks.activities.looking import Look
from solver.gait.activities import suggested
from solver.gait.activity import Activity, ActivitySuggestion, Kind
from solver.gait.activity_features import windows_of
from solver.gait.activity_model import Weights
from solver.gait.activity_settings import ACTIVITIES, ActivitySettings

NOTHING = "nothing"
NAMELESS = "trial"  # a name that says nothing


@dataclass(frozen=True)
class Answer:
    """Half a second of a trial: what happens, what is suggested, and how sure that is."""

    look: Look
    said: ActivitySuggestion | None

    @property
    def is_right(self) -> bool:
        """Whether the suggested class is the one that is known."""
        return self.said is not None and self.said.activity is self.look.activity

    @property
    def kind_is_right(self) -> bool | None:
        """Whether the sub-label is; None where none is known, or the class is wrong."""
        known: Kind | None = self.look.example.kind
        return None if known is None or not self.is_right else bool(self.said and self.said.kind is known)


def answers(
    look: Look, weights: Weights, name: str = NAMELESS, settings: ActivitySettings = ACTIVITIES
) -> list[Answer]:
    """What is suggested of a trial, each half second in which its activity is known.

    Args:
        look: at the trial.
        weights: of the model.
        name: that the trial is given; by default one that says nothing.
        settings: thresholds of what is suggested; the half seconds are the usual ones.
    """
    found = suggested(look.motion, name, settings, weights)
    first, last = look.example.during or (0, look.motion.frames)
    told = []
    for start, end in windows_of(look.motion, ACTIVITIES).cells:
        middle = (start + end) / 2
        if first <= middle < last:
            told.append(Answer(look, next((s for s in found if s.start <= middle < s.end), None)))
    return told


def confusion(told: Sequence[Answer]) -> dict[Activity, Counter[str]]:
    """By what happens, how many half seconds each suggestion has.

    Args:
        told: of all trials.
    """
    table: dict[Activity, Counter[str]] = {}
    for answer in told:
        said = NOTHING if answer.said is None else str(answer.said.activity)
        table.setdefault(answer.look.activity, Counter())[said] += 1
    return table


def reliability(told: Sequence[Answer], borders: Sequence[float]) -> list[tuple[float, float, int, int]]:
    """By confidence from one border to the next: suggestions, and right ones.

    Args:
        told: of all trials.
        borders: of confidence.
    """
    rows = []
    for low, high in pairwise(borders):
        inside = [a for a in told if a.said is not None and low <= a.said.confidence < high]
        rows.append((low, high, len(inside), sum(a.is_right for a in inside)))
    return rows
