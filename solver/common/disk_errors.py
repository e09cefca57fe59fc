"""What a disk that refuses means, and what to do about it, in words."""

import errno
import shutil
from pathlib import Path

from solver.common.errors import CaptureError

_NO_SPACE = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}
ONLY_WRITING = {*_NO_SPACE, errno.EFBIG, errno.EROFS}  # errors that no reading meets
_NOT_ALLOWED = {errno.EACCES, errno.EPERM, errno.EROFS}
_MEGABYTE = 1e6  # [bytes]


def writing_failed(path: Path, error: OSError) -> str:
    """Why a file could not be written, and what to do: one sentence that begins with the path.

    Args:
        path: the file or folder that was wanted.
        error: as the system raised it.
    """
    path = Path(path)
    why = error.strerror or str(error) or type(error).__name__
    if error.errno in _NO_SPACE:
        room = free_space(path)
        left = "" if room is None else f", {room / _MEGABYTE:.1f} MB free"
        return f"{path}: cannot write here ({why}{left}); free some space, or choose another output folder."
    if error.errno == errno.EFBIG:
        return (
            f"{path}: cannot write here ({why}: this account or file system limits the size of a file); "
            "raise the limit (ulimit -f), or choose another output folder."
        )
    if error.errno in _NOT_ALLOWED:
        return f"{path}: cannot write here ({why}); make it writable, or choose another output folder."
    if error.errno == errno.ENOENT and not path.parent.is_dir():
        why = f"there is no folder {path.parent}"
        return f"{path}: cannot write here ({why}); make it, or choose another output folder."
    return f"{path}: cannot write here ({why}); choose another output folder."


def free_space(path: Path) -> int | None:
    """Bytes that this account may still write where a path lies or would lie; None where nobody can tell."""
    there = next((p for p in (path, *Path(path).absolute().parents) if p.is_dir()), None)
    try:
        return None if there is None else shutil.disk_usage(there).free
    except OSError:
        return None


def check_room(folder: Path, needed: float, what: str) -> None:
    """Refuse, before work is spent, what will not fit on the disk.

    Args:
        folder: where it is to be written; need not exist.
        needed: its size, estimated [bytes].
        what: to be written, in words.

    Raises:
        CaptureError: there is less room.
    """
    room = free_space(folder)
    if room is not None and room < needed:
        raise CaptureError(
            f"{folder}: the disk has {room / _MEGABYTE:.1f} MB free, and {what} will take about "
            f"{needed / _MEGABYTE:.1f} MB; free some space, or choose another output folder. Nothing was "
            "computed."
        )
