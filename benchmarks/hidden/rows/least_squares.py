"""The best single cause by least squares: each fitted alone, compared by BIC; no prior, nothing unknown."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from benchmarks.hidden.classes import NONE
from benchmarks.hidden.rows.balance import MarkerBalance
from benchmarks.hidden.rows.causes import Candidate, candidates

INDEPENDENT_S = 0.1  # frames nearer than this share what the low-pass at 10 Hz leaves
LEAST_SPREAD = 1e-9


@dataclass(frozen=True)
class Explained:
    """A candidate fitted to the trials of a case, which share its factors."""

    id: str
    bic: float
    parameters: dict[str, float]
    left_out: list[Float[np.ndarray, "frames 6"]]  # by trial, what the cause adds to the residual, all frames


def best_single_cause(balances: Sequence[MarkerBalance]) -> tuple[dict[str, float], Explained]:
    """Probabilities of all names from exp(−BIC/2), each name's best target, and the likeliest explained."""
    spread = np.sqrt(np.mean(np.concatenate([b.residual[b.known] for b in balances]) ** 2, axis=0))
    spread = np.maximum(spread, LEAST_SPREAD)
    nothing = [Candidate(NONE, np.zeros((*b.required.shape, 0)), np.zeros_like(b.required)) for b in balances]
    per_trial = [candidates(b) for b in balances]
    together = [nothing, *_by_target(per_trial)]
    fitted = [_fitted(balances, of_trials, spread) for of_trials in together]
    best: dict[str, Explained] = {}
    for one in fitted:
        if one.id not in best or one.bic < best[one.id].bic:
            best[one.id] = one
    lowest = min(one.bic for one in best.values())
    weights = {name: float(np.exp(-(one.bic - lowest) / 2)) for name, one in best.items()}
    total = sum(weights.values())
    return {n: w / total for n, w in weights.items()}, min(best.values(), key=lambda one: one.bic)


def _by_target(per_trial: Sequence[Sequence[Candidate]]) -> list[list[Candidate]]:
    """The same candidate in all trials; where trials offer different ones, those of the first alone."""
    first = per_trial[0]
    if all([c.id for c in other] == [c.id for c in first] for other in per_trial):
        shapes = [{c.columns.shape[2] for c in of_trials} for of_trials in zip(*per_trial, strict=True)]
        rows = zip(*per_trial, strict=True)
        return [list(of_trials) for of_trials, shape in zip(rows, shapes, strict=True) if len(shape) == 1]
    shared = {c.id for c in first}.intersection(*({c.id for c in other} for other in per_trial))
    return [[_first(of_trial, id) for of_trial in per_trial] for id in sorted(shared)]


def _first(of_trial: Sequence[Candidate], id: str) -> Candidate:
    return next(c for c in of_trial if c.id == id)


def _fitted(
    balances: Sequence[MarkerBalance], of_trials: Sequence[Candidate], spread: Float[np.ndarray, "6"]
) -> Explained:
    rows, columns = [], []
    for b, c in zip(balances, of_trials, strict=True):
        step = max(1, round(INDEPENDENT_S / (b.times[1] - b.times[0])))
        kept = np.flatnonzero(b.known)[::step]
        rows.append(((b.residual - c.fixed)[kept] / spread).ravel())
        columns.append((c.columns[kept] / spread[:, None]).reshape(6 * len(kept), c.columns.shape[2]))
    y, A = np.concatenate(rows), np.concatenate(columns)
    x = np.linalg.lstsq(A, y, rcond=None)[0]
    left = float(np.sum((y - A @ x) ** 2))
    first = of_trials[0]
    bic = len(y) * np.log(left / len(y)) + A.shape[1] * np.log(len(y)) + 2 * np.log(max(first.searched, 1))
    stated = {name: first.offset + float(value) for name, value in zip(first.parameters, x, strict=False)}
    return Explained(first.id, float(bic), stated, [c.fixed + c.columns @ x for c in of_trials])
