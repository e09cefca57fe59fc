"""Which steps an ablation hides."""

from math import comb

import numpy as np
from jaxtyping import Bool

from solver.common.runs import runs
from solver.contact.settings import SHORTEST_CONTACT_S

Step = tuple[int, int]  # first frame, and the first one after it


def steps_of(in_contact: Bool[np.ndarray, " frames"], rate: float) -> list[Step]:
    """Contacts of one foot in order of time, those cut by the trial's ends included.

    Args:
        in_contact: frames on which a plate carries the foot.
        rate: [Hz].
    """
    return [(start, end) for start, end in runs(in_contact) if end - start >= SHORTEST_CONTACT_S * rate]


def every_third(steps: list[Step], repetitions: int) -> list[list[Step]]:
    """Every third step, as in the dataset paper; beginning with the first, the second, the third one.

    There are no more than three ways to do that; fewer where there are fewer steps.
    """
    return [steps[first::3] for first in range(min(3, repetitions, len(steps)))]


def random_shares(
    steps: list[Step], fraction: float, repetitions: int, rng: np.random.Generator
) -> list[list[Step]]:
    """Random choices of so large a share of the steps, no choice twice.

    Args:
        steps: of one foot.
        fraction: rounded to whole steps, but at least one.
        repetitions: how many choices; fewer where there are no more.
        rng: of the choices.
    """
    hidden = min(len(steps), max(1, round(fraction * len(steps))))
    wanted = min(repetitions, comb(len(steps), hidden))
    chosen: dict[tuple[int, ...], None] = {}
    while len(chosen) < wanted:
        choice = rng.choice(len(steps), size=hidden, replace=False)
        chosen[tuple(sorted(int(i) for i in choice))] = None
    return [[steps[i] for i in choice] for choice in chosen]


def frames_of(steps: list[Step], frames: int, border: int = 0) -> Bool[np.ndarray, " frames"]:
    """True during these steps and `border` frames before and after each of them.

    Args:
        steps: in any order.
        frames: of the trial.
        border: as far as the filter spreads a contact's force; else the tails of hidden forces stay in sight.
    """
    inside = np.zeros(frames, dtype=bool)
    for start, end in steps:
        inside[max(0, start - border) : end + border] = True
    return inside
