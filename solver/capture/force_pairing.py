"""Which force table belongs to which markers, by their names and by what they hold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from solver.capture.axes import markers_y_up, vertical_axis
from solver.capture.c3d import read_c3d
from solver.capture.force_columns import find_plates, turned
from solver.capture.loads_under_feet import NOTHING, Evidence, Feet, Loads, evidence, feet_of, loads_of
from solver.capture.moment_convention import plates_from_storage
from solver.capture.storage import read_storage
from solver.capture.trc import read_trc
from solver.capture.trial_names import Relation, relation
from solver.errors import CaptureError

NAMED = {  # [log odds] what the names alone say, before a look into the files
    Relation.SAME: 4.0,  # files of a trial are named alike; now and then one lies in a wrong folder
    Relation.PART: 1.0,
    Relation.UNRELATED: 0.0,
    Relation.SIBLINGS: -3.0,  # walk1 and walk2
}
SAME_SPAN = 1.5  # [log odds] both begin and end together, as no other markers of the folder do
SPAN_FRAMES = 1.5  # of the markers, that beginnings and ends may differ by
TAKEN = 2.0  # [log odds] 7 to 1; a wrong pair is worse than a missing one
LEAD = 2.0  # [log odds] over the next that comes into question
LEAST_OVERLAP = 0.5  # of the shorter of the two recordings
LITTLE = 0.5  # [log odds] not worth a word
APART = 0.1  # of the shorter of two marker recordings: below it they are parts of one longer recording


@dataclass(frozen=True)
class Paired:
    """Force tables of marker files, and why others were not taken."""

    forces: Mapping[Path, Path] = field(default_factory=dict)  # by marker file
    notes: tuple[str, ...] = ()
    left: Mapping[Path, str] = field(default_factory=dict)  # by force table


@dataclass(frozen=True)
class _Candidate:
    markers: Path
    table: Path
    log_odds: float
    why: str


def pair_forces(folder: Path, markers: Sequence[Path], tables: Sequence[Path]) -> Paired:
    """Give force tables to markers where one of them is clearly the partner.

    Args:
        folder: of the subject; names are compared as seen from there.
        markers: .trc and .c3d files that have no forces yet.
        tables: .mot and .sto files that hold columns of ground forces.
    """
    spans = {path: _span(path) for path in markers}
    candidates, left = [], {}
    for table in tables:
        loads = _loads(table, _stamp(table))
        if isinstance(loads, str):
            left[table] = loads
            continue
        candidates += [
            _weighed(folder, path, table, loads, list(spans.values()))
            for path in markers
            if not holds_forces(path)
        ]
    taken = [c for c in candidates if c.log_odds >= TAKEN and not _rivals(c, candidates, spans)]
    notes = tuple(
        f"{c.table.relative_to(folder)}: taken for the forces of {c.markers.relative_to(folder)} ({c.why}); "
        "subject.toml may say else"
        for c in taken
    )
    used = {c.table for c in taken}
    for table in tables:
        if table not in used and table not in left:
            left[table] = _why_left([c for c in candidates if c.table == table], candidates, spans)
    return Paired({c.markers: c.table for c in taken}, notes, left)


def _weighed(
    folder: Path, markers: Path, table: Path, loads: Loads, spans: Sequence[tuple[float, float] | None]
) -> _Candidate:
    named = relation(markers.relative_to(folder), table.relative_to(folder))
    feet = _feet(markers, _stamp(markers))
    if feet is None:
        return _Candidate(markers, table, -np.inf, f"{markers.name} cannot be read")
    first, last = float(feet.times[0]), float(feet.times[-1])
    shorter = max(1e-9, min(last - first, loads.end - loads.start))
    if min(last, loads.end) - max(first, loads.start) < LEAST_OVERLAP * shorter:
        times = f"{loads.start:g} to {loads.end:g} s, the markers of {markers.name} {first:g} to {last:g} s"
        return _Candidate(markers, table, -np.inf, f"recorded at other times: {times}")
    found = _evidence(markers, _stamp(markers), table, _stamp(table))
    slack = SPAN_FRAMES / feet.rate

    def together(span: tuple[float, float] | None) -> bool:
        return span is not None and max(abs(span[0] - loads.start), abs(span[1] - loads.end)) <= slack

    alone = together((first, last)) and sum(map(together, spans)) == 1
    said = f"{named.value}; {_told(markers, found)}"
    return _Candidate(markers, table, NAMED[named] + found.log_odds + SAME_SPAN * alone, said)


def _told(markers: Path, found: Evidence) -> str:
    if np.isnan(found.off_m):
        return f"no foot of {markers.name} is seen while a plate is loaded"
    lies = f"its loads lie {100 * found.off_m:.1f} cm from the feet of {markers.name}"
    if abs(found.log_odds) < LITTLE:
        return f"{lies}, as they would at other moments"
    odds = f"{np.exp(abs(found.log_odds)):.0f} to 1" if found.log_odds < 5 else "more than 100 to 1"
    return f"{lies}, {odds} {'for' if found.log_odds > 0 else 'against'} one recording"


def _rivals(
    one: _Candidate, candidates: Sequence[_Candidate], spans: Mapping[Path, tuple[float, float] | None]
) -> list[_Candidate]:
    """What comes into question as much: another table, or markers of the same moment for the same table."""
    return [
        c
        for c in candidates
        if c is not one
        and c.log_odds > max(0.0, one.log_odds - LEAD)
        and (
            c.markers == one.markers
            or (c.table == one.table and _same_moment(spans[c.markers], spans[one.markers]))
        )
    ]


def _same_moment(one: tuple[float, float] | None, other: tuple[float, float] | None) -> bool:
    if one is None or other is None:
        return True
    shorter = max(1e-9, min(one[1] - one[0], other[1] - other[0]))
    return min(one[1], other[1]) - max(one[0], other[0]) > APART * shorter


def _why_left(
    own: Sequence[_Candidate],
    candidates: Sequence[_Candidate],
    spans: Mapping[Path, tuple[float, float] | None],
) -> str:
    if not own:
        return "forces, but every trial has its own, by name or in its own file"
    best = max(own, key=lambda c: c.log_odds)
    rivals = _rivals(best, candidates, spans)
    if best.log_odds >= TAKEN and rivals:
        others = ", ".join(
            dict.fromkeys((c.table if c.table != best.table else c.markers).name for c in rivals)
        )
        return f"forces, perhaps of {best.markers.name}, but {others} comes into question as well"
    return f"forces of no trial here for certain; nearest {best.markers.name}: {best.why}"


def _stamp(path: Path) -> tuple[int, int]:
    """What changes with a file's contents."""
    status = path.stat()
    return status.st_mtime_ns, status.st_size


def _span(path: Path) -> tuple[float, float] | None:
    feet = _feet(path, _stamp(path))
    return None if feet is None else (float(feet.times[0]), float(feet.times[-1]))


@lru_cache(maxsize=4096)
def _evidence(markers: Path, _: tuple[int, int], table: Path, __: tuple[int, int]) -> Evidence:
    """Weighed again when the stamp of a file has changed."""
    feet, loads = _feet(markers, _stamp(markers)), _loads(table, _stamp(table))
    return NOTHING if feet is None or isinstance(loads, str) else evidence(feet, loads)


@lru_cache(maxsize=64)
def _feet(path: Path, stamp: tuple[int, int]) -> Feet | None:
    """The low markers of a file; None where it cannot be read."""
    try:
        if path.suffix.lower() == ".c3d":
            c3d = read_c3d(path)
            return feet_of(markers_y_up(c3d.markers, c3d.up))
        markers = read_trc(path).markers
        return feet_of(markers_y_up(markers, vertical_axis(markers, default="y")))
    except CaptureError:
        return None


@lru_cache(maxsize=256)
def _own_forces(path: Path, stamp: tuple[int, int]) -> bool:
    try:
        return loads_of(read_c3d(path).plates) is not None
    except CaptureError:
        return False


def holds_forces(path: Path) -> bool:
    """Whether a C3D file brings loads of its own."""
    return path.suffix.lower() == ".c3d" and _own_forces(path, _stamp(path))


@lru_cache(maxsize=256)
def _loads(path: Path, stamp: tuple[int, int]) -> Loads | str:
    """The loads of a table, or why there are none."""
    try:
        storage = read_storage(path)
        forces = [storage.values[:, list(plate.force)] for plate in find_plates(storage)[0]]
        up = vertical_axis(None, forces, default="y")
        plates, _ = plates_from_storage(turned(storage, up.R_ground_lab))
    except CaptureError as error:
        return f"forces that cannot be read: {error}"
    loads = loads_of(plates)
    return "force columns in which nothing is ever loaded" if loads is None else loads
