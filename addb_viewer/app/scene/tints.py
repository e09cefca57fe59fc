"""Colours of the bones that say how large something is, frame by frame."""

import numpy as np
from jaxtyping import Float, UInt8

from addb_viewer.trial_view.palette import LOAD_STEPS, load_colors
from addb_viewer.trial_view.replay import Replay

NONE, TORQUE, RESIDUAL = "one colour", "joint torque", "residual"
TINTS = (NONE, TORQUE, RESIDUAL)
OVER = 2.0  # times its limit: a residual that has the last colour


def tints(replay: Replay, kind: str) -> UInt8[np.ndarray, "frames bodies 3"] | None:
    """Of every body; None where nothing is known, or asked for.

    Args:
        replay: the trial.
        kind: one of `TINTS`.
    """
    share = _share(replay, kind)
    return None if share is None else load_colors(np.rint(share * LOAD_STEPS) / LOAD_STEPS)


def tint_words(replay: Replay, kind: str) -> tuple[str, str, str] | None:
    """What the colours stand for: their quantity, and what the first and the last one mean."""
    if _share(replay, kind) is None:
        return None
    if kind == TORQUE and replay.joint_loads is not None:
        return "joint torque, on the bone beyond the joint", "0", f"≥ {replay.joint_loads.large:.0f} N·m"
    assert replay.residual is not None
    return "residual force", "0", f"≥ {OVER * replay.residual.force_limit:.0f} N, {OVER:g} times its limit"


def _share(replay: Replay, kind: str) -> Float[np.ndarray, "frames bodies"] | None:
    """Of what has the last colour [0 to 1]; NaN where it is not known."""
    if replay.bodies is None:
        return None
    if kind == TORQUE and replay.joint_loads is not None and replay.joint_loads.large > 0:
        return np.minimum(replay.joint_loads.of_bodies / replay.joint_loads.large, 1.0)
    if kind == RESIDUAL and replay.residual is not None:
        size = np.linalg.norm(replay.residual.force, axis=1) / (OVER * replay.residual.force_limit)
        return np.repeat(np.minimum(size, 1.0)[:, None], len(replay.bodies.names), axis=1)
    return None
