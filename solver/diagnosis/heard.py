"""What a shifted clock puts outside the recording takes no part in the evidence, for no hypothesis."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool

from solver.diagnosis.balance import Balance
from solver.diagnosis.contenders import Found
from solver.diagnosis.rows import TrialRows


def without_the_unheard(balance: Balance, found: Sequence[Found]) -> Balance | None:
    """The balance without the frames of which nothing was recorded if the named causes are right.

    Forces that are 0.1 s early say nothing of the last 0.1 s. Left as they are, those frames would ask for a
    further cause: a contact at the end of the trial.

    Args:
        balance: of all trials.
        found: causes of it that shift time.

    Returns:
        None where no window is lost, or nothing would be left of a trial. What was evaluated so far counts.
    """
    trials = []
    for trial in balance.trials:
        lost = _unheard(trial, found)
        whole = not trial.touched_by(lost).any()
        trials.append(trial if whole else trial.without(_with_the_filters_ends(lost, trial, balance)))
    if all(one is other for one, other in zip(trials, balance.trials, strict=True)):
        return None
    if not all(t.windows.count for t in trials):
        return None
    heard = Balance(trials, balance.settings).witnessed(balance.accused, balance.weighings)
    heard.evaluations = balance.evaluations
    return heard


def shifts_time(found: Found, balance: Balance) -> bool:
    """Whether a cause reads the recording at other times, some of which lie outside it."""
    term = found.contender.term
    return any(term.candidate.unheard(scene, term.eta).any() for scene in balance.scenes)


def _unheard(trial: TrialRows, found: Sequence[Found]) -> Bool[np.ndarray, " frames"]:
    lost = np.zeros(trial.scene.frames, dtype=bool)
    for one in found:
        term = one.contender.term
        lost |= term.candidate.unheard(trial.scene, term.eta)
    return lost


def _with_the_filters_ends(
    lost: Bool[np.ndarray, " frames"], trial: TrialRows, balance: Balance
) -> Bool[np.ndarray, " frames"]:
    """Frames beside them as well: what is read there lies at the recording's end."""
    reach = round(balance.settings.end_s * trial.scene.rate)
    return np.convolve(lost, np.ones(2 * reach + 1), mode="same") > 0
