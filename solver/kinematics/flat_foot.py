"""How high foot markers stand over the sole: a foot that rests on the ground shows it.

The ground is level and the sole of a resting foot lies on it, so there the heights of its markers are those
over the sole, up to one constant. That decides how the foot is pitched and tilted against its markers, which
the usual places of landmarks tell no better than within 5°.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Markers
from solver.common.runs import runs
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.scale_prior import offset_std
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.skeleton import Skeleton

RESTS_M_S = 0.05  # vertical speed below which a marker rests; those of a moving foot pass it within 2-20 ms
RESTS_S = 0.1  # for at least so long, all markers of the foot: the flat phase of a walking step lasts 0.2 s
LOW_M = 0.015  # over the lowest rest of the same foot in the recording: higher up it stands on something else
HEIGHT_STD_M = 0.005  # of a height over the sole: soft shoes, ground, the frames chosen
FOREFOOT_FROM_HEEL_M = 0.08  # markers nearer to each other do not tell the foot's pitch
NOTABLE_M = 1e-4  # a marker whose place is so near stays as it is
BELIEVED = 3.0  # standard deviations; a foot whose heights are further from the usual ones does not lie flat


def on_flat_feet(
    skeleton: Skeleton, match: MarkerMatch, recordings: Sequence[Markers], settings: KinematicsSettings
) -> Skeleton:
    """The skeleton with its foot markers at the heights over the sole that resting feet show.

    Args:
        skeleton: the default body, whose soles are parallel to the x-z planes of calcn and toes.
        match: which label is which marker.
        recordings: of one subject, y up.
        settings: how far markers may lie from their places.
    """
    place = {marker.name: marker.position_body for marker in skeleton.markers}
    moved: dict[str, np.ndarray] = {}
    std = dict(zip(skeleton.marker_names, offset_std(skeleton.markers, settings), strict=True))
    for side in "rl":
        foot = [skeleton.body_index(f"{body}_{side}") for body in ("calcn", "toes")]
        names = [m.name for m in skeleton.markers if m.name in match.model and m.body in foot]
        behind = [m.position_body[0] for m in skeleton.markers if m.name in names and m.body == foot[0]]
        if not behind or np.ptp(behind) < FOREFOOT_FROM_HEEL_M:
            continue
        columns = [match.model.index(name) for name in names]
        height = resting_heights([(match.observed(r)[:, columns, 1], r.rate) for r in recordings])
        usual = np.array([place[name][1] for name in names])
        variance = np.array([std[name] for name in names]) ** 2
        shown = np.isfinite(height)
        if not shown.any():
            continue
        raised = height - usual
        raised -= np.average(raised[shown], weights=1 / variance[shown])
        if (np.abs(raised[shown]) > BELIEVED * np.sqrt(variance[shown])).any():
            continue
        believed = np.where(shown, raised * variance / (variance + HEIGHT_STD_M**2), 0.0)
        for name, up in zip(names, believed, strict=True):
            if abs(up) > NOTABLE_M:
                moved[name] = place[name] + np.array([0.0, up, 0.0])
    return skeleton.with_markers(
        [replace(m, position_body=moved[m.name]) if m.name in moved else m for m in skeleton.markers]
    )


def resting_heights(
    recordings: Sequence[tuple[Float[np.ndarray, "frames markers"], float]],
) -> Float[np.ndarray, " markers"]:
    """Median height of each marker of one foot while the whole foot rests [m]; NaN where it never does.

    Heights count from the mean of those markers that all rests show, so that the ground's own height, which
    may differ between recordings, drops out.

    Args:
        recordings: heights [m] of the foot's markers, NaN where unseen, and the rate [Hz] of each.
    """
    resting = np.concatenate([height[_at_rest(height, rate)] for height, rate in recordings])
    if not len(resting):
        return np.full(resting.shape[1], np.nan)
    common = np.isfinite(resting).mean(axis=0) > 0.5
    whole = np.isfinite(resting[:, common]).all(axis=1)
    if common.sum() < 2 or not whole.any():
        return np.full(resting.shape[1], np.nan)
    level = resting[whole] - resting[whole][:, common].mean(axis=1, keepdims=True)
    seen = np.isfinite(level).any(axis=0)
    median = np.full(resting.shape[1], np.nan)
    median[seen] = np.nanmedian(level[:, seen], axis=0)
    return median


def _at_rest(height: Float[np.ndarray, "frames markers"], rate: float) -> Bool[np.ndarray, " frames"]:
    """Frames on which every visible marker rests, low, and at least two are visible."""
    if len(height) < 2:
        return np.zeros(len(height), dtype=bool)
    visible = np.isfinite(height)
    slow = ~visible | (np.abs(np.gradient(height, 1 / rate, axis=0)) < RESTS_M_S)
    still = slow.all(axis=1) & (visible.sum(axis=1) >= 2)
    long = np.zeros(len(height), dtype=bool)
    for start, end in runs(still):
        long[start:end] = end - start >= RESTS_S * rate
    if not long.any():
        return long
    lowest = [np.nanmin(column) if np.isfinite(column).any() else np.nan for column in height[long].T]
    return long & (~visible | (height < np.array(lowest) + LOW_M)).all(axis=1)
