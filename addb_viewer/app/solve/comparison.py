"""What another solve changed in a trial: residuals, marker error, and joint torques near the edit."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.trial_view.replay import Replay, ResidualReplay
from solver.common.true_runs import runs
from solver.fitting.fit_summary import TrialFigures

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
    before: Replay, now: Replay, figures_before: TrialFigures | None, figures_now: TrialFigures | None
) -> Comparison:
    """Put two solves of a trial side by side.

    Args:
        before: the trial in the solve that is compared with.
        now: in the one on the screen.
        figures_before: of the trial; None: that solve has none of it.
        figures_now: likewise.
    """
    changed = changed_frames(before, now)
    return Comparison(
        rows=tuple(_rows(figures_before, figures_now)),
        edited=tuple((int(a), int(b)) for a, b in runs(changed)),
        torques=torque_changes(before, now, changed),
    )


WORSE = 0.1  # by how much of itself a figure grows before a solve is called worse


def got_worse(
    before: Replay, now: Replay, figures_before: TrialFigures | None, figures_now: TrialFigures | None
) -> tuple[str, ...]:
    """What another solve made worse in a trial, as "residual force 9.3 → 20.1 N".

    Residuals are compared on frames that count in both. Frames that count in the new one alone make it worse
    where what is missing on them is beyond the limit, and more than was missing before. Forces that were held
    out are compared where the same frames count: else other ones are held out.

    Args:
        before: the trial in the solve that is compared with.
        now: in the new one.
        figures_before: of the trial; None: that solve has none of it.
        figures_now: likewise.
    """
    told = _residuals_worse(before.residual, now.residual)
    first = len(_RESIDUALS) + (len(_HELD_OUT) if changed_frames(before, now).any() else 0)
    rows = list(zip(_TOLD, _values(figures_before), _values(figures_now), strict=True))
    for row, was, is_now in rows[first:]:
        if was is not None and is_now is not None and is_now > (1 + WORSE) * was:
            told.append(_change_words(row, was, is_now))
    return tuple(told)


def _residuals_worse(before: ResidualReplay | None, now: ResidualReplay | None) -> list[str]:
    if before is None or now is None or len(before.used) != len(now.used):
        return []
    told = []
    both, added = before.used & now.used, now.used & ~before.used
    for row, was_missing, is_missing, limit in zip(
        _RESIDUALS,
        (before.force, before.moment),
        (now.force, now.moment),
        (now.force_limit, now.moment_limit),
        strict=True,
    ):
        was, is_now = _rms(was_missing[both]), _rms(is_missing[both])
        if is_now > (1 + WORSE) * was:
            told.append(_change_words(row, was, is_now))
        elif (on_added := _rms(is_missing[added])) > max(limit, (1 + WORSE) * was):
            told.append(f"{_change_words(row, was, on_added)} on frames that count now")
    return told


def _rms(vectors: Float[np.ndarray, "frames 3"]) -> float:
    """0 of none."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean())) if len(vectors) else 0.0


def _change_words(row: tuple[str, str, int], was: float, is_now: float) -> str:
    label, unit, digits = row
    return f"{label.lower()} {was:.{digits}f} → {is_now:.{digits}f} {unit}"


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


def _rows(before: TrialFigures | None, now: TrialFigures | None) -> list[tuple[str, str, str]]:
    was, is_now = ("–" if each is None else str(each.frames_with_force_used) for each in (before, now))
    rows = [("Frames counted", was, is_now)]
    for (label, unit, digits), *values in zip(_TOLD, _values(before), _values(now), strict=True):
        if any(v is not None for v in values):
            told = ["–" if v is None else f"{v:.{digits}f} {unit}" for v in values]
            rows.append((label, told[0], told[1]))
    return rows


_RESIDUALS = ("Residual force", "N", 1), ("Residual moment", "N·m", 1)  # name, unit, digits
_HELD_OUT = ("Held-out force", "N", 1), ("Held-out moment", "N·m", 1)
_TOLD = (*_RESIDUALS, *_HELD_OUT, ("Marker error", "cm", 2), ("Largest one", "cm", 2))


def _values(figures: TrialFigures | None) -> tuple[float | None, ...]:
    if figures is None:
        return (None,) * len(_TOLD)
    linear, angular, held_out = figures.linear_residual, figures.angular_residual, figures.held_out
    return (
        linear and linear.rms_N,
        angular and angular.rms_Nm,
        held_out and held_out.linear_residual.rms_N,
        held_out and held_out.angular_residual.rms_Nm,
        *(m and 100 * m for m in (figures.marker_rms_m, figures.marker_max_m)),
    )
