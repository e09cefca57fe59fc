"""Pieces of one physical marker's trajectory that carry several labels, joined where they fit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.common.notes import Kind, Note
from solver.common.settings_field import setting

_REPEATED = re.compile(r"(.+)#\d+")  # the reader's mark of a name that the file has more than once
_NUMBERED = re.compile(r"[^a-z]*(m|u|c|unnamed|unlabell?ed|unknown|marker|point|traj\w*)?[^a-z]*\d+", re.I)


@dataclass(frozen=True)
class JoiningSettings:
    """When two labels are one marker."""

    rigid_m: float = setting(0.008, unit="m", why="distances within a segment vary by less, skin included")
    same_m: float = setting(0.010, unit="m", why="nearer than this, two places on a segment are one marker's")
    reach_m: float = setting(0.6, unit="m", why="no segment is longer")
    fewest_frames: int = setting(10, unit="", why="of each piece beside a neighbour; fewer show no rigidity")
    fewest_neighbours: int = setting(3, unit="", why="distances to three others fix a place")


def join_trajectories(
    markers: Markers, settings: JoiningSettings = JoiningSettings()
) -> tuple[Markers, tuple[Note, ...]]:
    """Give pieces of one marker's trajectory one label.

    Pieces of one name that no frame shows together are one marker. So are two labels when one of them says
    nothing ("*12", "U_3"), no frame shows both, and the markers that keep their distance to the one keep the
    same distance to the other.

    Args:
        markers: one trial [m], NaN where not seen.
        settings: limits.

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
            if other != piece and _one_marker(positions, names.index(piece), names.index(other), settings)
        ]
        fitting.sort(key=lambda n: -_seen(positions, names, n).sum())
        columns = [names.index(name) for name in fitting]
        if not fitting or not all(_one_marker(positions, columns[0], c, settings) for c in columns[1:]):
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


def _one_marker(
    positions: Float[np.ndarray, "frames markers 3"], one: int, other: int, settings: JoiningSettings
) -> bool:
    """Whether two columns never meet and have the same place among the markers that move with both."""
    seen = np.isfinite(positions).all(axis=2)
    if (seen[:, one] & seen[:, other]).any():
        return False
    mean_one, spread_one = _distances(positions, seen, one, settings)
    mean_other, spread_other = _distances(positions, seen, other, settings)
    rigid = (spread_one < settings.rigid_m) & (mean_one < settings.reach_m)
    rigid &= np.isfinite(mean_other)
    if rigid.sum() < settings.fewest_neighbours:
        return False
    kept = spread_other[rigid] < settings.rigid_m
    same = np.abs(mean_one - mean_other)[rigid] < settings.same_m
    return bool((kept & same).all())


def _distances(
    positions: Float[np.ndarray, "frames markers 3"],
    seen: Bool[np.ndarray, "frames markers"],
    column: int,
    settings: JoiningSettings,
) -> tuple[Float[np.ndarray, " markers"], Float[np.ndarray, " markers"]]:
    """Mean distance of every marker to one of them [m] and its deviation; NaN where they hardly meet."""
    distance = np.linalg.norm(positions - positions[:, column : column + 1], axis=2)
    both = seen & seen[:, column : column + 1]
    count = both.sum(axis=0)
    enough = (count >= settings.fewest_frames) & (np.arange(len(count)) != column)
    filled = np.where(both, distance, 0.0)
    mean = np.where(enough, filled.sum(axis=0) / np.maximum(count, 1), np.nan)
    spread = np.where(both, distance - mean, 0.0)
    return mean, np.where(enough, np.sqrt((spread**2).sum(axis=0) / np.maximum(count, 1)), np.nan)
