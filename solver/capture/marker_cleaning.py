"""Measured markers without single-frame spikes, teleports and empty trajectories. Gaps stay gaps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.common.notes import Kind, Note, noted
from solver.common.settings_field import setting

LISTED = 8  # frames named in a note; the rest is counted


@dataclass(frozen=True)
class MarkerCleaningSettings:
    """What no human movement does."""

    farthest_m: float = setting(
        1000.0,
        unit="m",
        why="no laboratory is wider; numbers beyond are placeholders, as 9999999",
    )
    spike_m: float = setting(0.08, unit="m", why="smaller spikes are left to the fit's robust loss")
    spike_m_s2: float = setting(
        3000.0, unit="m/s²", why="300 g: markers on a sprinter's foot reach a third of it when it strikes"
    )
    return_share: float = setting(
        0.5, unit="", why="of the way out: nearer than that to where it left comes a marker that returns"
    )
    teleport_m_s: float = setting(
        60.0, unit="m/s", why="no body part is that fast; hands of throwers reach 25 to 40 m/s"
    )
    teleport_s: float = setting(0.1, unit="s", why="longer stays are another marker's trajectory, not a slip")
    same_m: float = setting(1e-6, unit="m", why="two trajectories nearer than rounding are copies")


def clean_markers(
    markers: Markers, settings: MarkerCleaningSettings = MarkerCleaningSettings()
) -> tuple[Markers, tuple[Note, ...]]:
    """Take out what is no movement; nothing is filled in.

    Args:
        markers: one trial [m], NaN where not seen.
        settings: what no human movement does.

    Returns:
        The markers with NaN in place of spikes and teleports and without those never seen; and notes that
        name marker and frames (counted from 0).
    """
    spikes = _spikes(markers.positions_ground, markers.rate, settings)
    positions = np.where(spikes[:, :, None], np.nan, markers.positions_ground)
    slips, lasting = _teleports(positions, markers.rate, settings)
    positions = np.where(slips[:, :, None], np.nan, positions)
    seen = np.flatnonzero(np.isfinite(positions).all(axis=2).any(axis=0)).tolist()
    never = [name for k, name in enumerate(markers.names) if k not in seen]
    notes = (
        *_listed("spikes removed", spikes, markers.names),
        *_listed("jumps there and back removed", slips, markers.names),
        *_listed("jumps that last, perhaps to another marker; left as they are", lasting, markers.names),
        *(noted(Kind.LEFT_OUT, f"left out, never seen: {', '.join(never)}") if never else ()),
    )
    names = tuple(markers.names[k] for k in seen)
    cleaned = replace(markers, names=names, positions_ground=positions[:, seen])
    return cleaned, notes + _copies(cleaned, settings)


def _spikes(
    positions: Float[np.ndarray, "frames markers 3"], rate: float, settings: MarkerCleaningSettings
) -> Bool[np.ndarray, "frames markers"]:
    """Frames that stick out from their two neighbours by more than any acceleration explains.

    Where a marker jumps and stays, the neighbours are twice as far apart as the frame sticks out.
    """
    spikes = np.zeros(positions.shape[:2], bool)
    if len(positions) < 3:
        return spikes
    before, here, after = positions[:-2], positions[1:-1], positions[2:]
    height = np.linalg.norm(here - 0.5 * (before + after), axis=2)
    across = np.linalg.norm(after - before, axis=2)
    limit = max(settings.spike_m, 0.5 * settings.spike_m_s2 / rate**2)
    spikes[1:-1] = (height > limit) & (across < height)
    return spikes


def _teleports(
    positions: Float[np.ndarray, "frames markers 3"], rate: float, settings: MarkerCleaningSettings
) -> tuple[Bool[np.ndarray, "frames markers"], Bool[np.ndarray, "frames markers"]]:
    """Frames spent elsewhere between a jump and the jump back; and first frames after jumps that last."""
    away = np.zeros(positions.shape[:2], bool)
    lasting = np.zeros_like(away)
    for k in range(positions.shape[1]):
        frames = np.flatnonzero(np.isfinite(positions[:, k]).all(axis=1))
        path, times = positions[frames, k], frames / rate
        reach = np.maximum(settings.teleport_m_s * np.diff(times), settings.spike_m)
        jumps = np.flatnonzero(np.linalg.norm(np.diff(path, axis=0), axis=1) > reach).tolist()
        while jumps:
            jump = jumps.pop(0)
            if jumps and _returns(path, times, jump, jumps[0], settings):
                away[frames[jump + 1 : jumps.pop(0) + 1], k] = True
            else:
                lasting[frames[jump + 1], k] = True
    return away, lasting


def _returns(
    path: Float[np.ndarray, "seen 3"],
    times: Float[np.ndarray, " seen"],
    jump: int,
    back: int,
    settings: MarkerCleaningSettings,
) -> bool:
    """Whether the marker is soon back near the place that it left."""
    if times[back] - times[jump] > settings.teleport_s:
        return False
    gap = np.linalg.norm(path[back + 1] - path[jump])
    outside = np.linalg.norm(path[jump + 1] - path[jump])
    return bool(gap < settings.return_share * outside)


def _copies(markers: Markers, settings: MarkerCleaningSettings) -> tuple[Note, ...]:
    """Markers whose trajectories are one and the same wherever both were seen."""
    positions = markers.positions_ground
    found: list[str] = []
    with np.errstate(invalid="ignore"):
        for k in range(positions.shape[1] - 1):
            apart = np.abs(positions[:, k + 1 :] - positions[:, k : k + 1]).max(axis=2)
            both = np.isfinite(apart)
            same = (apart <= settings.same_m) & both
            copies = (both.sum(axis=0) > 1) & (same.sum(axis=0) == both.sum(axis=0))
            found += [
                f"{markers.names[k]} and {markers.names[k + 1 + other]}" for other in np.flatnonzero(copies)
            ]
    return noted(Kind.OTHER, f"{some_of(found, 3)} have the same trajectory") if found else ()


def _listed(
    what: str,
    where: Bool[np.ndarray, "frames markers"],
    names: Sequence[str],
) -> tuple[Note, ...]:
    found = []
    for k in np.flatnonzero(where.any(axis=0)).tolist():
        frames = np.flatnonzero(where[:, k])
        shown = ", ".join(map(str, frames[:LISTED]))
        more = f" and {len(frames) - LISTED} more" if len(frames) > LISTED else ""
        found.append(f"{names[k]} (frame {shown}{more})")
    return noted(Kind.OTHER, f"{what}: {'; '.join(found)}") if found else ()
