"""Where a trial's residual is largest, of the frames that its figures count."""

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.trial_view.replay import ResidualReplay


def beyond(residual: ResidualReplay) -> Bool[np.ndarray, " frames"]:
    """Frames that count and on which force or moment is beyond its limit."""
    return np.asarray(residual.used & (_in_limits(residual) > 1.0))


def _in_limits(residual: ResidualReplay) -> Float[np.ndarray, " frames"]:
    """Force or moment, whichever is larger in units of its limit; NaN where nobody knows."""
    force, moment = np.linalg.norm(residual.force, axis=1), np.linalg.norm(residual.moment, axis=1)
    return np.fmax(force / residual.force_limit, moment / residual.moment_limit)


def worst_frame(residual: ResidualReplay) -> tuple[int, str]:
    """Where force or moment, whichever is larger in units of its limit, is largest; and that in words.

    Args:
        residual: with at least one frame that counts.
    """
    force, moment = np.linalg.norm(residual.force, axis=1), np.linalg.norm(residual.moment, axis=1)
    over = _in_limits(residual)
    frame = int(np.where(residual.used & np.isfinite(over), over, -1.0).argmax())
    return frame, (
        f"Frame {frame}: residual {force[frame]:.0f} N, {moment[frame]:.0f} N·m; the limits are "
        f"{residual.force_limit:.0f} N, {residual.moment_limit:.0f} N·m."
    )
