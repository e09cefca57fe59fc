"""Who walks slowly, who halts, and who does not walk at all: the cycles that count are known."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.activities.examples import Example
from benchmarks.activities.puppets import Plant, Puppet, earlier, puppet, steps
from benchmarks.activities.recorded import recorded
from benchmarks.activities.simulated import FEET, SIMULATED
from benchmarks.gait_belts import feet_of
from benchmarks.gait_events import SEARCH_S
from benchmarks.varied import Answer, Variation
from solver.gait.activity import Activity
from solver.gait.cycles import cycles_of
from solver.gait.events import Stance, stances_from_feet
from solver.gait.foot_motion import FootMotion
from solver.gait.settings import GAIT, GaitSettings

PERSONS = range(200, 210)  # seeds
WALK_RATIO_M_MIN = (
    0.0045,
    0.0075,
)  # step by cadence: 0.0065 in adults (Sekiya & Nagasaki 1998), less in patients
SPEEDS_M_S = ((0.2, 0.4), (0.4, 0.8), (0.8, 1.4))  # at home, near it, and anywhere (Perry et al. 1995)
DOUBLE = {0.2: 0.4, 0.4: 0.32, 0.8: 0.24}  # of a step, both feet stand: the longer, the slower
HALTS_S = (1.0, 4.0)
NO_WALKS = (Activity.STANDING, Activity.SQUAT, Activity.SIT_TO_STAND, Activity.JUMP)
Known = tuple[int, float, float]
"""Foot, begin and end [s] of a cycle."""


@dataclass(frozen=True, eq=False)
class Walk:
    """One trial, and the cycles that count in it."""

    person: str
    stances: tuple[Stance, ...]
    feet: FootMotion
    heels: tuple[Float[np.ndarray, "frames 3"], ...]
    times: Float[np.ndarray, " frames"]
    during: tuple[float, float]  # [s]: of others nothing is known
    truth: Sequence[Known]

    def told(self, settings: GaitSettings) -> list[Known]:
        """Cycles that settings let count."""
        found = cycles_of(self.stances, self.feet, self.heels, self.times, settings)
        begin, end = self.during
        return [(c.foot, c.start_s, c.end_s) for c in found if begin <= c.start_s and c.end_s <= end]


def unmatched(some: Sequence[Known], others: Sequence[Known]) -> int:
    """How many of some are none of the others."""
    return sum(
        not any(a[0] == b[0] and max(abs(a[1] - b[1]), abs(a[2] - b[2])) < SEARCH_S for b in others)
        for a in some
    )


def cycles_answer(walks: Sequence[Walk], variation: Variation) -> Answer:
    """One value's: cycles that miss or do not count, and those that come and go, over all that count.

    Args:
        walks: all trials.
        variation: name, factor and settings, which find the same events.
    """
    name, factor, settings = variation
    count = sum(len(walk.truth) for walk in walks)
    wrong: dict[str, float] = {}
    changed = 0
    for walk in walks:
        told, usually = walk.told(settings), walk.told(GAIT)
        bad = unmatched(told, walk.truth) + unmatched(walk.truth, told)
        wrong[walk.person] = wrong.get(walk.person, 0.0) + bad / count
        changed += unmatched(told, usually) + unmatched(usually, told)
    return Answer(name, factor, sum(wrong.values()), changed / count, count, wrong)


@cache
def walks(kept: Path) -> tuple[Walk, ...]:
    """Puppets who walk, and recorded persons who do something else.

    Args:
        kept: folder of the recordings' fits.
    """
    others = [one for one in recorded(kept / "rec") if one.activity in NO_WALKS]
    return (
        *(walk for seed in PERSONS for walk in _walks(seed, puppet(seed))),
        *(_walk(one, ()) for one in others),
    )


def _walk(example: Example, truth: Sequence[Known]) -> Walk:
    feet, heels = feet_of(example)
    times = example.motion.times
    first, last = example.during or (0, len(times) - 1)
    during = float(times[first]), float(times[min(last, len(times) - 1)])
    return Walk(example.person, stances_from_feet(feet, GAIT), feet, heels, times, during, truth)


def _walks(seed: int, who: Puppet) -> Iterator[Walk]:
    rng = np.random.default_rng([seed, 3])
    for slowest, fastest in SPEEDS_M_S:
        speed = float(rng.uniform(slowest, fastest))
        step_s = 60 / float(np.sqrt(60 * speed / rng.uniform(*WALK_RATIO_M_MIN)))
        waits = {5: float(rng.uniform(*HALTS_S))}
        plants = steps([(speed * step_s, 0.0)] * 11, step_s, double=DOUBLE[slowest], waits_s=waits)
        plants = earlier(plants, 1.5 * step_s)
        duration = plants[-2].start
        motion = who.moved(plants, duration, rng)
        example = Example(
            SIMULATED, f"person {seed}, walk", Activity.WALKING, None, who.skeleton, FEET, motion
        )
        yield _walk(example, cycles_of_plants(plants, duration, waits[5]))


def cycles_of_plants(plants: Sequence[Plant], duration: float, halt_s: float) -> list[Known]:
    """From contact to contact within a trial, but those in which somebody halts.

    Args:
        plants: of both feet.
        duration: of the trial [s].
        halt_s: how long somebody halts; no cycle lasts so much longer than another but one with a halt.
    """
    strides = [
        (foot, one.start, other.start)
        for foot in range(2)
        for one, other in pairwise(p for p in plants if p.foot == foot)
        if one.start > 0 and other.start < duration
    ]
    usual = min(end - start for _, start, end in strides)
    return [stride for stride in strides if stride[2] - stride[1] < usual + halt_s / 2]
