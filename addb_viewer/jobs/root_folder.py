"""What may be opened: one subject, or a folder of subjects, and nothing outside it."""

import os
from dataclasses import dataclass
from pathlib import Path

from solver.capture.capture import Subject
from solver.capture.formats.b3d.places import recording_of, subject_folder_of
from solver.capture.formats.qtm_tsv import force_files
from solver.capture.subject.opened_subject import open_subject, subjects_in
from solver.common.errors import CaptureError
from solver.fitting.fit_result import Fit


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
        check_links(self.path, self.path / name)
        subject = open_subject(self.path / name)
        check_inside(self.path, subject)
        return subject


def open_root(folder: Path) -> RootFolder:
    """The subjects of a folder: itself, if it is one, else the folders below it that are.

    Raises:
        CaptureError: no such folder, no subject in it, or a file of the subject lies outside.
    """
    folder = subject_folder_of(folder)
    if not folder.is_dir() and recording_of(folder) is None:
        raise CaptureError(f"{folder}: no such folder; give a subject's folder, or one that holds several")
    path = folder.resolve()
    subjects, left_out = subjects_in(path, may_be_read=lambda place: check_links(path, place))
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


def check_links(root: Path, folder: Path) -> None:
    """Refuse a folder in which a link leads out of the root: sooner or later something would read it.

    Raises:
        OutsideError: names the link.
    """
    inside = root.resolve()
    for here, folders, files in os.walk(folder):  # which does not follow links
        for path in (Path(here, name) for name in (*folders, *files)):
            if path.is_symlink() and leads_out(path, inside):
                raise OutsideError(
                    f"{path}: leads out of {inside}. Replace the link by what it leads to, move it away, or "
                    "open the folder that holds both"
                )


def leads_out(path: Path, folder: Path) -> bool:
    """Whether a path, with its links followed, ends outside a folder; a link to itself ends nowhere."""
    try:
        return not path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):
        return False


def check_inside(root: Path, subject: Subject) -> None:
    """Refuse a subject whose files lie outside the root, by `..` or by a link.

    Of a subject that is the root itself they may lie beside it, as those of several people in one folder do.

    Raises:
        OutsideError: names the file.
    """
    inside, opened = root.resolve(), recording_of(root)
    allowed = inside.parent if subject.folder.resolve() == inside else inside
    for file in (subject.folder, *_files(subject)):
        if file == opened:
            continue  # it is what was asked for, and lies beside the folder of its decisions
        if not file.resolve().is_relative_to(allowed):
            raise OutsideError(
                f"{file}: leads out of {inside}, to {file.resolve()}. Copy it into the folder, or open the "
                "folder that holds both"
            )


def check_recorded(subject: Subject, fit: Fit) -> None:
    """Refuse a fit that says it was made of files elsewhere: a diagnosis or a solve would read them.

    Args:
        subject: opened, so that no link in its folder leads out.
        fit: as kept.

    Raises:
        OutsideError: names the file.
    """
    captures = (file for trial in fit.trials for file in trial.capture.files)
    read = {subject.recording, *_files(subject)}
    for file in (*_files(fit.subject), *captures):
        if file not in read and not Path(os.path.normpath(file)).is_relative_to(subject.folder):
            raise OutsideError(
                f"{subject.folder}: its fit says that it was made of {file}, outside the folder. "
                "Fit it again: addb-viewer fit"
            )


def _files(subject: Subject) -> tuple[Path, ...]:
    files = [subject.model, subject.static, subject.marker_map]
    for trial in subject.trials:
        files += [trial.markers, *(force_files(trial.forces) if trial.forces else ()), *trial.reviews]
    return tuple(file for file in files if file is not None)
