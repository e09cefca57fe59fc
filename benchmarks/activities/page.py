"""The page benchmarks/ACTIVITIES.md."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np

from benchmarks.activities.judging import NOTHING, Answer, confusion, reliability
from benchmarks.activities.learning import RIDGE
from benchmarks.activities.looking import Look
from solver.dynamics.root_wrench import centre_of_mass
from solver.gait.activity import Activity, Kind
from solver.gait.activity_settings import ACTIVITIES
from solver.gait.speed import overground_speed, treadmill_speed
from solver.skeleton.forward import ForwardKinematics

PAGE = Path(__file__).parents[1] / "ACTIVITIES.md"
BORDERS = (ACTIVITIES.least_confidence, 0.7, 0.8, 0.9, 0.95, 1.0001)

TEXT = """# Suggested activities

{date}. Made by `python -m benchmarks.activities`; `--learn` puts the weights that all examples together
give into the solver ([how suggestions are made](../docs/gait.md#activities)).

What is judged is every half second in which the activity is known: the suggested class, or none. Trials
have names that say nothing, except where the page says otherwise. Weights of the judged never saw the
person (simulated) or the source (recorded). The ridge of the weights ({ridge:g}) was chosen on left-out
sources too: from 0.03 to 0.0001 they were told apart equally well, and smaller ones are surer.

Examples are few: {recordings} trials of {sources} sources, one of which has the only squats and the only
sit-to-stands. These figures say that nothing is badly wrong, and no more.

Only the weights are judged by what they have not seen. Features, the rule for sit-to-stands and the
smoothing were settled while these recordings were looked at: on others they will do worse.

## Simulated people that taught nothing

{simulated}

Weights learnt on {taught} trials of other simulated people alone.

## Recordings, each by weights that were learnt without its source

{nameless}

Sit-to-stand keeps hand thresholds (`rule (unlearnt)`), as stairs, lunges and transitions do, of which
there is no recording: **they are untested** beyond that they do not speak up in the others.

| recording | what happens | right, half seconds | sub-label right | confidence | with its own name |
|---|---|---|---|---|---|
{recordings_table}

In `lasem_FAILT01 Walk01` 40 % of the marker frames are invalid. Its drop jump begins on a box that the
person leaves by a step, so the sub-label is missed. *With its own name*: the trial's name is a hint worth
odds of {odds:g}.

## How often a suggestion is right

Half seconds of the recordings, by confidence; names that say nothing. Below {least:g} nothing is
suggested.

| confidence | suggestions | right | share |
|---|---|---|---|
{reliability}

## Average speed

Simulated people of both groups; the bar is 2 %. Over a floor the mean size of the velocity of the centre
of mass, on a belt the standing ankle amid a stance. Stances are found from the feet's motion.
The paper's definition over a floor also counts how the body bobs and sways, which is most in the slowest
walks: one of them is beyond the bar.

| | trials | largest error | RMS |
|---|---|---|---|
{speeds}
"""


@dataclass(frozen=True)
class Judged:
    """Answers, a list a trial."""

    simulated: list[list[Answer]]
    nameless: list[list[Answer]]
    named: list[list[Answer]]


def page_of(judged: Judged, taught: Sequence[Look]) -> str:
    """The whole page.

    Args:
        judged: answers about simulated and recorded trials.
        taught: simulated trials that taught the weights.
    """
    nameless = [a for told in judged.nameless for a in told]
    recorded = [told[0].look for told in judged.nameless if told]
    speeds = [*taught, *(told[0].look for told in judged.simulated if told)]
    return TEXT.format(
        date=date.today().isoformat(),
        ridge=RIDGE,
        recordings=len(recorded),
        sources=len({look.source for look in recorded}),
        simulated=_confusion([a for told in judged.simulated for a in told]),
        taught=len(taught),
        nameless=_confusion(nameless),
        recordings_table="\n".join(map(_row, judged.nameless, judged.named)),
        odds=ACTIVITIES.named_odds,
        least=ACTIVITIES.least_confidence,
        reliability="\n".join(
            f"| {low:.2f} to {min(high, 1):.2f} | {count} | {right} | {right / count:.2f} |"
            for low, high, count, right in reliability(nameless, BORDERS)
            if count
        ),
        speeds="\n".join((_speeds(speeds, Kind.OVERGROUND), _speeds(speeds, Kind.TREADMILL))),
    )


def _confusion(told: Sequence[Answer]) -> str:
    table = confusion(told)
    said = [a for a in Activity if any(row[a] for row in table.values())]
    lines = [
        f"| half seconds of ↓ suggested as → | {' | '.join(map(str, said))} | {NOTHING} |",
        f"|---|{'---|' * (len(said) + 1)}",
    ]
    for activity in Activity:
        if activity in table:
            row = table[activity]
            cells = " | ".join(str(row[a]) for a in (*said, NOTHING))
            lines.append(f"| {activity} | {cells} |")
    return "\n".join(lines)


def _row(nameless: list[Answer], named: list[Answer]) -> str:
    example = nameless[0].look.example
    kinds = [a.kind_is_right for a in nameless if a.kind_is_right is not None]
    sure = [a.said.confidence for a in nameless if a.said is not None]
    between = f"{min(sure):.2f}–{max(sure):.2f}" if sure else "–"
    told = " ".join(filter(None, (str(example.activity), example.kind and f"({example.kind})")))
    return (
        f"| {example.trial} | {told} | {sum(a.is_right for a in nameless)} of {len(nameless)} | "
        f"{f'{sum(kinds)} of {len(kinds)}' if kinds else '–'} | {between} | "
        f"{sum(a.is_right for a in named)} of {len(named)} |"
    )


def _speeds(looks: Sequence[Look], kind: Kind) -> str:
    errors = []
    for look in looks:
        example = look.example
        if example.speed_m_s is None or example.kind is not kind:
            continue
        if kind is Kind.TREADMILL:
            found = treadmill_speed(look.motion.ankles, look.motion.stands, look.motion.rate)
        else:
            poses = ForwardKinematics(example.skeleton).poses(example.motion.q)
            com = centre_of_mass(example.skeleton, poses)
            found = overground_speed(np.gradient(com, 1 / example.motion.rate, axis=0))
        errors.append(np.nan if found is None else 100 * (found / example.speed_m_s - 1))
    worst, rms = np.max(np.abs(errors)), np.sqrt(np.mean(np.square(errors)))
    return (
        f"| {'belt' if kind is Kind.TREADMILL else 'floor'} | {len(errors)} | {worst:.1f} % | {rms:.1f} % |"
    )
