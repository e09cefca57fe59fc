"""What a cause gains on blocks that its own fit has not seen, each predicted from all the others.

With the precision Q of the balance under a hypothesis (parameters integrated out), the rows of block B given
all other rows have mean r_B − Q_BB⁻¹ (Q r)_B and precision Q_BB: every block is predicted from its
neighbours, and every parameter comes from the other blocks, without a new fit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_solve

from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.screening import beside
from solver.diagnosis.search.terms import Solved, Term

BLOCK_S = 0.5  # held out at a time: a stance or half a second
SHORT_WINDOWS = 3  # a tenth of a second


@dataclass(frozen=True, eq=False)
class BlockScores:
    """Of every block: log density of its rows given the others, and the error of their prediction."""

    log_density: Float[np.ndarray, " blocks"]
    error: tuple[Float[np.ndarray, "windows 6"], ...]  # [N], [N·m about the centre of mass]

    def rms(self) -> tuple[float, float]:
        """Norms of force [N] and moment [N·m] over all windows."""
        error = np.concatenate(self.error)
        squares = (error.reshape(-1, 2, 3) ** 2).sum(axis=2).mean(axis=0)
        return float(np.sqrt(squares[0])), float(np.sqrt(squares[1]))


def blocks(balance: Balance) -> list[Int[np.ndarray, " rows"]]:
    """Rows of half-second stretches, at least four a trial where it is long enough for that."""
    found = []
    for trial, start in zip(balance.trials, balance.start, strict=False):
        time_s = trial.windows.centre / trial.scene.rate
        if not len(time_s):
            continue
        span = time_s[-1] - time_s[0]
        count = max(min(4, len(time_s)), round(span / BLOCK_S))
        edges = np.linspace(time_s[0] - 1e-6, time_s[-1] + 1e-6, count + 1)
        for low, high in pairwise(edges):
            own = np.flatnonzero((time_s >= low) & (time_s < high))
            if len(own):
                found.append(start + (6 * own[:, None] + np.arange(6)).ravel())
    return found


def short_blocks(balance: Balance) -> list[Int[np.ndarray, " rows"]]:
    """Rows of every few windows with one more on both sides: for what happens once, amid its time history.

    The windows at both ends are guards, which are held out and not scored.
    """
    found = []
    for trial, start in zip(balance.trials, balance.start, strict=False):
        count = trial.windows.count
        for first in range(0, max(0, count - SHORT_WINDOWS - 1), SHORT_WINDOWS):
            found.append(start + np.arange(6 * first, 6 * (first + SHORT_WINDOWS + 2)))
    return found


def block_scores(
    balance: Balance,
    terms: Sequence[Term],
    noise_scale: NoiseScale,
    some: Sequence[Int[np.ndarray, " rows"]],
    guards: int = 0,
) -> BlockScores:
    """Every block predicted from the others under these terms.

    Args:
        balance: of all trials.
        terms: of the hypothesis.
        noise_scale: its scale of the model error.
        some: rows of each block, all that lie between its first and its last.
        guards: windows at both ends of each block whose errors are not counted.
    """
    others = beside(terms, noise_scale)
    density, errors = [], []
    for own in some:
        W, left = others.by_rows(own), others.left_by_rows[own]
        Q_own = noise_scale.precision_at(slice(int(own[0]), int(own[-1]) + 1)) - W @ W.T
        L = np.linalg.cholesky(Q_own)
        error = cho_solve((L, True), left)
        density.append(float(np.log(np.diag(L)).sum() - 0.5 * left @ error))
        by_window = error.reshape(-1, 6)
        errors.append(by_window[guards : len(by_window) - guards])
    return BlockScores(np.array(density), tuple(errors))


@dataclass(frozen=True)
class HeldOutGain:
    """What the log density of held-out blocks gains [nats], in sum over them."""

    own_scales: float  # each hypothesis at the scales that suit it
    same_scales: float  # both at those of the later one

    @property
    def best(self) -> float:
        """Soft tissue that seems farther off without a cause predicts little, and so misses little."""
        return max(self.own_scales, self.same_scales)


def held_out_gain(
    balance: Balance, some: Sequence[Int[np.ndarray, " rows"]], before: Solved, after: Solved
) -> HeldOutGain:
    """What causes predict of blocks that others do not.

    Args:
        balance: of all trials.
        some: rows of each block.
        before: causes without the one in question.
        after: with it.
    """

    def score(terms: Sequence[Term], noise_scale: NoiseScale) -> float:
        """Kept: many causes are held against the same ones."""

        def whole() -> float:
            return float(block_scores(balance, terms, noise_scale, some).log_density.sum())

        return balance.basis.kept.get(whole, "held_out", noise_scale, some, *terms)

    with_it, own = score(after.terms, after.noise_scale), score(before.terms, before.noise_scale)
    same = own if before.noise_scale is after.noise_scale else score(before.terms, after.noise_scale)
    return HeldOutGain(with_it - own, with_it - same)
