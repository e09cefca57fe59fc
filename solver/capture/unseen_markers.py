"""The ways in which marker files say "not seen", made into one: NaN."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from solver.common.notes import Kind, Note, noted


def unseen_as_nan(
    positions: Float[np.ndarray, "frames markers 3"], names: Sequence[str], source: str
) -> tuple[Float[np.ndarray, "frames markers 3"], tuple[Note, ...]]:
    """NaN where a marker stands at exactly 0 0 0, lies piled up with two others or lacks a coordinate.

    Args:
        positions: in the file's units.
        names: the markers.
        source: the file, for the notes.
    """
    written = np.isfinite(positions)
    zero = (positions == 0).all(axis=2)
    torn = written.any(axis=2) & ~written.all(axis=2)
    piled = _piled_up(np.where(zero[:, :, None], np.nan, positions))
    notes = _listed(zero, names, f"{source}: 0 0 0 counts as not seen")
    notes += _listed(piled, names, f"{source}: three or more markers in exactly one point count as not seen")
    notes += _listed(torn, names, f"{source}: a coordinate is missing, the marker counts as not seen")
    cleaned = np.where((zero | piled | ~written.all(axis=2))[:, :, None], np.nan, positions)
    never = [name for k, name in enumerate(names) if not np.isfinite(cleaned[:, k]).any()]
    if never:
        notes += noted(Kind.LEFT_OUT, f"{source}: never seen: {', '.join(never)}")
    return cleaned, notes


def far_as_nan(
    positions_m: Float[np.ndarray, "frames markers 3"], names: Sequence[str], source: str, farthest_m: float
) -> tuple[Float[np.ndarray, "frames markers 3"], tuple[Note, ...]]:
    """NaN where a marker lies farther off than any laboratory is wide [m]."""
    far = (np.abs(positions_m) > farthest_m).any(axis=2)
    notes = _listed(far, names, f"{source}: more than {farthest_m:g} m away counts as not seen")
    return np.where(far[:, :, None], np.nan, positions_m), notes


def _piled_up(positions: Float[np.ndarray, "frames markers 3"]) -> Bool[np.ndarray, "frames markers"]:
    """True where three markers or more, which lie apart on other frames, are in one point to the last digit.

    Points that a laboratory computed may lie on a marker throughout: they leave it where it is. Where most of
    the markers are in one point, no other frame is asked.
    """
    piled = np.zeros(positions.shape[:2], dtype=bool)
    if positions.shape[1] < 3:
        return piled
    along_x = np.sort(positions[:, :, 0], axis=1)
    apart: dict[tuple[int, ...], bool] = {}
    for frame in np.flatnonzero((along_x[:, 2:] == along_x[:, :-2]).any(axis=1)):
        seen = np.flatnonzero(np.isfinite(positions[frame]).all(axis=1))
        _, which, counts = np.unique(positions[frame, seen], axis=0, return_inverse=True, return_counts=True)
        for k in np.flatnonzero(counts >= 3):
            group = tuple(seen[which.ravel() == k].tolist())
            if group not in apart:
                apart[group] = 2 * len(group) > len(seen) or _lie_apart(positions, group)
            piled[frame, list(group)] = apart[group]
    return piled


def _lie_apart(positions: Float[np.ndarray, "frames markers 3"], group: tuple[int, ...]) -> bool:
    """Whether these markers, on frames where they part, are mostly 2 % apart of what all markers span."""
    spread = np.linalg.norm(np.ptp(positions[:, list(group)], axis=1), axis=1)
    whole = np.linalg.norm(np.ma.ptp(np.ma.masked_invalid(positions), axis=1).filled(np.nan), axis=1)
    parted = spread[spread > 0]
    return parted.size > 0 and bool(np.median(parted) > 0.02 * np.nanmedian(whole))


def _listed(
    where: Bool[np.ndarray, "frames markers"], names: Sequence[str], heading: str
) -> tuple[Note, ...]:
    if not where.any():
        return ()
    counts = where.sum(axis=0)
    listed = ", ".join(f"{name} ({count} frames)" for name, count in zip(names, counts, strict=True) if count)
    return noted(Kind.LEFT_OUT, f"{heading}: {listed}")
