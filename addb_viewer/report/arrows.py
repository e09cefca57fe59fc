"""The forces of a trial as arrows, for pictures and for the player: from where, how large, which colour."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from addb_viewer.trial_view.cause_pictures import pictures
from addb_viewer.trial_view.drawing import METRES_PER_NEWTON, SMALLEST_N, SMALLEST_RESIDUAL_N
from addb_viewer.trial_view.palette import CAUSE, INK, RESIDUAL, UNASSIGNED, Rgb, foot_color
from addb_viewer.trial_view.replay import Replay


@dataclass(frozen=True)
class Arrow:
    """One force over the trial; NaN on frames without it."""

    label: str
    start: Float[np.ndarray, "frames 3"]  # [m]
    force: Float[np.ndarray, "frames 3"]  # [N]
    color: Rgb
    is_required: bool = False  # by the motion, not measured
    metres_per_newton: float = METRES_PER_NEWTON


def arrows_of(replay: Replay, diagnosis: Mapping[str, Any] | None) -> tuple[Arrow, ...]:
    """Measured forces by foot, forces that the motion demands of a foot without one, causes, the residual.

    Args:
        replay: the trial.
        diagnosis: in the shape of `diagnose --json`; None where nobody asked.
    """
    found = []
    for plate in replay.plates:
        for foot in (-1, *range(len(replay.feet))):
            belongs = plate.foot < 0 if foot < 0 else plate.foot == foot
            color = UNASSIGNED if foot < 0 else foot_color(replay.feet[foot], foot)
            force = np.where(belongs[:, None], plate.force, np.nan)
            found.append(Arrow(plate.name, *_large(plate.cop, force, SMALLEST_N), color))
    for required in replay.required:
        told = f"required of {required.foot}"
        found.append(Arrow(told, *_large(required.point, required.force, SMALLEST_N), INK, is_required=True))
    for picture in pictures(diagnosis, replay) if diagnosis else ():
        if picture.force is not None and picture.place is not None:
            force = np.where(picture.acts[:, None], picture.force, np.nan)
            start, force = _large(picture.place, force, 0.0)
            scale = picture.metres_per_newton
            found.append(Arrow(picture.label, start, force, CAUSE, metres_per_newton=scale))
    if replay.residual is not None:
        counted = np.where(replay.residual.used[:, None], replay.residual.force, np.nan)
        found.append(Arrow("residual", *_large(replay.residual.com, counted, SMALLEST_RESIDUAL_N), RESIDUAL))
    return tuple(arrow for arrow in found if np.isfinite(arrow.force).any())


def _large(
    start: Float[np.ndarray, "frames 3"], force: Float[np.ndarray, "frames 3"], smallest_N: float
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
    """Unknown where the force is too small to be drawn, or its place is not known."""
    with np.errstate(invalid="ignore"):
        shown = np.isfinite(start).all(axis=1) & (np.linalg.norm(force, axis=1) >= smallest_N)
    return np.where(shown[:, None], start, np.nan), np.where(shown[:, None], force, np.nan)
