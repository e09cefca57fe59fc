"""Which frames are held out: blocks of a trial's known frames, or steps of one foot."""

from collections.abc import Sequence
from math import comb

import numpy as np
from jaxtyping import Bool

from solver.common.true_runs import runs
from solver.contact.settings import SHORTEST_CONTACT_S
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings

Step = tuple[int, int]  # first frame, and the first one after it

BLOCKS, STEPS = "blocks", "steps"
LAYOUTS = (*((BLOCKS, number) for number in range(6)), *((STEPS, number) for number in range(3)))
_STEPS_EVERY = 3  # likewise one in three: left and right ones in turn
_STANCE_S = (0.08, 1.5)  # shorter ones are no steps but noise on a plate, longer ones are standing


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
    held_out = min(len(steps), max(1, round(fraction * len(steps))))
    wanted = min(repetitions, comb(len(steps), held_out))
    chosen: dict[tuple[int, ...], None] = {}
    while len(chosen) < wanted:
        choice = rng.choice(len(steps), size=held_out, replace=False)
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


def hold_out_blocks(
    counts: Bool[np.ndarray, " frames"], rate: float, settings: TrajectorySettings, number: int = 0
) -> Bool[np.ndarray, " frames"]:
    """Every k-th block of frames with known forces, never the first nor the last one.

    Whole blocks, because a frame's neighbours know its force; a block is as long as a step's half. From
    layout to layout the blocks move by a sixth of their distance. So all layouts together hold out every
    frame between the first and the last block; twice, where one block in three is held out.

    Args:
        counts: frames whose forces are known.
        rate: [Hz].
        settings: length and distance of the blocks.
        number: of the layout, from 0 to 5.
    """
    held_out = np.zeros(len(counts), dtype=bool)
    known = np.flatnonzero(counts)
    length, period = max(1, round(settings.held_out_block_s * rate)), settings.held_out_every
    first = length + round(number * length * period / _count(BLOCKS))
    end = len(known) - length
    for start in range(first, end - (length + 1) // 2 + 1, period * length):
        held_out[known[start : min(start + length, end)]] = True
    return held_out


def hold_out_steps(
    counts: Bool[np.ndarray, " frames"], in_contact: Bool[np.ndarray, "frames feet"], rate: float, number: int
) -> Bool[np.ndarray, " frames"]:
    """Every third stance of either foot, from touch-down to take-off, in the order of touch-down.

    Only stances whose forces are all known and which begin and end within the recording.

    Args:
        counts: frames whose forces are known.
        in_contact: by the plates.
        rate: [Hz].
        number: of the layout, from 0 to 2.
    """
    held_out = np.zeros(len(counts), dtype=bool)
    for _, (start, end) in stances_of(counts, in_contact, rate)[number::_STEPS_EVERY]:
        held_out[start:end] = True
    return held_out


def stances_of(
    counts: Bool[np.ndarray, " frames"], in_contact: Bool[np.ndarray, "frames feet"], rate: float
) -> Sequence[tuple[int, Step]]:
    """Feet and their whole stances in the order of touch-down; arguments as of `hold_out_steps`."""
    shortest, longest = (limit * rate for limit in _STANCE_S)
    found = []
    for foot, touches in enumerate(in_contact.T):
        for start, end in runs(touches):
            inside = start > 0 and end < len(counts)
            if inside and shortest <= end - start <= longest and counts[start - 1 : end + 1].all():
                found.append((foot, (start, end)))
    return sorted(found, key=lambda stance: stance[1])


def _count(kind: str) -> int:
    return sum(other == kind for other, _ in LAYOUTS)
