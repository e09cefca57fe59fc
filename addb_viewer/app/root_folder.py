"""What may be opened: one subject, or a folder of subjects, and nothing outside it."""

from dataclasses import dataclass
from pathlib import Path

from solver.capture.capture import Subject
from solver.capture.subject import open_subject, subjects_in
from solver.errors import CaptureError


class OutsideError(CaptureError):
    """A path that leads out of the opened folder."""


@dataclass(frozen=True)
class RootFolder:
    """The opened folder and its subjects."""

    path: Path  # without links
    names: tuple[str, ...]  # of the subjects' folders; the root itself is "."
    notes: tuple[str, ...] = ()  # folders that were left out, and why

    def subject(self, name: str) -> Subject:
        """Open a subject by its name.

        Raises:
            OutsideError: no subject of that name in the root, or a file of it lies outside the root.
            CaptureError: it cannot be read.
        """
        if name not in self.names:
            raise OutsideError(f"{self.path}: has no subject '{name}'")
        subject = open_subject(self.path / name)
        check_inside(self.path, subject)
        return subject


def open_root(folder: Path) -> RootFolder:
    """The subjects of a folder: itself, if it is one, else the folders below it that are.

    Raises:
        CaptureError: no such folder, no subject in it, or a file of the subject lies outside.
    """
    if not folder.is_dir():
        raise CaptureError(f"{folder}: no such folder; give a subject's folder, or one that holds several")
    path = folder.resolve()
    subjects, left_out = subjects_in(path)
    names, notes = [], list(left_out)
    for subject in subjects:
        name = subject.folder.relative_to(path).as_posix()
        try:
            check_inside(path, subject)
        except OutsideError as error:
            if subject.folder == path:
                raise
            notes.append(f"{name} is left out: {error}")
        else:
            names.append(name)
    if not names:
        raise OutsideError(f"{path}: no subject in it whose files lie inside. {' '.join(notes)}")
    return RootFolder(path, tuple(names), tuple(notes))


def check_inside(root: Path, subject: Subject) -> None:
    """Refuse a subject whose files lie outside the root, by `..` or by a link.

    Raises:
        OutsideError: names the file.
    """
    inside = root.resolve()
    files = [subject.folder, subject.model, subject.static]
    for trial in subject.trials:
        files += [trial.markers, trial.forces, *trial.reviews]
    for file in files:
        if file is not None and not file.resolve().is_relative_to(inside):
            raise OutsideError(
                f"{file}: leads out of {inside}, to {file.resolve()}. Copy it into the folder, or open the "
                "folder that holds both"
            )
