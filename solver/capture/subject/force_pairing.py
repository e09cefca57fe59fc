"""Which force table belongs to which markers, by their names and by what they hold."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from solver.capture.formats.c3d import read_c3d
from solver.capture.formats.qtm_tsv import marker_stem
from solver.capture.formats.recording_files import holds_table, loads_upright, read_forces, read_markers
from solver.capture.plates.loads_under_feet import (
    HIT_M,
    NOTHING,
    Evidence,
    Feet,
    Loads,
    evidence,
    feet_of,
    loads_of,
)
from solver.capture.plates.moment_convention import plates_from_storage
from solver.capture.subject.trial_names import Relation, relation
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note
from solver.common.small_files import kept_while_unchanged

LITTLE_NATS = 0.5  # [log odds] not worth a word
NAMED_ALIKE_NATS = 4.0  # 55 to 1: files of a trial are named alike; now and then one lies in a wrong folder
NAMED_IN_PART_NATS = 1.0  # walk_kine and walk_1_grf: a hint, no more
NAMED_SIBLINGS_NATS = -3.0  # walk1 and walk2 are two trials, 20 to 1
ALONE_NATS = 1.0  # the only markers and the only forces without a partner, where contents agree
SAME_SPAN_NATS = 1.5  # both begin and end together, as no other markers of the folder do
SPAN_FRAMES = 1.5  # of the markers, that beginnings and ends may differ by
TAKEN_NATS = 2.0  # 7 to 1 in all; a wrong pair is worse than a missing one
LEAD_NATS = 2.0  # over the next possible pair, as above
LEAST_OVERLAP_SHARE = 0.5  # of the shorter of the two recordings; less is another moment
PROCESSED = {"filtered", "filt", "processed", "cleaned", "clean"}
SAME_S, SAME_M = 0.05, 0.03  # apart in time and place of two samples of one load, filtered or not
SAME_SHARE = 0.9  # of samples
# two marker files that share less than this of the shorter are parts of one longer recording
APART_SHARE = 0.1


@dataclass(frozen=True)
class Paired:
    """Force tables of marker files, and why others were not taken."""

    forces: Mapping[Path, Path] = field(default_factory=dict)  # by marker file
    notes: tuple[Note, ...] = ()
    left: Mapping[Path, str] = field(default_factory=dict)  # by force table


@dataclass(frozen=True)
class _Candidate:
    markers: Path
    table: Path
    log_odds: float
    why: str


@dataclass(frozen=True)
class _Folder:
    """What pairs of a folder's files are weighed with."""

    path: Path
    spans: Mapping[Path, tuple[float, float] | None]  # [s] first and last time of each marker file
    tables: int  # force tables without markers


def pair_forces(folder: Path, markers: Sequence[Path], tables: Sequence[Path]) -> Paired:
    """Give force tables to markers where one of them is clearly the partner.

    Args:
        folder: of the subject; names are compared as seen from there.
        markers: files that have no forces yet.
        tables: files that hold columns of ground forces and no markers.
    """
    processed = _processed(folder, tables)
    among = _Folder(folder, {path: _span(path) for path in markers}, len(tables) - len(processed))
    candidates: list[_Candidate] = []
    left = {
        table: f"forces that are those of {measured.relative_to(folder)} once more"
        for table, measured in processed.items()
    }
    for table in tables:
        if table in left:
            continue
        loads = _loads(table)
        if isinstance(loads, str):
            left[table] = loads
            continue
        candidates += [_weighed(among, path, table, loads) for path in markers if not holds_forces(path)]
    taken = [c for c in candidates if c.log_odds >= TAKEN_NATS and not _rivals(c, candidates, among)]
    notes = tuple(
        Note(
            Kind.OTHER,
            f"{c.table.relative_to(folder)}: used as the forces of {c.markers.relative_to(folder)} "
            f"({c.why}); a subject.toml can name others",
        )
        for c in taken
    )
    used = {c.table for c in taken}
    for table in tables:
        if table not in used and table not in left:
            left[table] = _why_left([c for c in candidates if c.table == table], candidates, among)
    return Paired({c.markers: c.table for c in taken}, notes, left)


def _processed(folder: Path, tables: Sequence[Path]) -> dict[Path, Path]:
    """Tables of the same loads and trial: each but the least processed one, and that one."""
    found: dict[Path, Path] = {}
    by_rawness = sorted(tables, key=lambda path: (rawness(path), tables.index(path)))
    for k, measured in enumerate(by_rawness):
        for table in by_rawness[k + 1 :]:
            if measured in found or table in found:
                continue
            named = relation(measured.relative_to(folder), table.relative_to(folder))
            if named in (Relation.SAME, Relation.PART) and _same_loads(_loads(measured), _loads(table)):
                found[table] = measured
    return found


def rawness(path: Path) -> int:
    """0 where a file's name says that it is raw, 2 where it says that it was filtered, else 1."""
    words = set(re.split(r"[^a-z]+", path.stem.lower()))
    return 0 if "raw" in words else 2 if words & PROCESSED else 1


def _same_loads(one: Loads | str, other: Loads | str) -> bool:
    """Whether nearly every sample of either lies beside one of the other, in time and place."""
    if isinstance(one, str) or isinstance(other, str):
        return False
    from scipy.spatial import cKDTree  # noqa: PLC0415 (slow to load, and rarely needed)

    places = [np.column_stack([of.times / SAME_S, of.centres / SAME_M]) for of in (one, other)]
    near = [cKDTree(b).query(a)[0] < 1.0 for a, b in (places, places[::-1])]
    return bool(min(n.mean() for n in near) > SAME_SHARE)


def _weighed(among: _Folder, markers: Path, table: Path, loads: Loads) -> _Candidate:
    of_table = table.relative_to(among.path).with_name(marker_stem(table) + table.suffix)
    named = relation(markers.relative_to(among.path), of_table)
    feet = _feet(markers)
    if feet is None:
        return _Candidate(markers, table, -np.inf, f"{markers.name} cannot be read")
    first, last = float(feet.times[0]), float(feet.times[-1])
    shorter = max(1e-9, min(last - first, loads.end - loads.start))
    if min(last, loads.end) - max(first, loads.start) < LEAST_OVERLAP_SHARE * shorter:
        times = f"{loads.start:g} to {loads.end:g} s, the markers of {markers.name} {first:g} to {last:g} s"
        return _Candidate(markers, table, -np.inf, f"recorded at other times: {times}")
    found = _evidence(markers, table)
    slack = SPAN_FRAMES / feet.rate

    def together(span: tuple[float, float] | None) -> bool:
        return span is not None and max(abs(span[0] - loads.start), abs(span[1] - loads.end)) <= slack

    same_span = together((first, last)) and sum(map(together, among.spans.values())) == 1
    said = f"{named.value}; {_where_loads_lie(markers, found)}"
    of_names = {
        Relation.SAME: NAMED_ALIKE_NATS,
        Relation.PART: NAMED_IN_PART_NATS,
        Relation.UNRELATED: 0.0,
        Relation.SIBLINGS: NAMED_SIBLINGS_NATS,
    }[named]
    under_feet = found.off_m < 2 * HIT_M and found.log_odds > -LITTLE_NATS
    if len(among.spans) == among.tables == 1 and (found.log_odds > LITTLE_NATS or (same_span and under_feet)):
        said = f"nothing else comes into question; {said}"
        of_names = 0.0 if named is Relation.SIBLINGS else of_names + ALONE_NATS
    return _Candidate(markers, table, of_names + found.log_odds + SAME_SPAN_NATS * same_span, said)


def _where_loads_lie(markers: Path, found: Evidence) -> str:
    if np.isnan(found.off_m):
        return f"no foot of {markers.name} is seen while a plate is loaded"
    lies = f"its loads lie {100 * found.off_m:.1f} cm from the feet of {markers.name}"
    if abs(found.log_odds) < LITTLE_NATS:
        return f"{lies}, as they would at other moments"
    odds = f"{np.exp(abs(found.log_odds)):.0f} to 1" if found.log_odds < 5 else "more than 100 to 1"
    return f"{lies}, {odds} {'for' if found.log_odds > 0 else 'against'} their being one recording"


def _rivals(one: _Candidate, candidates: Sequence[_Candidate], among: _Folder) -> list[_Candidate]:
    """What comes into question as much: another table, or markers of the same moment for the same table."""
    spans = among.spans
    return [
        c
        for c in candidates
        if c is not one
        and c.log_odds > max(0.0, one.log_odds - LEAD_NATS)
        and (
            c.markers == one.markers
            or (c.table == one.table and _same_moment(spans[c.markers], spans[one.markers]))
        )
    ]


def _same_moment(one: tuple[float, float] | None, other: tuple[float, float] | None) -> bool:
    if one is None or other is None:
        return True
    shorter = max(1e-9, min(one[1] - one[0], other[1] - other[0]))
    return min(one[1], other[1]) - max(one[0], other[0]) > APART_SHARE * shorter


def _why_left(own: Sequence[_Candidate], candidates: Sequence[_Candidate], among: _Folder) -> str:
    if not own:
        return "forces, but every trial has its own, by name or in its own file"
    best = max(own, key=lambda c: c.log_odds)
    rivals = _rivals(best, candidates, among)
    if best.log_odds >= TAKEN_NATS and rivals:
        others = ", ".join(
            dict.fromkeys((c.table if c.table != best.table else c.markers).name for c in rivals)
        )
        return f"forces, perhaps of {best.markers.name}, but {others} is possible as well"
    return (
        f"forces that cannot be assigned to a trial with certainty; nearest {best.markers.name}: {best.why}"
    )


def _span(path: Path) -> tuple[float, float] | None:
    feet = _feet(path)
    return None if feet is None else (float(feet.times[0]), float(feet.times[-1]))


@kept_while_unchanged(most=4096)
def _evidence(markers: Path, table: Path) -> Evidence:
    feet = _feet(markers)
    loads = _loads(table)
    if feet is None or isinstance(loads, str):
        return NOTHING
    return evidence(feet, loads)


@kept_while_unchanged(most=64)
def _feet(path: Path) -> Feet | None:
    """The low markers of a file; None where it cannot be read."""
    try:
        return feet_of(read_markers(path, None).upright)
    except CaptureError:
        return None


@kept_while_unchanged(most=256)
def _own_forces(path: Path) -> bool:
    try:
        return loads_of(read_c3d(path, None).plates) is not None
    except CaptureError:
        return False


def holds_forces(path: Path) -> bool:
    """Whether a file of markers brings loads of its own."""
    if path.suffix.lower() == ".c3d":
        return _own_forces(path)
    return holds_table(path) and not isinstance(_loads(path), str)


@kept_while_unchanged(most=256)
def _loads(path: Path) -> Loads | str:
    """The loads of a table, or why there are none."""
    try:
        plates, _ = plates_from_storage(loads_upright(read_forces(path)))
    except CaptureError as error:
        return f"forces that cannot be read: {error}"
    loads = loads_of(plates)
    return "force columns without any load" if loads is None else loads
