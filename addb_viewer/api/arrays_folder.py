"""Recordings given as arrays, written as an ordinary subject's folder: TRC, MOT, subject.toml.

So everything that reads a subject reads these: reviews, diagnosis, report, the app, OpenSim.
"""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from solver.capture.atomic import made_folder, write_whole
from solver.capture.capture import Capture, PlateWord, Subject, TrialFiles
from solver.capture.formats.trc import write_trc
from solver.capture.subject.subject_toml import described_as_toml
from solver.common.errors import CaptureError
from solver.common.file_names import distinct
from solver.export.export_places import file_stem
from solver.simulate.subject_folder import write_forces

HEAD = "# Written by addb_viewer.Subject.from_arrays; the next call for this folder writes it anew.\n"
DESCRIPTION = "subject.toml"
PLACE = "recordings"  # folder of the files


@dataclass(frozen=True)
class Person:
    """Whose recordings; what is not known is estimated."""

    mass_kg: float | None = None
    height_m: float | None = None
    sex: str | None = None  # "male", "female"
    model: Path | None = None  # an OpenSim model; None: the default full body

    def __post_init__(self) -> None:
        """Refuse what is no person.

        Raises:
            CaptureError: a mass or height that nobody has, or another word for the sex.
        """
        for name, value, least, most in (
            ("mass_kg", self.mass_kg, 2, 500),
            ("height_m", self.height_m, 0.3, 2.8),
        ):
            if value is not None and not least <= value <= most:
                raise CaptureError(f"{name} = {value:g}: a number between {least:g} and {most:g} is needed.")
        if self.sex not in (None, "male", "female"):
            raise CaptureError(f"sex = '{self.sex}': write male or female, or leave it out.")
        if self.model is not None and not self.model.is_file():
            raise CaptureError(f"{self.model}: no such model file.")


def write_recordings(
    folder: Path, captures: Sequence[Capture], static: Capture | None, person: Person
) -> None:
    """Write recordings in place of those that an earlier call wrote.

    Args:
        folder: made where it is missing.
        captures: the trials, y up.
        static: a static trial, if there is one.
        person: whose.

    Raises:
        CaptureError: the folder holds something else, or cannot be written to.
    """
    _check_ours(folder)
    place = made_folder(folder / PLACE)
    stems = distinct([capture.name for capture in captures], file_stem)
    trials = tuple(_written(capture, place, stems[capture.name]) for capture in captures)
    static_file = None
    if static is not None:
        static_file = folder / "static.trc"
        write_trc(static_file, static.markers, "m")
    model = None
    if person.model is not None:
        model = folder / person.model.name
        shutil.copyfile(person.model, model)
    subject = Subject(
        folder=folder,
        trials=trials,
        mass_kg=person.mass_kg,
        height_m=person.height_m,
        sex=person.sex,
        model=model,
        static=static_file,
    )
    write_whole(folder / DESCRIPTION, HEAD + described_as_toml(subject))


def _written(capture: Capture, place: Path, stem: str) -> TrialFiles:
    """One trial's files; forces as they are meant, so that nobody guesses."""
    markers, forces = place / f"{stem}.trc", None
    write_trc(markers, capture.markers, "m")
    if capture.plates:
        forces = place / f"{stem}_forces.mot"
        write_forces(forces, capture.plates)
    return TrialFiles(
        name=capture.name,
        markers=markers,
        forces=forces,
        up="y",
        moments="free" if forces else None,
        plates=tuple(PlateWord(plate.name, sign=1) for plate in capture.plates),
    )


def _check_ours(folder: Path) -> None:
    """Refuse a folder whose recordings are somebody's own."""
    if not folder.exists():
        return
    description = folder / DESCRIPTION
    if description.is_file():
        if description.read_text(encoding="utf-8").startswith(HEAD):
            return
    elif folder.is_dir() and not any(folder.iterdir()):
        return
    raise CaptureError(
        f"{folder}: holds other files; name an empty or a new folder, or one that from_arrays has written."
    )
