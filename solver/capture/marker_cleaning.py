"""Measured markers: what counts as not seen, spikes, teleports, empty trajectories, and pieces of one.

Gaps stay gaps.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.common.notes import Kind, Note, noted
from solver.common.settings_field import setting

LISTED = 8  # frames named in a note; the rest is counted


FARTHEST_M = 1000.0  # no laboratory is wider; numbers beyond are placeholders, as 9999999
RETURN_SHARE = 0.5  # of the way out: nearer than that to where it left comes a marker that returns
TELEPORT_S = 0.1  # longer stays are another marker's trajectory, not a slip
SAME_TRAJECTORY_M = 1e-6  # two trajectories nearer than rounding are copies
_REPEATED = re.compile(r"(.+)#\d+")  # the reader's mark of a name that the file has more than once
_NUMBERED = re.compile(r"[^a-z]*(m|u|c|unnamed|unlabell?ed|unknown|marker|point|traj\w*)?[^a-z]*\d+", re.I)
RIGID_M = 0.008  # distances within a segment vary by less, skin included
SAME_PLACE_M = 0.010  # nearer than this, two places on a segment are one marker's
SEGMENT_REACH_M = 0.6  # no segment is longer
FEWEST_FRAMES = 10  # of each piece beside a neighbour; fewer show no rigidity
FEWEST_NEIGHBOURS = 3  # distances to three others fix a place


@dataclass(frozen=True)
class MarkerCleaningSettings:
    """What no human movement does."""

    spike_m: float = setting(0.08, unit="m", why="smaller spikes are left to the fit's robust loss")
    spike_m_s2: float = setting(
        3000.0, unit="m/s²", why="300 g: markers on a sprinter's foot reach a third of it when it strikes"
    )
    teleport_m_s: float = setting(
        60.0, unit="m/s", why="no body part is that fast; hands of throwers reach 25 to 40 m/s"
    )


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
    return cleaned, notes + _copies(cleaned)


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
            if jumps and _returns(path, times, jump, jumps[0]):
                away[frames[jump + 1 : jumps.pop(0) + 1], k] = True
            else:
                lasting[frames[jump + 1], k] = True
    return away, lasting


def _returns(
    path: Float[np.ndarray, "seen 3"], times: Float[np.ndarray, " seen"], jump: int, back: int
) -> bool:
    """Whether the marker is soon back near the place that it left."""
    if times[back] - times[jump] > TELEPORT_S:
        return False
    gap = np.linalg.norm(path[back + 1] - path[jump])
    outside = np.linalg.norm(path[jump + 1] - path[jump])
    return bool(gap < RETURN_SHARE * outside)


def _copies(markers: Markers) -> tuple[Note, ...]:
    """Markers whose trajectories are one and the same wherever both were seen."""
    positions = markers.positions_ground
    found: list[str] = []
    with np.errstate(invalid="ignore"):
        for k in range(positions.shape[1] - 1):
            apart = np.abs(positions[:, k + 1 :] - positions[:, k : k + 1]).max(axis=2)
            both = np.isfinite(apart)
            same = (apart <= SAME_TRAJECTORY_M) & both
            copies = (both.sum(axis=0) > 1) & (same.sum(axis=0) == both.sum(axis=0))
            found += [
                f"{markers.names[k]} and {markers.names[k + 1 + other]}" for other in np.flatnonzero(copies)
            ]
    return noted(Kind.LABELS, f"{some_of(found, 3)} have the same trajectory") if found else ()


def _listed(what: str, where: Bool[np.ndarray, "frames markers"], names: Sequence[str]) -> tuple[Note, ...]:
    found = []
    for k in np.flatnonzero(where.any(axis=0)).tolist():
        frames = np.flatnonzero(where[:, k])
        shown = ", ".join(map(str, frames[:LISTED]))
        more = f" and {len(frames) - LISTED} more" if len(frames) > LISTED else ""
        found.append(f"{names[k]} (frame {shown}{more})")
    return noted(Kind.OTHER, f"{what}: {'; '.join(found)}") if found else ()


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
    notes = _counted(zero, names, f"{source}: 0 0 0 counts as not seen")
    notes += _counted(piled, names, f"{source}: three or more markers in exactly one point count as not seen")
    notes += _counted(torn, names, f"{source}: a coordinate is missing, the marker counts as not seen")
    cleaned = np.where((zero | piled | ~written.all(axis=2))[:, :, None], np.nan, positions)
    never = [name for k, name in enumerate(names) if not np.isfinite(cleaned[:, k]).any()]
    if never:
        notes += noted(Kind.LEFT_OUT, f"{source}: never seen: {', '.join(never)}")
    return cleaned, notes


def far_as_nan(
    positions_m: Float[np.ndarray, "frames markers 3"], names: Sequence[str], source: str
) -> tuple[Float[np.ndarray, "frames markers 3"], tuple[Note, ...]]:
    """NaN where a marker lies farther off than any laboratory is wide [m]."""
    far = (np.abs(positions_m) > FARTHEST_M).any(axis=2)
    notes = _counted(far, names, f"{source}: more than {FARTHEST_M:g} m away counts as not seen")
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


def _counted(
    where: Bool[np.ndarray, "frames markers"], names: Sequence[str], heading: str
) -> tuple[Note, ...]:
    if not where.any():
        return ()
    counts = where.sum(axis=0)
    listed = ", ".join(f"{name} ({count} frames)" for name, count in zip(names, counts, strict=True) if count)
    return noted(Kind.LEFT_OUT, f"{heading}: {listed}")


def join_trajectories(markers: Markers) -> tuple[Markers, tuple[Note, ...]]:
    """Give pieces of one marker's trajectory one label.

    Pieces of one name that no frame shows together are one marker. So are two labels when one of them says
    nothing ("*12", "U_3"), no frame shows both, and the markers that keep their distance to the one keep the
    same distance to the other.

    Args:
        markers: one trial [m], NaN where not seen.

    Returns:
        The markers, each under the label that says more, else under that of the longest piece; and a note
        that names them.
    """
    names = list(markers.names)
    positions = markers.positions_ground.copy()
    joined: dict[str, list[str]] = {}

    def join(piece: str, kept: str) -> None:
        nonlocal positions
        frames, dropped = _seen(positions, names, piece), names.index(piece)
        positions[frames, names.index(kept)] = positions[frames, dropped]
        joined.setdefault(kept, []).extend([piece, *joined.pop(piece, [])])
        names.pop(dropped)
        positions = np.delete(positions, dropped, axis=1)

    for piece in markers.names:
        repeated = _REPEATED.fullmatch(piece)
        if repeated and repeated[1] in names:
            both = _seen(positions, names, piece) & _seen(positions, names, repeated[1])
            if not both.any():
                join(piece, repeated[1])
    for piece in sorted(filter(_NUMBERED.fullmatch, names), key=lambda n: _seen(positions, names, n).sum()):
        fitting = [
            other
            for other in names
            if other != piece and _one_marker(positions, names.index(piece), names.index(other))
        ]
        fitting.sort(key=lambda n: -_seen(positions, names, n).sum())
        columns = [names.index(name) for name in fitting]
        if not fitting or not all(_one_marker(positions, columns[0], c) for c in columns[1:]):
            continue
        join(piece, fitting[0])
    if not joined:
        return markers, ()
    listed = some_of([f"{name} with {', '.join(pieces)}" for name, pieces in joined.items()])
    note = Note(Kind.LABELS, f"pieces of one trajectory under several labels, joined: {listed}")
    return replace(markers, names=tuple(names), positions_ground=positions), (note,)


def _seen(
    positions: Float[np.ndarray, "frames markers 3"], names: Sequence[str], name: str
) -> Bool[np.ndarray, " frames"]:
    return np.isfinite(positions[:, names.index(name)]).all(axis=1)


def _one_marker(positions: Float[np.ndarray, "frames markers 3"], one: int, other: int) -> bool:
    """Whether two columns never meet and have the same place among the markers that move with both."""
    seen = np.isfinite(positions).all(axis=2)
    if (seen[:, one] & seen[:, other]).any():
        return False
    mean_one, spread_one = _distances(positions, seen, one)
    mean_other, spread_other = _distances(positions, seen, other)
    rigid = (spread_one < RIGID_M) & (mean_one < SEGMENT_REACH_M)
    rigid &= np.isfinite(mean_other)
    if rigid.sum() < FEWEST_NEIGHBOURS:
        return False
    kept = spread_other[rigid] < RIGID_M
    same = np.abs(mean_one - mean_other)[rigid] < SAME_PLACE_M
    return bool((kept & same).all())


def _distances(
    positions: Float[np.ndarray, "frames markers 3"], seen: Bool[np.ndarray, "frames markers"], column: int
) -> tuple[Float[np.ndarray, " markers"], Float[np.ndarray, " markers"]]:
    """Mean distance of every marker to one of them [m] and its deviation; NaN where they hardly meet."""
    distance = np.linalg.norm(positions - positions[:, column : column + 1], axis=2)
    both = seen & seen[:, column : column + 1]
    count = both.sum(axis=0)
    enough = (count >= FEWEST_FRAMES) & (np.arange(len(count)) != column)
    filled = np.where(both, distance, 0.0)
    mean = np.where(enough, filled.sum(axis=0) / np.maximum(count, 1), np.nan)
    spread = np.where(both, distance - mean, 0.0)
    return mean, np.where(enough, np.sqrt((spread**2).sum(axis=0) / np.maximum(count, 1)), np.nan)
