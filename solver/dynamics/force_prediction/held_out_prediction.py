"""Which kinds of learnt terms predict forces that were held out, and what they miss there.

Kinds of terms are judged on blocks of known frames that are held out in turn. The evidence of the linearized
problem misjudges: errors of the model are no white noise, and on drop jumps it lets in gains that predict
held-out forces a sixth worse. Here all sets of kinds are solved for at once, by one step of the fit from
where it ended: to second order, that forgets what the fit saw of these frames.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.dynamics.cross_validation.held_out_steps import HeldOutSteps, TrialHeldOut
from solver.dynamics.force_prediction.learnt_terms import LearntTerms
from solver.dynamics.force_prediction.prediction_columns import Parameters
from solver.dynamics.motion_change import ENDS_S
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData
from solver.skeleton.skeleton import Skeleton

# times the trajectory fit's, where hidden blocks ask for it: nobody reads these inertias, and moments of a
# short recording are missed by a quarter less; of legs alone they are missed by more
INERTIA_PRIOR_WEIGHT = 0.1
# share by which a kind of term has to lower the error on hidden blocks: less is chance where steps are few
CLEAR_MARGIN = 0.03
MOST_WORSE = 0.05  # share by which a set may be worse than none on any trial, or it stays off
# standard errors by which hidden blocks have to agree that it is lower, the end of a 90 % interval: else
# one impact decides
AGREEMENT = 1.65

INERTIAS = "inertias"  # freer ones: no columns, a weaker prior


class HeldOutPrediction:
    """The prediction fit as it would be without the forces on some known frames, one step from its end."""

    def __init__(
        self,
        skeleton: Skeleton,
        trials: Sequence[TrialData],
        trajectory: TrajectorySettings,
        *,
        phi: Float[np.ndarray, " parameters"] | None,
        parameters: Parameters,
        with_columns: Callable[[Sequence[TrialData]], list[TrialData]],
        kinds: Sequence[str],
        always: Sequence[str],
        peak_N: float,
    ) -> None:
        """Linearize there.

        Args:
            skeleton: that the fit began with.
            trials: without columns, their splines those of the fit.
            trajectory: weights, and the blocks' length and distance.
            phi: inertias of the fit.
            parameters: of the columns.
            with_columns: makes the columns of trials, of which it sees what counts alone.
            kinds: to choose among.
            always: kinds that take part in every set.
            peak_N: of the force that stepping demands, as the columns have it.
        """
        self.trials, self.trajectory, self.with_columns = trials, trajectory, with_columns
        self.peak_N = peak_N
        self.sets = [s for n in range(len(kinds) + 1) for s in combinations(kinds, n)]
        weight = {True: INERTIA_PRIOR_WEIGHT, False: 1.0}
        self.choices = [(parameters.some((*always, *s)), weight[INERTIAS in s]) for s in self.sets]
        whole = with_columns(trials)
        self.steps = HeldOutSteps(skeleton, whole, trajectory, phi=phi, extra=parameters.prior)

    def best_kinds(
        self, unseen: Sequence[Bool[np.ndarray, " frames"]] | None = None, *, taught: bool = True
    ) -> tuple[str, ...]:
        """The set of kinds that predicts hidden blocks best; each has to earn a clear lead.

        Args:
            unseen: by trial, frames that are not judged; None: all are.
            taught: whether they may teach what is judged elsewhere. What steps share cannot be judged without
                hiding whole steps; single blocks hardly matter, and asking once will do.
        """
        if taught:
            blocks = self._judged
        else:
            assert unseen is not None
            blocks = self._judged_without(unseen)
        squares, of_trial = [], []
        for block in blocks:
            seen = slice(None) if unseen is None else ~unseen[block.trial][block.frames]
            if len(block.frames[seen]):
                squares.append(block.squares[:, seen].sum(axis=1))
                of_trial.append(block.trial)
        return _best(self.sets, np.array(squares), np.array(of_trial)) if len(squares) > 1 else ()

    def missed(
        self, held_out: Sequence[Bool[np.ndarray, " frames"]], taken: tuple[str, ...]
    ) -> list[Float[np.ndarray, "hidden 6"]]:
        """Residuals on the held-out frames of each trial, as `HeldOutSteps.missed`, with these kinds."""
        choice = self.choices[self.sets.index(taken)]
        return [missed[0] for missed in self.steps.missed(self._layout(held_out), [choice])]

    def learnt(
        self, taken: tuple[str, ...]
    ) -> tuple[LearntTerms, list[Float[np.ndarray, "coefficients dofs"]]]:
        """What terms of these kinds come to in one step, by all known frames; and the splines there."""
        choice, begun = self.choices[self.sets.index(taken)], self.steps.state
        (step,) = self.steps.steps(self._layout([np.zeros_like(t.counts) for t in self.trials]), [choice])
        there = begun.shared.moved(step.shared)
        splines = [c + s for c, s in zip(begun.coefficients, step.coefficients, strict=True)]
        return LearntTerms(taken, there.phi, there.x[choice[0]], self.peak_N), splines

    @cached_property
    def _judged(self) -> "list[_Block]":
        return self._judged_without([np.zeros_like(trial.counts) for trial in self.trials])

    def _judged_without(self, unseen: Sequence[Bool[np.ndarray, " frames"]]) -> "list[_Block]":
        """Every hidden block of known frames, by all sets of kinds that never saw others."""
        known = [replace(t, counts=t.counts & ~u) for t, u in zip(self.trials, unseen, strict=True)]
        judged = []
        for turn in range(self.trajectory.held_out_every):
            blocks = [_frames_of_blocks(trial, turn, self.trajectory) for trial in known]
            held_out = [_any(own, trial) | u for own, trial, u in zip(blocks, known, unseen, strict=True)]
            pairs = zip(held_out, self.trials, strict=True)
            if not any(blocks) or not any((trial.counts & ~hidden).any() for hidden, trial in pairs):
                continue
            missed_of_all = self.steps.missed(self._layout(held_out), self.choices)
            for i, (missed, own) in enumerate(zip(missed_of_all, blocks, strict=True)):
                all_hidden = np.flatnonzero(held_out[i])
                for frames in own:
                    squares = _squares(missed[:, np.searchsorted(all_hidden, frames)], self.trials[i], frames)
                    judged.append(_Block(i, frames, squares))
        return judged

    def _layout(self, held_out: Sequence[Bool[np.ndarray, " frames"]]) -> list[TrialHeldOut]:
        """With columns that were made without these frames."""
        seen = [replace(t, counts=t.counts & ~h) for t, h in zip(self.trials, held_out, strict=True)]
        layout = []
        for frames, trial in zip(held_out, self.with_columns(seen), strict=True):
            assert trial.extra_columns_ground is not None
            layout.append(TrialHeldOut(frames, trial.extra_columns_ground))
        return layout


@dataclass(frozen=True)
class _Block:
    """Known frames that were hidden together, and what each set of kinds missed there."""

    trial: int
    frames: Int[np.ndarray, " some"]
    squares: Float[np.ndarray, "sets some 2"]  # of force [N²], of moment about the root [N²·m²]


def _best(
    sets: Sequence[tuple[str, ...]],
    squares: Float[np.ndarray, "blocks sets 2"],
    of_trial: Int[np.ndarray, " blocks"],
) -> tuple[str, ...]:
    """The set whose errors are smallest, where blocks agree that it is better than the first one.

    Args:
        sets: of kinds, the first one empty.
        squares: sums over a block's frames, of force and of moment.
        of_trial: each block's trial.
    """
    by_trial = np.stack([squares[of_trial == i].sum(axis=0) for i in np.unique(of_trial)])
    shares = np.array([(of_trial == i).mean() for i in np.unique(of_trial)])
    worse = 0.5 * np.log(by_trial / by_trial[:, :1])
    score = shares @ worse.mean(axis=2)
    score += CLEAR_MARGIN * np.array([len(s) for s in sets])
    score[np.any(worse > np.log1p(MOST_WORSE), axis=(0, 2))] = np.inf
    each = 0.5 * np.log(squares / squares[:, :1]).mean(axis=2)
    scatter = each.std(axis=0, ddof=1) / np.sqrt(len(each))
    score[1:][(each.mean(axis=0) + AGREEMENT * scatter)[1:] > 0] = np.inf
    return sets[int(np.argmin(score))]


def _frames_of_blocks(
    trial: TrialData, turn: int, settings: TrajectorySettings
) -> list[Int[np.ndarray, " some"]]:
    """Every k-th block of known frames, beginning with another one each turn."""
    known = np.flatnonzero(trial.counts)
    length = max(1, round(settings.held_out_block_s * trial.start.rate))
    starts = range(turn * length, len(known) - length // 2, settings.held_out_every * length)
    return [known[start : start + length] for start in starts]


def _any(blocks: Sequence[Int[np.ndarray, " some"]], trial: TrialData) -> Bool[np.ndarray, " frames"]:
    held_out = np.zeros(len(trial.counts), dtype=bool)
    for block in blocks:
        held_out[block] = True
    return held_out


def _squares(
    missed: Float[np.ndarray, "sets some 6"], trial: TrialData, frames: Int[np.ndarray, " some"]
) -> Float[np.ndarray, "sets some 2"]:
    """Of force [N²], of moment about the root [N²·m²].

    Frames near the trial's ends, where motions know nothing beyond, are not counted.
    """
    end = round(ENDS_S * trial.start.rate)
    inside = (frames >= end) & (frames < len(trial.counts) - end)
    squares = (missed**2).reshape(*missed.shape[:2], 2, 3).sum(axis=3)
    return np.where(inside[None, :, None], squares, 1e-12)
