"""Whether a foot's motion is that of a foot on the ground: some corner of its sole moves with the surface."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from solver.common.runs import runs
from solver.contact.detection_balance import UP
from solver.contact.detection_settings import DetectionSettings
from solver.contact.wrenches import ContactWrenches


def slip_speeds(
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    loaded: Bool[np.ndarray, "frames feet"],
    rate: float,
    settings: DetectionSettings,
) -> Float[np.ndarray, "frames feet"]:
    """Speed at which each foot's slowest low corner moves against the surface it would stand on [m/s].

    The surface's velocity is learnt from loaded soles near in time: nothing on a floor, the belt's on a
    treadmill, also while it changes. No height is asked for: a step of a staircase is as good as the floor.

    Args:
        corners_ground: of each foot's sole [m], filtered.
        loaded: frames on which a plate carries the foot.
        rate: [Hz].
        settings: thresholds.
    """
    velocities = [np.gradient(corners, 1.0 / rate, axis=0) for corners in corners_ground]
    slowest = [_touching_velocity(c, v) for c, v in zip(corners_ground, velocities, strict=True)]
    surface = _surface_velocity(np.stack(slowest, axis=1), loaded, rate, settings.belt_window_s)
    columns = []
    for f, (corners, velocity) in enumerate(zip(corners_ground, velocities, strict=True)):
        height = corners[..., 1]
        low = height <= height.min(axis=1, keepdims=True) + settings.lowest_part_m
        against = velocity.copy()
        against[..., [0, 2]] -= surface[:, f, None]
        speed = np.linalg.norm(against, axis=2)
        columns.append(np.where(low, speed, np.inf).min(axis=1))
    return np.stack(columns, axis=1)


def _touching_velocity(
    corners: Float[np.ndarray, "frames corners 3"], velocity: Float[np.ndarray, "frames corners 3"]
) -> Float[np.ndarray, "frames 2"]:
    """Horizontal velocity of the lowest corner [m/s]."""
    lowest = corners[..., 1].argmin(axis=1)
    return velocity[np.arange(len(corners)), lowest][:, [0, 2]]


def _surface_velocity(
    velocity: Float[np.ndarray, "frames feet 2"],
    loaded: Bool[np.ndarray, "frames feet"],
    rate: float,
    window_s: float,
) -> Float[np.ndarray, "frames feet 2"]:
    """Median over loaded frames near in time, of the same foot where it has any; zero without any."""
    frames, feet = loaded.shape
    reach = round(window_s * rate)
    grid = np.unique(np.append(np.arange(0, frames, max(1, reach // 10)), frames - 1))
    own = [np.flatnonzero(loaded[:, f]) for f in range(feet)]
    surface = np.zeros_like(velocity)
    for f in range(feet):
        choices = [[f], [g for g in range(feet) if g != f]]
        known = np.stack([_median_near(velocity, own, choices, t, reach) for t in grid])
        for axis in range(2):
            surface[:, f, axis] = np.interp(np.arange(frames), grid, known[:, axis])
    return surface


def _median_near(
    velocity: Float[np.ndarray, "frames feet 2"],
    own: Sequence[np.ndarray],
    choices: Sequence[Sequence[int]],
    t: int,
    reach: int,
) -> Float[np.ndarray, "2"]:
    for span in (reach, len(velocity)):
        for some in choices:
            pool = [velocity[_near(own[f], t, span), f] for f in some]
            if sum(map(len, pool)):
                return np.median(np.concatenate(pool), axis=0)
    return np.zeros(2)


def _near(frames: np.ndarray, t: int, reach: int) -> np.ndarray:
    return frames[np.searchsorted(frames, t - reach) : np.searchsorted(frames, t + reach + 1)]


def ground_odds(
    slip: Float[np.ndarray, "frames feet"], settings: DetectionSettings
) -> Float[np.ndarray, "frames feet"]:
    """Natural log odds that each foot stands: its slip against the trial's own pace.

    Args:
        slip: from `slip_speeds` [m/s].
        settings: thresholds.
    """
    pace = np.percentile(slip, 95)
    limit = max(settings.slip_m_s, settings.slip_share * pace)
    odds = 2.0 * np.log(limit / np.maximum(slip, 1e-3))
    return np.clip(odds, -settings.strongest_motion, settings.strongest_motion)


def touching_unloaded(
    contacts: ContactWrenches,
    ground: Float[np.ndarray, "frames feet"],
    weight_N: float,
    rate: float,
    settings: DetectionSettings,
) -> Bool[np.ndarray, "frames feet"]:
    """Frames on which a foot rests on its plate without a load, as the one behind in a slow double support.

    The foot keeps still between two loads of one plate, so it never left that plate; the load fades out and
    in, so the plate did not drop out; it is over soon. Its zero is a measurement then, and a still sole no
    sign of a missing force.

    Args:
        contacts: forces given to feet.
        ground: from `ground_odds`.
        weight_N: of the body.
        rate: [Hz].
        settings: thresholds.
    """
    touching = np.zeros_like(contacts.in_contact)
    load = contacts.wrench_raw_ground[..., UP]
    for f in range(contacts.in_contact.shape[1]):
        for start, end in runs(~contacts.in_contact[:, f]):
            if start == 0 or end == contacts.frames or end - start > settings.touching_s * rate:
                continue
            same_plate = (contacts.plate[start - 1 : end + 1] == f).all(axis=0).any()
            fades = max(load[start - 1, f], load[end, f]) < settings.dropout * weight_N
            touching[start:end, f] = same_plate and fades and (ground[start:end, f] > 0).all()
    return touching
