"""When the balance lacks a force of one direction for a while: the stretches in which something may touch."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.causes.time_history import Stretch, stretch_of

HOP_S = 0.05
SHORTEST_S = 0.15
LONGEST_S = 20.0  # of one constant force
ERROR_SHARE = 0.015  # of body weight, at rest: what the balance is off by
MOTION_SHARE = 0.08  # of the force that the body's acceleration demands, likewise
INDEPENDENT_HOPS = 2.0  # how long an error lasts
WRONG_WEIGHT_STD = 0.02  # of what somebody weighed: a wrong entry, a bag that stood on the scale
WEAK_SHARE = 0.2  # of the trial's strongest stretch; beside it, weaker ones are a wrong mass or gain
LEAST_SCORE = 8.0  # log likelihood ratio
MOST = 8  # of one trial
UP = np.array([0.0, 1.0, 0.0])

Run = tuple[int, int, float]  # first block, the one after the last, and the log likelihood ratio


@dataclass(frozen=True)
class ContactWindow:
    """A stretch, and by how much a constant force in it is likelier than none (log)."""

    stretch: Stretch
    score: float
    wrong_weight_N: float = 0.0  # missing upward all along the trial, beside which it was found


def contact_windows(
    scene: Scene, elsewhere: Bool[np.ndarray, " frames"] | None = None
) -> list[ContactWindow]:
    """Stretches in which forces of constant size and direction, one after another, explain the balance best.

    The likeliest division of the trial into stretches without a force and with one, each of which costs
    `LEAST_SCORE`; those that touch are one window, and weak ones beside strong ones are none. The strongest
    come first.

    Args:
        scene: of one trial.
        elsewhere: frames whose lack of force has another reason; they count as without one.
    """
    hop = max(1, round(HOP_S * scene.rate))
    blocks = scene.frames // hop
    missing = scene.missing_ground[: blocks * hop, :3]
    usable = scene.counts if elsewhere is None else scene.counts & ~elsewhere
    missing = np.where(usable[: blocks * hop, None], missing, 0.0)
    force = missing.reshape(blocks, hop, 3).mean(axis=1)
    counted = usable[: blocks * hop].reshape(blocks, hop).mean(axis=1)
    force, runs, weight_N = _beside_a_wrong_weight(scene, force, counted)
    windows: list[ContactWindow] = []
    level = [float(np.linalg.norm(force[first:end].mean(axis=0))) for first, end, _ in runs]
    strong = WEAK_SHARE * max(level, default=0.0)
    for (first, end, score), size in zip(runs, level, strict=True):
        if size < strong:
            continue
        stretch = stretch_of(scene, first * hop, end * hop)
        if windows and windows[-1].stretch.end == stretch.start:
            before = windows.pop()
            whole = stretch_of(scene, before.stretch.start, stretch.end)
            windows.append(ContactWindow(whole, before.score + score, weight_N))
        else:
            windows.append(ContactWindow(stretch, score, weight_N))
    return sorted(windows, key=lambda w: -w.score)[:MOST]


def _beside_a_wrong_weight(
    scene: Scene, force: Float[np.ndarray, "blocks 3"], counted: Float[np.ndarray, " blocks"]
) -> tuple[Float[np.ndarray, "blocks 3"], list[Run], float]:
    """What is divided, its likeliest division, and what is missing upward all along [N], most likely.

    That is what one of the runs lacks upward, or nothing. A contact may have made seem heavier or lighter
    whom only the plates weighed; somebody weighed hardly weighs otherwise.
    """
    error_N = _error_N(scene)
    std_N = WRONG_WEIGHT_STD * scene.weight_N if scene.mass_was_entered else np.inf
    runs = _likeliest(force / error_N)
    tried = [(_log_likelihood(force / error_N, runs), force, runs, 0.0)]
    for first, end, _ in runs:
        weight_N = float(force[first:end, 1].sum() / max(counted[first:end].sum(), 1.0))
        beside = force - weight_N * counted[:, None] * UP
        division = _likeliest(beside / error_N)
        likelihood = _log_likelihood(beside / error_N, division) - 0.5 * (weight_N / std_N) ** 2
        tried.append((likelihood, beside, division, weight_N))
    _, beside, division, weight_N = max(tried, key=lambda t: t[0])
    return beside, division, weight_N


def _log_likelihood(force: Float[np.ndarray, "blocks 3"], runs: list[Run]) -> float:
    """Of a division, less what its runs cost."""
    without = -0.5 * float((force**2).sum()) / INDEPENDENT_HOPS
    return without + sum(score - LEAST_SCORE for *_, score in runs)


def _likeliest(force: Float[np.ndarray, "blocks 3"]) -> list[Run]:
    """Runs of blocks with a force, and their log likelihood ratios, by dynamic programming."""
    blocks = len(force)
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(force, axis=0)])
    best, came_from = np.zeros(blocks + 1), np.full(blocks + 1, -1)  # −1: the last block is without a force
    scores = np.zeros(blocks + 1)
    shortest, longest = int(np.ceil(SHORTEST_S / HOP_S)), int(LONGEST_S / HOP_S)
    for end in range(1, blocks + 1):
        best[end] = best[end - 1]
        first = np.arange(max(0, end - longest), end - shortest + 1)
        if not len(first):
            continue
        ratio = ((sums[end] - sums[first]) ** 2).sum(axis=1) / (2 * INDEPENDENT_HOPS * (end - first))
        total = best[first] + ratio - LEAST_SCORE
        k = int(np.argmax(total))
        if total[k] > best[end]:
            best[end], came_from[end], scores[end] = total[k], first[k], ratio[k]
    runs, end = [], blocks
    while end > 0:
        if came_from[end] < 0:
            end -= 1
            continue
        runs.append((int(came_from[end]), end, float(scores[end])))
        end = int(came_from[end])
    return runs[::-1]


def _error_N(scene: Scene) -> Float[np.ndarray, "3"]:
    """Standard deviation of the balance's force without any contact, by axis [N]."""
    rest = -scene.skeleton.mass * np.asarray(scene.skeleton.gravity)
    motion = np.sqrt(((scene.required_ground[:, :3] - rest) ** 2).mean(axis=0))
    return np.hypot(ERROR_SHARE * scene.weight_N, MOTION_SHARE * motion)
