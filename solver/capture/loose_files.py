"""Files that lie side by side: X.trc with X_grf.mot, X_forces.mot or X.mot; X.c3d; and a model among them."""

import re
from pathlib import Path

from solver.capture.capture import TrialFiles
from solver.capture.description import Description
from solver.capture.force_columns import find_plates
from solver.capture.storage import read_storage
from solver.errors import CaptureError

FORCE_ENDINGS = ("_grf", "_forces", "")


def files_in(folder: Path) -> list[Path]:
    """The folder's files in natural order, without hidden ones."""
    files = (p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    return sorted(files, key=lambda p: natural_order(p.name))


def natural_order(name: str) -> tuple[tuple[int, str], ...]:
    """A key that sorts trial2 before trial10."""
    pieces = re.findall(r"\d+|\D+", name.lower())
    return tuple((int(piece), "") if piece.isdigit() else (-1, piece) for piece in pieces)


def is_static(name: str) -> bool:
    """Whether a trial of that name is a standing calibration, not a motion."""
    return bool(re.search(r"static|calib|(?<![a-z])[nt]-?_?pose", name.lower()))


def loose_trials(folder: Path) -> Description:
    """Trials and static trial among the files of a folder."""
    files = files_in(folder)
    by_name = {p.name.lower(): p for p in files}
    trials: list[TrialFiles] = []
    notes: list[str] = []
    static: Path | None = None
    for markers in files:
        kind = markers.suffix.lower()
        if kind not in (".trc", ".c3d"):
            continue
        forces, force_notes = _forces(markers, by_name)
        notes += force_notes
        twin = by_name.get(markers.stem.lower() + (".c3d" if kind == ".trc" else ".trc"))
        if twin is not None and kind == (".trc" if forces is None else ".c3d"):
            notes.append(f"{markers.name}: left out, the trial is read from {twin.name}")
        elif is_static(markers.stem):
            if static is not None:
                notes.append(f"{markers.name}: another static trial; {static.name} is used")
            static = static or markers
        elif kind == ".c3d" and forces is not None:
            notes.append(
                f"{forces.name}: left out, {markers.name} holds its own forces; a subject.toml may say else"
            )
            trials.append(TrialFiles(markers.stem, markers))
        else:
            trials.append(TrialFiles(markers.stem, markers, forces))
    return Description(trials=tuple(trials) or None, static=static, notes=tuple(notes))


def find_model(folder: Path) -> Path | None:
    """unscaled_generic.osim, else the only *_scaled.osim, else the only .osim; None where there is none.

    Raises:
        CaptureError: there are several, and nothing says which.
    """
    models = [p for p in files_in(folder) if p.suffix.lower() == ".osim"]
    for belongs in (
        [p for p in models if p.name.lower() == "unscaled_generic.osim"],
        [p for p in models if p.stem.lower().endswith("_scaled")],
        models,
    ):
        if len(belongs) == 1:
            return belongs[0]
        if belongs:
            raise CaptureError(
                f"{folder}: several models: {', '.join(p.name for p in belongs)}. Say which in subject.toml, "
                f'as in model = "{belongs[0].name}".'
            )
    return None


def _forces(markers: Path, by_name: dict[str, Path]) -> tuple[Path | None, tuple[str, ...]]:
    """The force file beside a marker file; X.mot only where it holds forces, not joint angles."""
    for ending in FORCE_ENDINGS:
        for suffix in (".mot", ".sto"):
            forces = by_name.get(f"{markers.stem}{ending}{suffix}".lower())
            if forces is None:
                continue
            if ending:
                return forces, ()
            try:
                find_plates(read_storage(forces))
            except CaptureError as error:
                return None, (f"{forces.name}: no forces of {markers.name} ({error})",)
            return forces, ()
    return None, ()
