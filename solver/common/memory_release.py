"""Memory that was freed and that the C library still holds."""

import ctypes
import sys
from collections.abc import Callable

M_MMAP_THRESHOLD, M_ARENA_MAX = -3, -8  # of mallopt, in glibc's malloc.h
LARGE_BYTES, HEAPS = 2**18, 2


def release_memory() -> None:
    """Hand it to the system, where the library can.

    After a text file of 100 000 frames was read, it is more than the numbers in it.
    """
    trim = _of_glibc("malloc_trim")
    if trim is not None:
        trim(0)


def keep_little() -> None:
    """From now on large arrays go back when they are freed, and threads share two heaps in place of many."""
    tell = _of_glibc("mallopt")
    if tell is not None:
        tell(M_MMAP_THRESHOLD, LARGE_BYTES)
        tell(M_ARENA_MAX, HEAPS)


def _of_glibc(name: str) -> Callable[..., int] | None:
    return getattr(ctypes.CDLL(None), name, None) if sys.platform == "linux" else None
