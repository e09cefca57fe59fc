"""One door to every file of markers or forces: which it is by ending or content, and what reads it."""

import re
from collections import defaultdict
from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from solver.capture.axes import VerticalAxis, markers_y_up, vertical_axis
from solver.capture.capture import Markers
from solver.capture.formats.c3d import read_c3d_markers
from solver.capture.formats.cortex_forces import ENDING as CORTEX_ENDING
from solver.capture.formats.cortex_forces import read_cortex_forces
from solver.capture.formats.motive_csv import read_motive_markers
from solver.capture.formats.nexus_csv import read_nexus_forces, read_nexus_markers
from solver.capture.formats.qtm_tsv import read_qtm_forces, read_qtm_markers
from solver.capture.formats.storage import Storage, read_storage
from solver.capture.formats.text_exports import Program, export_of
from solver.capture.formats.trc import read_trc
from solver.capture.plates.force_columns import find_plates, turn_table
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

TABLES = (".mot", ".sto")
RECORDINGS = (".trc", ".c3d")
MARKERS_READ = ".trc, .c3d, .b3d, .tsv of QTM, .csv of Nexus or Motive"
FORCES_READ = ".mot, .sto, .c3d, .forces of Cortex, .tsv of QTM, .csv of Nexus"
READ_TEXT = {
    Program.QTM: read_qtm_markers,
    Program.NEXUS: read_nexus_markers,
    Program.MOTIVE: read_motive_markers,
}
SIDES = frozenset({"l", "r", "left", "right"})  # before a colon they are no one's name
LEAST_SHARED = 5  # labels that two subjects have in common
LEAST_PAIRS = 3  # left and right labels among them, where the sign after a name means other things too
SIGN = re.compile(r"([^-_. ]+)[-_. ]+(.+)")
TWICE_M = 0.02  # nearer in the median, they are the same markers written twice


@dataclass(frozen=True)
class MarkersInLab:
    """Markers in the laboratory's axes, and which of these points up."""

    markers: Markers
    up: VerticalAxis
    notes: tuple[Note, ...]
    default: str = "y"  # the axis that points up in such files where nothing tells
    whose: str = ""  # before the labels, which are without it
    others: tuple[str, ...] = ()  # names before labels of other people

    @property
    def upright(self) -> Markers:
        """The markers, y up."""
        return markers_y_up(self.markers, self.up)


def is_recording(path: Path) -> bool:
    """Whether a file holds markers: by its ending, or, where many programs share that, by its head."""
    if path.suffix.lower() in RECORDINGS:
        return True
    export = None if path.is_symlink() else export_of(path)
    return export is not None and export.markers


def is_force_table(path: Path) -> bool:
    """Whether a file can hold forces, and holds no markers beside them."""
    if path.suffix.lower() in (*TABLES, CORTEX_ENDING):
        return True
    export = None if path.is_symlink() else export_of(path)
    return export is not None and export.forces and not export.markers


def holds_table(path: Path) -> bool:
    """Whether a text file of markers brings force plates of its own."""
    export = export_of(path)
    return export is not None and export.markers and export.forces


def read_markers(path: Path, up: VerticalAxis | None = None, prefix: str | None = None) -> MarkersInLab:
    """The markers of one person in a file, whatever else it holds.

    Args:
        path: the file.
        up: the axis that points up, where a person said so.
        prefix: before the labels of the person, in a file of several; None: of whom it has most.

    Raises:
        CaptureError: it cannot be read, or holds no markers.
    """
    ending = path.suffix.lower()
    if ending == ".c3d":
        c3d = read_c3d_markers(path, up)
        return of_one_person(MarkersInLab(c3d.markers, c3d.up, c3d.notes, "z"), prefix, path)
    export = export_of(path)
    if ending != ".trc" and export is None:
        raise CaptureError(f"{path}: markers of that kind cannot be read here. Export one of {MARKERS_READ}.")
    found = read_trc(path) if export is None else READ_TEXT[export.program](path)
    default = "z" if export is not None and export.program is not Program.MOTIVE else "y"
    up = up or vertical_axis(found.markers, default=default)
    return of_one_person(MarkersInLab(found.markers, up, found.notes, default), prefix, path)


def of_one_person(lab: MarkersInLab, prefix: str | None, path: Path) -> MarkersInLab:
    """The markers of the person that is wanted, without the name before their labels.

    Args:
        lab: of everybody in the file.
        prefix: before the person's labels; None: of whom it has most.
        path: the file, for the notes.
    """
    one = one_subject(lab.markers, prefix)
    notes = (*lab.notes, *(note.of(path.name) for note in one.notes))
    return replace(lab, markers=one.markers, notes=notes, whose=one.name, others=one.others)


def read_forces(path: Path) -> Storage:
    """The table of forces of a file; of QTM's, of all plates that were exported with it.

    Raises:
        CaptureError: it cannot be read, or holds no forces.
    """
    if path.suffix.lower() in TABLES:
        return read_storage(path)
    if path.suffix.lower() == CORTEX_ENDING:
        return read_cortex_forces(path)
    export = export_of(path)
    if export is None or not export.forces:
        raise CaptureError(f"{path}: forces of that kind cannot be read here. Export one of {FORCES_READ}.")
    return read_qtm_forces(path) if export.program is Program.QTM else read_nexus_forces(path)


def loads_upright(storage: Storage) -> Storage:
    """A table turned to y up by its own forces alone."""
    forces = [storage.values[:, list(plate.force)] for plate in find_plates(storage)[0]]
    up = vertical_axis(None, forces, default="y")
    return turn_table(storage, up.R_ground_lab)


@dataclass(frozen=True)
class OneSubject:
    """The markers of one subject of a recording, without the name before their labels."""

    markers: Markers
    name: str = ""  # before its labels
    others: tuple[str, ...] = ()  # names of the other people
    notes: tuple[Note, ...] = ()


def one_subject(markers: Markers, wanted: str | None = None) -> OneSubject:
    """The subject that is wanted, else the one that the recording has most of, and a note on the others.

    Others are people too where most of their labels are the first one's but for the name. Left in, they
    would be taken for what the model has besides, or for other spellings of the same marker. What is no
    person, a bar say, stays, but for labels that the person has.

    Args:
        markers: as recorded.
        wanted: the name before a subject's labels; of no one who is in the recording, it decides nothing.
    """
    own: dict[str, dict[str, int]] = defaultdict(dict)
    parts = _parts(markers.names)
    short = [label for _, label in parts]
    for column, (whose, label) in enumerate(parts):
        own[whose][label.casefold()] = column
    if not own.keys() - {""}:
        return OneSubject(markers)
    seen = np.isfinite(markers.positions_ground).all(axis=2).sum(axis=0)
    kept = max(own, key=lambda whose: (whose == wanted, sum(int(seen[c]) for c in own[whose].values())))
    people = [whose for whose in own if whose != kept and _is_a_subject(own[whose], own[kept])]
    left_out = {column for whose in people for column in own[whose].values()}
    doubled = {
        column
        for whose in own
        if whose != kept
        for label, column in own[whose].items()
        if column not in left_out and label in own[kept]
    }
    stay = [c for c in range(len(markers.names)) if c not in left_out | doubled]
    one = replace(markers.chosen(stay), names=tuple(short[c] for c in stay))
    twice = [whose for whose in people if _apart_m(markers, own, kept, whose) < TWICE_M]
    others = tuple(whose for whose in people if whose not in twice)
    notes = tuple(
        Note(
            Kind.OTHER,
            f"{len(own[whose])} markers of {_called(whose)} are those of {_called(kept)} written twice; "
            "left out",
        )
        for whose in twice
    )
    if others and kept == wanted:
        notes += noted(
            Kind.PLATES,
            f"the markers of {', '.join(map(_called, others))} are left out, as subject.toml says",
        )
    elif others:
        notes += (_people_note(markers, own, kept, others),)
    if doubled:
        named = ", ".join(markers.names[c] for c in sorted(doubled))
        notes += noted(Kind.OTHER, f"left out, since {_called(kept)} has labels of these names: {named}")
    removed = [whose for whose in own if whose and whose not in people]
    if removed:
        notes += noted(Kind.LABELS, f"the name {', '.join(removed)} is removed from the labels")
    return OneSubject(one, kept, others, notes)


def _parts(names: Sequence[str]) -> list[tuple[str, str]]:
    """The name of a subject and the label; no name where none is listed."""
    at_colons = []
    for name in names:
        whose, label = (part.strip() for part in name.rpartition(":")[::2])
        at_colons.append((whose, label) if label and whose.casefold() not in SIDES else ("", name))
    if any(whose for whose, _ in at_colons):
        return at_colons
    at_signs = [found.groups() if (found := SIGN.fullmatch(name)) else ("", name) for name in names]
    labels: dict[str, set[str]] = defaultdict(set)
    for whose, label in at_signs:
        labels[whose].add(label.casefold())
    people = {
        whose
        for pair in combinations(labels.keys() - {""}, 2)
        if _pairs(labels[pair[0]] & labels[pair[1]]) >= LEAST_PAIRS
        for whose in pair
    }
    return [
        (whose, label) if whose in people else ("", name)
        for (whose, label), name in zip(at_signs, names, strict=True)
    ]


def _pairs(labels: Set[str]) -> int:
    return sum(label[0] == "l" and f"r{label[1:]}" in labels for label in labels)


def _is_a_subject(labels: dict[str, int], first: dict[str, int]) -> bool:
    shared = len(labels.keys() & first.keys())
    return shared >= LEAST_SHARED and 2 * shared >= len(labels)


def _called(whose: str) -> str:
    return whose or "no name"


def _apart_m(markers: Markers, own: dict[str, dict[str, int]], kept: str, whose: str) -> float:
    """How far the same labels of two subjects are from each other; NaN where they are never seen together."""
    shared = sorted(own[whose].keys() & own[kept].keys())
    one, other = (markers.positions_ground[:, [own[w][label] for label in shared]] for w in (kept, whose))
    apart = np.linalg.norm(other - one, axis=2)
    return float(np.nanmedian(apart)) if np.isfinite(apart).any() else float("nan")


def _people_note(
    markers: Markers, own: dict[str, dict[str, int]], kept: str, others: tuple[str, ...]
) -> Note:
    listed = []
    for whose in others:
        apart_m = _apart_m(markers, own, kept, whose)
        far = f", {apart_m:.1f} m away" if np.isfinite(apart_m) else ""
        listed.append(f"{_called(whose)} ({len(own[whose])} markers{far})")
    return Note(
        Kind.SEVERAL_PEOPLE,
        f"{1 + len(others)} people in one file: {_called(kept)} ({len(own[kept])} markers) is taken, "
        f'{", ".join(listed)} left out. To take another: prefix = "{others[0]}" in subject.toml; '
        "addb-viewer init writes one for each",
    )
