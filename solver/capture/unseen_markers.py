"""The ways in which marker files say "not seen", made into one: NaN."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float


def unseen_as_nan(
    positions: Float[np.ndarray, "frames markers 3"], names: Sequence[str], source: str
) -> tuple[Float[np.ndarray, "frames markers 3"], tuple[str, ...]]:
    """NaN where a marker stands at exactly 0 0 0 or lacks a coordinate.

    Args:
        positions: in the file's units.
        names: the markers.
        source: the file, for the notes.
    """
    written = np.isfinite(positions)
    zero = (positions == 0).all(axis=2)
    torn = written.any(axis=2) & ~written.all(axis=2)
    notes = _listed(zero, names, f"{source}: 0 0 0 counts as not seen")
    notes += _listed(torn, names, f"{source}: a coordinate is missing, the marker counts as not seen")
    cleaned = np.where((zero | ~written.all(axis=2))[:, :, None], np.nan, positions)
    never = [name for k, name in enumerate(names) if not np.isfinite(cleaned[:, k]).any()]
    if never:
        notes += (f"{source}: never seen: {', '.join(never)}",)
    return cleaned, notes


def far_as_nan(
    positions_m: Float[np.ndarray, "frames markers 3"], names: Sequence[str], source: str, farthest_m: float
) -> tuple[Float[np.ndarray, "frames markers 3"], tuple[str, ...]]:
    """NaN where a marker lies farther off than any laboratory is wide [m]."""
    far = (np.abs(positions_m) > farthest_m).any(axis=2)
    notes = _listed(far, names, f"{source}: more than {farthest_m:g} m away counts as not seen")
    return np.where(far[:, :, None], np.nan, positions_m), notes


def _listed(where: Bool[np.ndarray, "frames markers"], names: Sequence[str], heading: str) -> tuple[str, ...]:
    if not where.any():
        return ()
    counts = where.sum(axis=0)
    listed = ", ".join(f"{name} ({count} frames)" for name, count in zip(names, counts, strict=True) if count)
    return (f"{heading}: {listed}",)
