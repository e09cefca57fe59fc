"""One door to every file of markers or forces: which it is by ending or content, and what reads it."""

from dataclasses import dataclass, replace
from pathlib import Path

from solver.capture.axes import VerticalAxis, markers_y_up, vertical_axis
from solver.capture.capture import Markers
from solver.capture.formats.c3d import read_c3d_markers
from solver.capture.formats.motive_csv import read_motive_markers
from solver.capture.formats.nexus_csv import read_nexus_forces, read_nexus_markers
from solver.capture.formats.qtm_tsv import read_qtm_forces, read_qtm_markers
from solver.capture.formats.storage import Storage, read_storage
from solver.capture.formats.text_exports import Program, export_of
from solver.capture.formats.trc import read_trc
from solver.capture.plates.force_columns import find_plates, turned
from solver.capture.reading_settings import READING, ReadingSettings
from solver.capture.subject.several_subjects import one_subject
from solver.common.errors import CaptureError
from solver.common.notes import Note

TABLES = (".mot", ".sto")
RECORDINGS = (".trc", ".c3d")
MARKERS_READ = ".trc, .c3d, .b3d, .tsv of QTM, .csv of Nexus or Motive"
FORCES_READ = ".mot, .sto, .c3d, .tsv of QTM, .csv of Nexus"
READ_TEXT = {
    Program.QTM: read_qtm_markers,
    Program.NEXUS: read_nexus_markers,
    Program.MOTIVE: read_motive_markers,
}


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
    if path.suffix.lower() in TABLES:
        return True
    export = None if path.is_symlink() else export_of(path)
    return export is not None and export.forces and not export.markers


def holds_table(path: Path) -> bool:
    """Whether a text file of markers brings force plates of its own."""
    export = export_of(path)
    return export is not None and export.markers and export.forces


def read_markers(
    path: Path, up: VerticalAxis | None = None, settings: ReadingSettings = READING, prefix: str | None = None
) -> MarkersInLab:
    """The markers of one person in a file, whatever else it holds.

    Args:
        path: the file.
        up: the axis that points up, where a person said so.
        settings: thresholds.
        prefix: before the labels of the person, in a file of several; None: of whom it has most.

    Raises:
        CaptureError: it cannot be read, or holds no markers.
    """
    ending = path.suffix.lower()
    if ending == ".c3d":
        c3d = read_c3d_markers(path, up, settings)
        return of_one_person(MarkersInLab(c3d.markers, c3d.up, c3d.notes, "z"), prefix, path)
    export = export_of(path)
    if ending != ".trc" and export is None:
        raise CaptureError(f"{path}: markers of that kind cannot be read here. Export one of {MARKERS_READ}.")
    found = read_trc(path, settings) if export is None else READ_TEXT[export.program](path, settings)
    default = "z" if export is not None and export.program is not Program.MOTIVE else "y"
    up = up or vertical_axis(found.markers, default=default, settings=settings.axes)
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
    export = export_of(path)
    if export is None or not export.forces:
        raise CaptureError(f"{path}: forces of that kind cannot be read here. Export one of {FORCES_READ}.")
    return read_qtm_forces(path) if export.program is Program.QTM else read_nexus_forces(path)


def loads_upright(storage: Storage, settings: ReadingSettings) -> Storage:
    """A table turned to y up by its own forces alone."""
    forces = [storage.values[:, list(plate.force)] for plate in find_plates(storage)[0]]
    up = vertical_axis(None, forces, default="y", settings=settings.axes)
    return turned(storage, up.R_ground_lab)
