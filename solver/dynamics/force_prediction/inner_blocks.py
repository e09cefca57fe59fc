"""Which kinds of learnt terms predict better: judged on blocks of known frames that are hidden in turn.

The evidence of the linearized problem misjudges: errors of the model are no white noise, and on drop jumps it
lets in gains that predict held-out forces a sixth worse. Here all sets of kinds are solved for at once, by
one step of the fit from where it ended: to second order, that forgets what the fit saw of hidden frames.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.dynamics.cross_validation.blind_steps import Blind, BlindSteps
from solver.dynamics.force_prediction.settings import PredictionSettings
from solver.dynamics.motion_change import ENDS_S
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.skeleton.skeleton import Skeleton

INERTIAS = "inertias"  # freer ones: no columns, a weaker prior


@dataclass(frozen=True)
class Parameters:
    """Of all extra columns, the same for all trials."""

    of: tuple[str, ...]  # the kind of each
    prior: ExtraParameters

    def some(self, kinds: Sequence[str]) -> Bool[np.ndarray, " extra"]:
        """Which belong to these kinds."""
        return np.isin(np.array(self.of, dtype=object), list(kinds))


def chosen_kinds(
    skeleton: Skeleton,
    trials: Sequence[TrialData],
    trajectory: TrajectorySettings,
    settings: PredictionSettings,
    *,
    phi: Float[np.ndarray, " parameters"] | None,
    parameters: Parameters,
    with_columns: Callable[[Sequence[TrialData]], list[TrialData]],
    kinds: Sequence[str],
    always: Sequence[str],
) -> tuple[str, ...]:
    """The set of kinds that predicts hidden blocks best; each has to earn a clear lead.

    Args:
        skeleton: that the fit began with.
        trials: without columns, their splines those of the fit.
        trajectory: weights, and the blocks' length and distance.
        settings: the lead.
        phi: inertias of the fit.
        parameters: of the columns.
        with_columns: makes the columns of trials, of which it sees what counts alone.
        kinds: to choose among.
        always: kinds that take part in every set.
    """
    sets = [s for n in range(len(kinds) + 1) for s in combinations(kinds, n)]
    weight = {True: settings.inertia_prior_weight, False: 1.0}
    choices = [(parameters.some((*always, *s)), weight[INERTIAS in s]) for s in sets]
    squares: list[Float[np.ndarray, "sets 2"]] = []  # one a block
    of_trial: list[int] = []
    whole = with_columns(trials)
    steps = BlindSteps(skeleton, whole, trajectory, phi=phi, extra=parameters.prior)
    for turn in range(trajectory.held_out_every):
        blocks = [_hidden(trial, turn, trajectory) for trial in trials]
        hidden = [_any(own, trial) for own, trial in zip(blocks, trials, strict=True)]
        blind = [replace(t, counts=t.counts & ~h) for t, h in zip(trials, hidden, strict=True)]
        if not any(blocks) or not any(b.counts.any() for b in blind):
            continue
        layout = []
        for frames, seen in zip(hidden, with_columns(blind), strict=True):
            assert seen.extra_columns_ground is not None
            layout.append(Blind(frames, seen.extra_columns_ground))
        for i, (missed, own) in enumerate(zip(steps.missed(layout, choices), blocks, strict=True)):
            squares += list(_squares(missed, trials[i], own))
            of_trial += [i] * len(own)
    if len(squares) < 2:
        return ()
    return _best(sets, np.array(squares), np.array(of_trial), settings)


def _best(
    sets: Sequence[tuple[str, ...]],
    squares: Float[np.ndarray, "blocks sets 2"],
    of_trial: Int[np.ndarray, " blocks"],
    settings: PredictionSettings,
) -> tuple[str, ...]:
    """The set whose errors are smallest, where blocks agree that it is better than the first one.

    Args:
        sets: of kinds, the first one empty.
        squares: sums over a block's frames, of force and of moment.
        of_trial: each block's trial.
        settings: what is a clear lead.
    """
    by_trial = np.stack([squares[of_trial == i].sum(axis=0) for i in np.unique(of_trial)])
    shares = np.array([(of_trial == i).mean() for i in np.unique(of_trial)])
    worse = 0.5 * np.log(by_trial / by_trial[:, :1])
    score = shares @ worse.mean(axis=2)
    score += settings.clear_margin * np.array([len(s) for s in sets])
    score[np.any(worse > np.log1p(settings.most_worse), axis=(0, 2))] = np.inf
    each = 0.5 * np.log(squares / squares[:, :1]).mean(axis=2)
    scatter = each.std(axis=0, ddof=1) / np.sqrt(len(each))
    score[1:][(each.mean(axis=0) + settings.agreement * scatter)[1:] > 0] = np.inf
    return sets[int(np.argmin(score))]


def _hidden(trial: TrialData, turn: int, settings: TrajectorySettings) -> list[Int[np.ndarray, " some"]]:
    """Every k-th block of known frames, beginning with another one each turn."""
    known = np.flatnonzero(trial.counts)
    length = max(1, round(settings.held_out_block_s * trial.start.rate))
    starts = range(turn * length, len(known) - length // 2, settings.held_out_every * length)
    return [known[start : start + length] for start in starts]


def _any(blocks: Sequence[Int[np.ndarray, " some"]], trial: TrialData) -> Bool[np.ndarray, " frames"]:
    hidden = np.zeros(len(trial.counts), dtype=bool)
    for block in blocks:
        hidden[block] = True
    return hidden


def _squares(
    missed: Float[np.ndarray, "sets hidden 6"], trial: TrialData, blocks: Sequence[Int[np.ndarray, " some"]]
) -> Float[np.ndarray, "blocks sets 2"]:
    """Sums over blocks: of force [N²], of moment about the root [N²·m²].

    Frames near the trial's ends, where motions know nothing beyond, are not counted.
    """
    if not blocks:
        return np.zeros((0, len(missed), 2))
    at, end = np.concatenate(blocks), round(ENDS_S * trial.start.rate)
    borders = np.cumsum([0, *(len(block) for block in blocks[:-1])])
    inside = (at >= end) & (at < len(trial.counts) - end)
    squares = (missed**2).reshape(*missed.shape[:2], 2, 3).sum(axis=3)
    counted = np.where(inside[None, :, None], squares, 1e-12)
    return np.add.reduceat(counted, borders, axis=1).transpose(1, 0, 2)
