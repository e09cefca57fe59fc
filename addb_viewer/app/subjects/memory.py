"""What closed trials took goes back to the system, where C's library is glibc, which keeps much by itself."""

import contextlib
import ctypes
import threading

M_MMAP_THRESHOLD, M_ARENA_MAX = -3, -8  # of mallopt, in glibc's malloc.h
LARGE_BYTES, HEAPS = 2**18, 2
NOT_GLIBC = (OSError, TypeError, AttributeError)


def keep_little() -> None:
    """From now on large arrays go back when they are freed, and threads share two heaps in place of many."""
    with contextlib.suppress(*NOT_GLIBC):
        tell = ctypes.CDLL(None).mallopt
        tell(M_MMAP_THRESHOLD, LARGE_BYTES)
        tell(M_ARENA_MAX, HEAPS)


def give_back() -> None:
    """Give back what is free in the heaps, in the background."""
    threading.Thread(target=_trim, name="giving memory back", daemon=True).start()


def _trim() -> None:
    with contextlib.suppress(*NOT_GLIBC):
        ctypes.CDLL(None).malloc_trim(0)
