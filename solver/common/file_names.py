"""Names of trials, labels and files: read whatever bytes they are, and made into files of their own.

Two names never give one file, on no file system.
"""

import os
import unicodedata
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path, PurePosixPath

LONGEST_BYTES = 200  # of a stem: file systems take 255, and endings come on top

_UNDECODED = {
    0xDC00 + byte: bytes([byte]).decode("cp1252", errors="ignore") or "\N{REPLACEMENT CHARACTER}"
    for byte in range(0x80, 0x100)
}
_READABLE = (
    dict.fromkeys(range(0xD800, 0xE000), "\N{REPLACEMENT CHARACTER}")
    | _UNDECODED
    | dict.fromkeys((*range(0x20), *range(0x7F, 0xA0), 0x2028, 0x2029), " ")
)


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


def decoded(raw: bytes) -> str:
    """A text as laboratories write it: UTF-8, and what is no UTF-8 as Windows has it in the West."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("utf-8-sig", "surrogateescape").translate(_UNDECODED)


def readable(name: str) -> str:
    """A name that can be shown, written and found again: no byte undecoded, no control character.

    Args:
        name: as a file system or a library gives it, undecoded bytes as surrogates.
    """
    return name if name.isascii() and name.isprintable() else name.translate(_READABLE)


def encoded(text: str) -> bytes:
    """A text as files of ours hold it, UTF-8; names of others' files in it as they are shown."""
    try:
        return text.encode()
    except UnicodeEncodeError:
        return text.translate(_UNDECODED).encode(errors="replace")


def lying(folder: Path, name: str) -> Path:
    """The file of a name in a folder, whatever bytes the disk has for it.

    Args:
        folder: to look in.
        name: as people see it, with slashes.

    Returns:
        Where it lies; where it would lie if it is missing.
    """
    place = folder
    for part in PurePosixPath(name).parts:
        inner = place / part
        if not os.path.lexists(inner):
            with suppress(OSError):
                alike = (other for other in sorted(os.listdir(place)) if _shown(other) == _shown(part))
                inner = place / next(alike, part)
        place = inner
    return place


def _shown(name: str) -> str:
    return unicodedata.normalize("NFC", readable(name))


def _short(stem: str, most: int) -> str:
    return stem.encode()[:most].decode(errors="ignore")


def _folded(stem: str) -> str:
    return unicodedata.normalize("NFKC", stem).casefold()
