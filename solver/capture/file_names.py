"""File names made of other names: two names never give one file, on no file system."""

import unicodedata
from collections.abc import Callable, Sequence

LONGEST_BYTES = 200  # of a stem: file systems take 255, and endings come on top


def distinct(names: Sequence[str], stem_of: Callable[[str], str]) -> dict[str, str]:
    """A stem for each name; one that is taken gets a number, the first free one from 2.

    Stems that differ in capitals or in how an accent is coded are one file on macOS and Windows.

    Args:
        names: distinct ones; the order decides who gets a number.
        stem_of: a name without what file systems dislike.
    """
    stems: dict[str, str] = {}
    taken: set[str] = set()
    for name in sorted(names, key=lambda name: stem_of(name) != name):  # who keeps its name comes first
        stem, number = _short(stem_of(name), LONGEST_BYTES), 2
        while _folded(stem) in taken:
            ending = f"-{number}"
            stem = _short(stem_of(name), LONGEST_BYTES - len(ending)) + ending
            number += 1
        taken.add(_folded(stem))
        stems[name] = stem
    return {name: stems[name] for name in names}


def _short(stem: str, most: int) -> str:
    return stem.encode()[:most].decode(errors="ignore")


def _folded(stem: str) -> str:
    return unicodedata.normalize("NFKC", stem).casefold()
