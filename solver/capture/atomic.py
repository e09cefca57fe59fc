"""Files and folders that appear whole or not at all.

They are written beside their place under a hidden name, as drafts, and moved there once they are on the
disk. A draft is locked by its writer; one that a killed run left behind is nobody's, and the next run that
writes in the folder removes it.
"""

import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import BinaryIO

from solver.capture.formats.b3d.places import belongs_to_b3d
from solver.capture.subject.measured_files import refuse_to_replace
from solver.common.disk_errors import ONLY_WRITING, writing_failed
from solver.common.errors import CaptureError, SolverError
from solver.common.file_names import encoded
from solver.common.operating_system import HAS_LOCKS, abandoned, taken

DRAFT = ".addb-draft-"  # how the names of drafts begin
UNCHANGED = "Nothing was changed there."
OWNER = ".owner"  # in a folder that is a draft: locked by its writer
_PATIENCE_S = 5.0  # [s] that somebody may take to see that a draft is not an abandoned one


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that a run killed half-way leaves the previous one as it was.

    Args:
        path: where the file belongs; its folder must exist.
        text: the contents; written as UTF-8 with the line ends it has.

    Raises:
        CaptureError: the folder is missing or cannot be written to.
    """
    data = encoded(text)
    with whole_file(path) as file:
        file.write(data)


@contextmanager
def whole_file(path: Path, *, overwrite: bool = False) -> Iterator[BinaryIO]:
    """A file to write into that takes the place of the previous one once the block has ended without error.

    Args:
        path: where the file belongs; its folder must exist, or be that of a .b3d file's decisions or results.
        overwrite: also what was measured, because a person said so.

    Raises:
        CaptureError: the folder is missing or cannot be written to, the disk is full, or what is there is
            somebody's own.
    """
    path = Path(path)
    if not overwrite:
        refuse_to_replace(path)
    if belongs_to_b3d(path.parent):
        made_folder(path.parent)
    clear_drafts_once(path.parent.absolute())
    name: Path | None = None
    try:
        draft, name = _begun(path.parent)
        with draft:
            yield draft
            on_disk(draft)
            os.chmod(name, 0o644)  # a temporary file starts out private to its writer
            if not overwrite:
                refuse_to_replace(path, name)
            if not HAS_LOCKS:
                draft.close()  # Windows moves no open file
            _moved(name, path)
    except BaseException as error:
        if name is not None:
            name.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise CaptureError(_writing_error(path, error)) from error
        raise


def made_folder(folder: Path) -> Path:
    """The folder, made where it is missing.

    Raises:
        CaptureError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaptureError(writing_failed(folder, error)) from error
    return folder


@contextmanager
def draft_folder(beside: Path) -> Iterator[Path]:
    """A new hidden folder to write into; the block moves it to where it belongs, or it is removed.

    Nobody else removes it while the block runs, unless this file system has no locks and a day passes.

    Args:
        beside: the folder that it is made in; must exist.

    Raises:
        CaptureError: it cannot be made.
    """
    clear_drafts(beside)
    try:
        draft = Path(tempfile.mkdtemp(dir=beside, prefix=DRAFT))
        os.chmod(draft, 0o755)  # a temporary folder starts out private to its writer
        owner = os.open(draft / OWNER, os.O_WRONLY | os.O_CREAT, 0o644)
    except OSError as error:
        raise CaptureError(writing_failed(beside, error)) from error
    if not HAS_LOCKS:
        os.close(owner)  # Windows moves and removes no folder in which a file is open
    try:
        if HAS_LOCKS:
            taken(owner, _PATIENCE_S)
        yield draft
    finally:
        shutil.rmtree(draft, ignore_errors=True)
        if HAS_LOCKS:
            os.close(owner)


@contextmanager
def files_together(
    home: Path, before_moving: Callable[[Sequence[Path]], None] = lambda _: None, *, overwrite: bool = False
) -> Iterator[Path]:
    """A folder to write into, whose files take their places elsewhere once the block has ended without error.

    Args:
        home: where they belong; made where it is missing.
        before_moving: given the places; raises where one must not be replaced.
        overwrite: also what was measured, because a person said so.

    Raises:
        CaptureError: the folder cannot be written to, or the disk is full: nothing was changed there.
    """
    with draft_folder(made_folder(home)) as draft:
        try:
            yield draft
        except OSError as error:
            if error.errno not in ONLY_WRITING:
                raise
            raise CaptureError(f"{writing_failed(home, error)} {UNCHANGED}") from error
        except SolverError as error:
            said = re.sub(rf"{re.escape(DRAFT)}[^/\\]*[/\\]", "", str(error))
            disk = f" {UNCHANGED}" if isinstance(error.__cause__, OSError) else ""
            raise type(error)(f"{said}{disk}") from error
        files = files_of_draft(draft)
        before_moving([home / file for file in files])
        for file in () if overwrite else files:
            refuse_to_replace(home / file, draft / file)
        for file in files:
            made_folder((home / file).parent)
            _moved(draft / file, home / file)


def files_of_draft(draft: Path) -> list[Path]:
    """The files in a draft of a folder, seen from it."""
    files = (path for path in draft.rglob("*") if path.is_file() and not path.name.startswith("."))
    return sorted(path.relative_to(draft) for path in files)


def move_draft_folder(draft: Path, place: Path) -> None:
    """Give the folder of a `draft_folder` its name.

    Raises:
        OSError: something else is there already.
    """
    with suppress(OSError):
        (draft / OWNER).unlink()  # its lock holds on: the file is still open
    draft.rename(place)


def clear_drafts(folder: Path) -> None:
    """Remove the drafts in a folder that killed runs left behind; those of living ones stay."""
    with suppress(OSError):  # a folder that cannot be read: whoever writes into it gets the error
        drafts = [Path(entry.path) for entry in os.scandir(folder) if entry.name.startswith(DRAFT)]
        for draft in drafts:
            with suppress(OSError):  # one that cannot be opened or removed stays
                _clear(draft)


clear_drafts_once = cache(clear_drafts)  # a thousand files into one folder: looked at with the first


def on_disk(file: BinaryIO) -> None:
    """Wait until what was written is on the disk; one that is full, or a quota, is known by now."""
    file.flush()
    os.fsync(file.fileno())


def _begun(folder: Path) -> tuple[BinaryIO, Path]:
    """A locked draft; one that somebody took for abandoned before it was locked is begun anew."""
    while True:
        handle, name = tempfile.mkstemp(dir=folder, prefix=DRAFT)
        draft = os.fdopen(handle, "wb")
        taken(handle, _PATIENCE_S)
        if not HAS_LOCKS or os.fstat(handle).st_nlink:
            return draft, Path(name)
        draft.close()


def _clear(draft: Path) -> None:
    """Remove a draft if nobody holds its lock; a folder without one is about to be locked, or to be moved."""
    is_folder = draft.is_dir()
    owner = draft / OWNER if is_folder else draft
    handle = os.open(owner, os.O_WRONLY) if HAS_LOCKS and owner.exists() else None
    try:
        held = None if handle is None else taken(handle)
        if held or (held is None and abandoned(draft)):
            if is_folder:
                shutil.rmtree(draft, ignore_errors=True)
            else:
                draft.unlink(missing_ok=True)
    finally:
        if handle is not None:
            os.close(handle)


def _moved(draft: Path, path: Path) -> None:
    try:
        os.replace(draft, path)
    except OSError as error:
        raise CaptureError(
            f"{path}: cannot be replaced ({error.strerror}); close the program that has it open, or move it "
            "away."
        ) from error


def _writing_error(path: Path, error: OSError) -> str:
    """Names the file that was meant, or another one that the block met trouble with."""
    named = Path(error.filename) if isinstance(error.filename, str | Path) else path
    in_draft = any(part.startswith(DRAFT) for part in named.parts)
    is_other = not in_draft and named.parent != path.parent
    return writing_failed(named if is_other else path, error)
