"""Locks on open files that end with the process that holds them, however it ends.

They hold between processes, and on network file systems that pass them on (NFS 4, SMB) between machines.
Where there are none, as on some network shares and on Windows, `taken` says so, and the caller goes by age.
"""

import errno
import time
from collections.abc import Callable
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

HAS_LOCKS = fcntl is not None
UNOWNED_S = 86400.0  # [s] without locks, what nobody has touched for a day is nobody's: no write takes that
AGAIN_S = 0.01  # [s] between two tries; a lock is held while a file is written and a folder renamed

_HELD_BY_ANOTHER = {errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES}


def taken(handle: int, patience_s: float = 0.0) -> bool | None:
    """Lock an open file for this process alone; closing it lets it go.

    Args:
        handle: open for writing.
        patience_s: how long to wait while somebody else holds it [s].

    Returns:
        Whether it is held now; None where this file system has no locks.
    """
    if fcntl is None:
        return None
    end = time.monotonic() + patience_s
    while True:
        held = _held(lambda: fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB))
        if held is not False or time.monotonic() >= end:
            return held
        time.sleep(AGAIN_S)


def _held(lock: Callable[[], None]) -> bool | None:
    try:
        lock()
    except OSError as error:
        return False if error.errno in _HELD_BY_ANOTHER else None
    return True


def abandoned(path: Path) -> bool:
    """Whether nobody has touched a file or folder for so long that it is nobody's, locks or not."""
    try:
        return time.time() - path.stat().st_mtime > UNOWNED_S
    except OSError:
        return False  # somebody removes it just now
