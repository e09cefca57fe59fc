"""Stretches on which labels are wrong, bounded by frames on which they are clearly right."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int8

from solver.kinematics.label_faults.settings import LabelRepairSettings

UNKNOWN, RIGHT, UNCLEAR, WRONG = 0, 1, 2, 3  # what a frame's distances say of a label


@dataclass(frozen=True)
class Stretch:
    """Frames start to end − 1 are wrong, `after_right` and `before_right` the right ones around them."""

    start: int
    end: int
    after_right: int | None  # None: wrong from the recording's start
    before_right: int | None  # None: wrong to its end


def stretches(
    state: Int8[np.ndarray, " frames"],
    off_m: Float[np.ndarray, " frames"],
    rate: float,
    settings: LabelRepairSettings,
) -> list[Stretch]:
    """Wrong frames between two right ones, where they begin and end at once or in a gap.

    Args:
        state: of each frame.
        off_m: how far distances are off as recorded [m], NaN where unknown.
        rate: [Hz].
        settings: limits.
    """
    wrong, right = np.flatnonzero(state == WRONG), np.flatnonzero(state == RIGHT)
    most = settings.most_share * (state != UNKNOWN).sum()
    if len(wrong) < settings.fewest_frames or len(right) == 0 or len(wrong) > most:
        return []
    found = []
    place = np.searchsorted(right, wrong)  # wrong frames between the same two right ones are together
    for k in np.unique(place):
        own = wrong[place == k]
        stretch = Stretch(
            int(own[0]),
            int(own[-1]) + 1,
            int(right[k - 1]) if k > 0 else None,
            int(right[k]) if k < len(right) else None,
        )
        inside = state[stretch.start : stretch.end]
        clear = len(own) >= settings.clear_share * (inside != UNKNOWN).sum()
        if len(own) >= settings.fewest_frames and clear and _bounded(stretch, state, off_m, rate, settings):
            found.append(stretch)
    return found


def _bounded(
    stretch: Stretch,
    state: Int8[np.ndarray, " frames"],
    off_m: Float[np.ndarray, " frames"],
    rate: float,
    settings: LabelRepairSettings,
) -> bool:
    """Whether both ends are a step, a gap, or the recording's end."""
    first, last = stretch.after_right, stretch.before_right
    for right, between, wrong in (
        (first, state[(-1 if first is None else first) + 1 : stretch.start], stretch.start),
        (last, state[stretch.end : last], stretch.end - 1),
    ):
        if (between == UNCLEAR).sum() > settings.step_frames:
            return False
        if right is None:
            continue
        if (between == UNKNOWN).sum() > settings.longest_gap_s * rate:
            return False
        if off_m[right] > settings.better * off_m[wrong]:
            return False
    return True
