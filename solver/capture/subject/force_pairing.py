"""Which force table belongs to which markers, by their names and by what they hold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from solver.capture.formats.c3d import read_c3d
from solver.capture.formats.qtm_tsv import marker_stem
from solver.capture.formats.recording_files import holds_table, loads_upright, read_forces, read_markers
from solver.capture.plates.loads_under_feet import NOTHING, Evidence, Feet, Loads, evidence, feet_of, loads_of
from solver.capture.plates.moment_convention import plates_from_storage
from solver.capture.reading_settings import READING, ReadingSettings
from solver.capture.subject.trial_names import Relation, relation
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note

LITTLE = 0.5  # [log odds] not worth a word


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
    settings: ReadingSettings
    tables: int  # force tables without markers


def pair_forces(
    folder: Path, markers: Sequence[Path], tables: Sequence[Path], settings: ReadingSettings = READING
) -> Paired:
    """Give force tables to markers where one of them is clearly the partner.

    Args:
        folder: of the subject; names are compared as seen from there.
        markers: files that have no forces yet.
        tables: files that hold columns of ground forces and no markers.
        settings: how files are read, what counts as a load under a foot, and as a clear pair.
    """
    among = _Folder(folder, {path: _span(path, settings) for path in markers}, settings, len(tables))
    candidates, left = [], {}
    for table in tables:
        loads = _loads(table, _stamp(table), settings)
        if isinstance(loads, str):
            left[table] = loads
            continue
        candidates += [
            _weighed(among, path, table, loads) for path in markers if not holds_forces(path, settings)
        ]
    least = settings.force_files.taken
    taken = [c for c in candidates if c.log_odds >= least and not _rivals(c, candidates, among)]
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


def _weighed(among: _Folder, markers: Path, table: Path, loads: Loads) -> _Candidate:
    settings, odds = among.settings, among.settings.force_files
    of_table = table.relative_to(among.path).with_name(marker_stem(table) + table.suffix)
    named = relation(markers.relative_to(among.path), of_table)
    feet = _feet(markers, _stamp(markers), settings)
    if feet is None:
        return _Candidate(markers, table, -np.inf, f"{markers.name} cannot be read")
    first, last = float(feet.times[0]), float(feet.times[-1])
    shorter = max(1e-9, min(last - first, loads.end - loads.start))
    if min(last, loads.end) - max(first, loads.start) < odds.least_overlap * shorter:
        times = f"{loads.start:g} to {loads.end:g} s, the markers of {markers.name} {first:g} to {last:g} s"
        return _Candidate(markers, table, -np.inf, f"recorded at other times: {times}")
    found = _evidence(markers, _stamp(markers), table, _stamp(table), settings)
    slack = odds.span_frames / feet.rate

    def together(span: tuple[float, float] | None) -> bool:
        return span is not None and max(abs(span[0] - loads.start), abs(span[1] - loads.end)) <= slack

    same_span = together((first, last)) and sum(map(together, among.spans.values())) == 1
    said = f"{named.value}; {_told(markers, found)}"
    of_names = {
        Relation.SAME: odds.named_alike,
        Relation.PART: odds.named_in_part,
        Relation.UNRELATED: 0.0,
        Relation.SIBLINGS: odds.named_siblings,
    }[named]
    under_feet = found.off_m < 2 * settings.under_feet.hit_m and found.log_odds > -LITTLE
    if len(among.spans) == among.tables == 1 and (found.log_odds > LITTLE or (same_span and under_feet)):
        said = f"nothing else comes into question; {said}"
        of_names = 0.0 if named is Relation.SIBLINGS else of_names + odds.alone
    return _Candidate(markers, table, of_names + found.log_odds + odds.same_span * same_span, said)


def _told(markers: Path, found: Evidence) -> str:
    if np.isnan(found.off_m):
        return f"no foot of {markers.name} is seen while a plate is loaded"
    lies = f"its loads lie {100 * found.off_m:.1f} cm from the feet of {markers.name}"
    if abs(found.log_odds) < LITTLE:
        return f"{lies}, as they would at other moments"
    odds = f"{np.exp(abs(found.log_odds)):.0f} to 1" if found.log_odds < 5 else "more than 100 to 1"
    return f"{lies}, {odds} {'for' if found.log_odds > 0 else 'against'} their being one recording"


def _rivals(one: _Candidate, candidates: Sequence[_Candidate], among: _Folder) -> list[_Candidate]:
    """What comes into question as much: another table, or markers of the same moment for the same table."""
    settings, spans = among.settings.force_files, among.spans
    return [
        c
        for c in candidates
        if c is not one
        and c.log_odds > max(0.0, one.log_odds - settings.lead)
        and (
            c.markers == one.markers
            or (c.table == one.table and _same_moment(spans[c.markers], spans[one.markers], settings.apart))
        )
    ]


def _same_moment(one: tuple[float, float] | None, other: tuple[float, float] | None, apart: float) -> bool:
    if one is None or other is None:
        return True
    shorter = max(1e-9, min(one[1] - one[0], other[1] - other[0]))
    return min(one[1], other[1]) - max(one[0], other[0]) > apart * shorter


def _why_left(own: Sequence[_Candidate], candidates: Sequence[_Candidate], among: _Folder) -> str:
    if not own:
        return "forces, but every trial has its own, by name or in its own file"
    best = max(own, key=lambda c: c.log_odds)
    rivals = _rivals(best, candidates, among)
    if best.log_odds >= among.settings.force_files.taken and rivals:
        others = ", ".join(
            dict.fromkeys((c.table if c.table != best.table else c.markers).name for c in rivals)
        )
        return f"forces, perhaps of {best.markers.name}, but {others} is possible as well"
    return (
        f"forces that cannot be assigned to a trial with certainty; nearest {best.markers.name}: {best.why}"
    )


def _stamp(path: Path) -> tuple[int, int]:
    """What changes with a file's contents."""
    status = path.stat()
    return status.st_mtime_ns, status.st_size


def _span(path: Path, settings: ReadingSettings) -> tuple[float, float] | None:
    feet = _feet(path, _stamp(path), settings)
    return None if feet is None else (float(feet.times[0]), float(feet.times[-1]))


@lru_cache(maxsize=4096)
def _evidence(
    markers: Path, _: tuple[int, int], table: Path, __: tuple[int, int], settings: ReadingSettings
) -> Evidence:
    """Weighed again when the stamp of a file has changed."""
    feet = _feet(markers, _stamp(markers), settings)
    loads = _loads(table, _stamp(table), settings)
    if feet is None or isinstance(loads, str):
        return NOTHING
    return evidence(feet, loads, settings.under_feet)


@lru_cache(maxsize=64)
def _feet(path: Path, stamp: tuple[int, int], settings: ReadingSettings) -> Feet | None:
    """The low markers of a file; None where it cannot be read."""
    try:
        return feet_of(read_markers(path, None, settings).upright, settings.under_feet)
    except CaptureError:
        return None


@lru_cache(maxsize=256)
def _own_forces(path: Path, stamp: tuple[int, int], settings: ReadingSettings) -> bool:
    try:
        return loads_of(read_c3d(path, None, settings).plates, settings.under_feet) is not None
    except CaptureError:
        return False


def holds_forces(path: Path, settings: ReadingSettings = READING) -> bool:
    """Whether a file of markers brings loads of its own."""
    if path.suffix.lower() == ".c3d":
        return _own_forces(path, _stamp(path), settings)
    return holds_table(path) and not isinstance(_loads(path, _stamp(path), settings), str)


@lru_cache(maxsize=256)
def _loads(path: Path, stamp: tuple[int, int], settings: ReadingSettings) -> Loads | str:
    """The loads of a table, or why there are none."""
    try:
        plates, _ = plates_from_storage(
            loads_upright(read_forces(path), settings),
            settings=settings.force_tables,
            clock_settings=settings.clock,
        )
    except CaptureError as error:
        return f"forces that cannot be read: {error}"
    loads = loads_of(plates, settings.under_feet)
    return "force columns without any load" if loads is None else loads
