"""Edges of contacts: how steeply the forces' spectrum falls there, from 8 to 20 Hz.

Feet strike and leave within some hundredths of a second whatever the person does in between, and a low-pass
at 4 to 8 Hz takes nearly all of that away.
"""

import math
from collections.abc import Sequence

from solver.capture.plates.conditioning import gaps_filled
from solver.diagnosis.causes.contact_edges import (
    QUICK_HZ,
    SLOW_HZ,
    SOUND,
    fall_off,
    filtered_nats,
    usual_fall_off,
)
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.statement import About, Statement

DIRECT_CHECK = "edges of contacts"


def contact_edges(trials: Sequence[Measured]) -> list[Statement]:
    """Each trial, over all contacts that begin or end in it."""
    return [said for trial in trials if (said := _of_trial(trial)) is not None]


def _of_trial(trial: Measured) -> Statement | None:
    edges = []
    for plate in trial.capture.plates:
        whole, _, _ = gaps_filled(plate, trial.reading.conditioning)
        edges += fall_off(whole.force_ground[:, 1], plate.rate)
    fall = usual_fall_off(edges)
    if fall is None:
        return None
    share, usual = math.exp(fall), math.exp(SOUND)
    return Statement(
        DIRECT_CHECK,
        f"Where contacts begin and end, the forces at {QUICK_HZ:.0f} Hz are {100 * share:.2g} % of those at "
        f"{SLOW_HZ:.0f} Hz; {100 * usual:.0f} % is usual (normal: at least a quarter of that).",
        {About.FILTER: filtered_nats(fall)},
        {"quick_share": share, "usual_share": usual, "edges": float(len(edges))},
        trial=trial.capture.name,
    )
