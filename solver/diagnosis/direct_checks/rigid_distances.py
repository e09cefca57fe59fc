"""Rigid distances: markers of a segment keep theirs, before and after, and from trial to trial."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.capture.subject.body_lengths import RIGID_M
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.statement import About, Statement, nats_of

STEP_M = 0.008  # change of such a distance at one moment that is worth a word
STEP_SCATTER_M = 0.005  # 13 mm at most, of soft tissue at a strike and of thighs, on the people who set this
STEP_USUAL_M = 0.03  # a marker knocked off and put back elsewhere
FARTHEST_M = 0.3  # markers farther apart are on other segments

DIRECT_CHECK = "rigid distances"
NEAREST_M = 0.04  # nearer ones say nothing of a direction
SUDDEN_S = 0.1  # on either side of a moment
SUDDEN_SHARE = 0.7  # of the lasting change that is there at once
TOGETHER_S = 0.06
FEWEST_PAIRS = 2
FEWEST_COMMON = 8  # pairs that two trials share
BETWEEN_SCATTER, BETWEEN_USUAL = 0.007, 0.03  # logarithm; people's segments differ by 3 to 5 %


@dataclass(frozen=True)
class Step:
    """A distance that changes at one moment and stays changed."""

    one: int
    other: int
    frame: int
    change_m: float


def rigid_distances(trials: Sequence[Measured]) -> list[Statement]:
    """Markers that moved on their segment in a trial; and whether all trials show one person."""
    said = [moved for trial in trials for moved in _find_moved(trial)]
    return said + _compare_trials(trials)


def steps(markers: Markers, trial: Measured) -> list[Step]:
    """Of all pairs that are near and rigid before and after."""
    places = markers.positions_ground
    margin = round(SUDDEN_S * markers.rate) + 1
    if len(places) < 4 * margin:
        return []
    seen = np.flatnonzero(np.isfinite(places).all(axis=(0, 2)))
    found = []
    for a, i in enumerate(seen):
        distance = np.linalg.norm(places[:, seen[:a]] - places[:, i : i + 1], axis=2)
        middle = np.median(distance, axis=0)
        for b in np.flatnonzero((middle > NEAREST_M) & (middle < FARTHEST_M)):
            step = _step(distance[:, b], margin, RIGID_M, STEP_M)
            if step is not None:
                found.append(Step(int(seen[b]), int(i), *step))
    return found


def _step(
    distance: Float[np.ndarray, " frames"], margin: int, rigid_m: float, least_m: float
) -> tuple[int, float] | None:
    """The moment that parts a distance into two constants best, and the change; None where it is no step."""
    count = len(distance)
    sums, squares = np.cumsum(distance), np.cumsum(distance**2)
    n = np.arange(1, count)
    before, after = sums[:-1] / n, (sums[-1] - sums[:-1]) / (count - n)
    within = squares[-1] - n * before**2 - (count - n) * after**2
    at = margin + int(np.argmin(within[margin - 1 : count - margin])) - 1
    change = float(after[at] - before[at])
    scatter = float(np.sqrt(max(within[at], 0.0) / count))
    if abs(change) < least_m or scatter > rigid_m:
        return None
    first = at + 1
    at_once = distance[first : first + margin].mean() - distance[first - margin : first].mean()
    return (first, change) if at_once / change > SUDDEN_SHARE else None


def _find_moved(trial: Measured) -> list[Statement]:
    """Steps of one moment are one event: of one marker against the others, or of several together."""
    markers = trial.capture.markers
    left, said = steps(markers, trial), []
    while (first := _most_touched(left)) is not None:
        frame = float(np.median([s.frame for s in left if first in (s.one, s.other)]))
        event = [s for s in left if abs(s.frame - frame) <= TOGETHER_S * markers.rate]
        moved = _fewest_that_explain(event)
        left = [s for s in left if s not in event and first not in (s.one, s.other)]
        if not moved:
            continue
        size = max(abs(s.change_m) for s in event)
        nats = nats_of(size, 0.0, STEP_SCATTER_M, STEP_USUAL_M)
        names, alone = [markers.names[k] for k in sorted(moved)], len(moved) == 1
        time = markers.start_time + frame / markers.rate
        said.append(
            Statement(
                DIRECT_CHECK,
                f"At {time:.2f} s {', '.join(names)} {'moves' if alone else 'move'} against others nearby by "
                f"{1e3 * size:.0f} mm, and {'stays' if alone else 'stay'} there ({len(event)} distances).",
                {About.SLIP: nats if alone else -1.0, About.SEGMENT: -1.0 if alone else nats},
                {"time_s": time, "change_m": size, "pairs": float(len(event))},
                trial=trial.capture.name,
                target="+".join(names),
            )
        )
    return said


def _most_touched(event: Sequence[Step]) -> int | None:
    """The marker with most of the steps; None where none has enough."""
    touched = Counter(k for step in event for k in (step.one, step.other))
    marker, count = touched.most_common(1)[0] if touched else (0, 0)
    return marker if count >= FEWEST_PAIRS else None


def _fewest_that_explain(event: Sequence[Step]) -> list[int]:
    """Markers without which no distance would have changed, the one with most first."""
    moved, left = [], list(event)
    while (marker := _most_touched(left)) is not None:
        moved.append(marker)
        left = [s for s in left if marker not in (s.one, s.other)]
    return moved


def _compare_trials(trials: Sequence[Measured]) -> list[Statement]:
    """Each trial against the first, by pairs that are rigid in both."""
    said = []
    for trial in trials[1:]:
        ratios = _log_ratios(trials[0], trial)
        if len(ratios) < FEWEST_COMMON:
            continue
        scatter = float(1.4826 * np.median(np.abs(ratios - np.median(ratios))))
        size = float(np.median(ratios))
        nats = nats_of(scatter, 0.0, BETWEEN_SCATTER, BETWEEN_USUAL)
        said.append(
            Statement(
                DIRECT_CHECK,
                f"{len(ratios)} distances on segments differ by {100 * size:+.1f} % on average from those in "
                f"{trials[0].capture.name}, scattering by {100 * scatter:.1f} % (one person: below 2 %).",
                {About.ENTERED_MASS: nats, About.LOAD: nats},
                {"log_size": size, "scatter": scatter},
                trial=trial.capture.name,
                against=(trials[0].capture.name,),
            )
        )
    return said


def _log_ratios(one: Measured, other: Measured) -> Float[np.ndarray, " pairs"]:
    lengths = [_rigid_lengths(trial) for trial in (one, other)]
    shared = lengths[0].keys() & lengths[1].keys()
    return np.array([np.log(lengths[1][pair] / lengths[0][pair]) for pair in sorted(shared)])


def _rigid_lengths(trial: Measured) -> dict[tuple[str, str], float]:
    """Median length of each near and rigid pair, by names in their order [m]."""
    markers = trial.capture.markers
    places, found = markers.positions_ground, {}
    for i, name in enumerate(markers.names):
        for j in range(i):
            apart = np.linalg.norm(places[:, i] - places[:, j], axis=1)
            apart = apart[np.isfinite(apart)]
            if len(apart) < 5:
                continue
            middle = float(np.median(apart))
            if NEAREST_M < middle < FARTHEST_M and apart.std() < RIGID_M / 2:
                pair = (min(name, markers.names[j]), max(name, markers.names[j]))
                found[pair] = middle
    return found
