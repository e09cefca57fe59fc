"""What another solve changed in a trial: residuals, marker error, and joint torques near the edit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.trial_view.replay import Replay
from solver.common.true_runs import runs

NEAR_S = 0.15  # [s] around an edit: what a re-solve changes most lies there
MOST_JOINTS = 6


@dataclass(frozen=True)
class TorqueChange:
    """Of one joint, on the frames near the edit."""

    name: str
    rms: float  # [N·m or N]
    largest: float  # likewise, with its sign
    frame: int  # of the largest
    unit: str


@dataclass(frozen=True)
class Comparison:
    """Two solves of one trial."""

    rows: tuple[tuple[str, str, str], ...]  # what, before, now
    edited: tuple[tuple[int, int], ...]  # ranges on which other forces count
    torques: tuple[TorqueChange, ...]


def compared(
    before: Replay, now: Replay, figures_before: Mapping[str, Any], figures_now: Mapping[str, Any]
) -> Comparison:
    """Put two solves of a trial side by side.

    Args:
        before: the trial in the solve that is compared with.
        now: in the one on the screen.
        figures_before: in the shape of `fit --json`, of the trial.
        figures_now: likewise.
    """
    changed = changed_frames(before, now)
    return Comparison(
        rows=tuple(_rows(figures_before, figures_now)),
        edited=tuple((int(a), int(b)) for a, b in runs(changed)),
        torques=torque_changes(before, now, changed),
    )


def changed_frames(before: Replay, now: Replay) -> Bool[np.ndarray, " frames"]:
    """Frames on which one solve used a foot's force and the other did not."""
    feet = tuple(dict.fromkeys((*before.feet, *now.feet)))
    return np.asarray((_left_out(before, feet) != _left_out(now, feet)).any(axis=1))


def torque_changes(
    before: Replay, now: Replay, changed: Bool[np.ndarray, " frames"]
) -> tuple[TorqueChange, ...]:
    """The joints whose torques changed most near the edit; over the whole trial where nothing was edited.

    Of the root's coordinates nothing is told: theirs are the residual, which has its own line.
    """
    if before.joints is None or now.joints is None:
        return ()
    if before.joints.torque is None or now.joints.torque is None or before.joints.names != now.joints.names:
        return ()
    difference = now.joints.torque - before.joints.torque
    near = around(changed, round(NEAR_S * now.rate)) if changed.any() else np.ones(now.frames, dtype=bool)
    near &= np.isfinite(difference).all(axis=1)
    if not near.any():
        return ()
    joints = [i for i, name in enumerate(now.joints.names) if name not in now.joints.of_root]
    found = [_change(now, i, difference[:, i], near) for i in joints]
    return tuple(sorted(found, key=lambda change: -change.rms)[:MOST_JOINTS])


def around(frames: Bool[np.ndarray, " frames"], reach: int) -> Bool[np.ndarray, " frames"]:
    """The frames, and those so near to them."""
    counted = np.convolve(frames.astype(int), np.ones(2 * reach + 1, dtype=int))
    return counted[reach : reach + len(frames)] > 0


def _change(
    replay: Replay, index: int, difference: Float[np.ndarray, " frames"], near: Bool[np.ndarray, " frames"]
) -> TorqueChange:
    assert replay.joints is not None
    at = int(np.flatnonzero(near)[np.abs(difference[near]).argmax()])
    unit = "N·m" if replay.joints.rotates[index] else "N"
    rms = float(np.sqrt(np.mean(difference[near] ** 2)))
    return TorqueChange(replay.joints.names[index], rms, float(difference[at]), at, unit)


def _left_out(replay: Replay, feet: tuple[str, ...]) -> Bool[np.ndarray, "frames feet"]:
    out = np.zeros((replay.frames, len(feet)), dtype=bool)
    for start, end, foot, _ in replay.forces.missing:
        out[start:end, slice(None) if foot is None else [feet.index(foot)] if foot in feet else []] = True
    return out


def _rows(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    was, is_now = (str(figures.get("frames_with_force_used", "–")) for figures in (before, now))
    rows = [("Frames counted", was, is_now)]
    for label, section, key, unit, factor, digits in (
        ("Residual force", "linear_residual", "rms_N", "N", 1.0, 1),
        ("Residual moment", "angular_residual", "rms_Nm", "N·m", 1.0, 1),
        ("Held-out force", "held_out.linear_residual", "rms_N", "N", 1.0, 1),
        ("Held-out moment", "held_out.angular_residual", "rms_Nm", "N·m", 1.0, 1),
        ("Marker error", "", "marker_rms_m", "cm", 100.0, 2),
        ("Largest one", "", "marker_max_m", "cm", 100.0, 2),
    ):
        values = [_number(figures, section, key) for figures in (before, now)]
        if any(v is not None for v in values):
            told = ["–" if v is None else f"{factor * v:.{digits}f} {unit}" for v in values]
            rows.append((label, told[0], told[1]))
    return rows


def _number(figures: Mapping[str, Any], section: str, key: str) -> float | None:
    for part in filter(None, section.split(".")):
        figures = figures.get(part) or {}
    value = figures.get(key)
    return None if value is None else float(value)
