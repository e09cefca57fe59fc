"""What was measured, described or decided is never written over, unless this program wrote it.

A file of a kind that is read here bears a mark where this program wrote it. One without is somebody's own.
"""

import re
import tomllib
from collections.abc import Iterator
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

from solver.capture.formats.b3d.places import RESULTS, SUFFIX
from solver.common.errors import CaptureError

MARK = "written by addb-viewer"
VIDEOS = (".mp4", ".m4v", ".mov", ".webm")
READ = (".trc", ".c3d", ".mot", ".sto", ".forces", ".osim", SUFFIX, ".sqlite", *VIDEOS)
NAMES = ("subject.toml", "settings.toml", "_subject.json", "review.json")
TEXTS = (".csv", ".tsv", ".txt")  # measured where they begin as Motive, Nexus and QTM begin theirs
PAGES = (".html",)  # nobody reads them here, but a folder may hold others' reports
_MARKED = re.compile(rb"written by addb[-_]viewer", re.IGNORECASE)
_MEASURED_TEXT = re.compile(
    rb"\s*\"?format version\b"
    rb"|\s*\"?(trajectories|devices|model outputs|joints|segments|events|objects|analog)\"?[\s;,]*$"
    rb"|(?s:.*)^\"?(no_of_(frames|markers|samples|cameras)|data_included)[\t;,]",
    re.IGNORECASE | re.MULTILINE,
)
_HEAD_BYTES = 4096
_DEEPEST = 4  # folders above a file in which a subject.toml may list it


def refuse_to_replace(path: Path, by: Path | None = None) -> None:
    """Raise where a file that is there must stay as it is.

    Args:
        path: the file.
        by: the draft that is to take its place; None: not written yet.

    Raises:
        CaptureError: it was measured, described or decided by somebody. What bears this program's mark may be
            replaced by what bears it too.
    """
    why = reason_to_stay(path)
    if why and not (_is_marked(path) and (by is None or _is_marked(by))):
        raise CaptureError(f"{path}: is there and stays as it is: {why}. Name another file or folder.")


def reason_to_stay(path: Path) -> str:
    """Why nothing of another kind is to be written over a file; empty where that may be, or none is there."""
    if not path.is_file() or _is_among_results(path):
        return ""
    kind = path.suffix.lower()
    if kind in READ or path.name.lower() in NAMES or (kind in TEXTS and _MEASURED_TEXT.match(_head(path))):
        return "it is a recording, a model, a description or a review"
    if kind in PAGES and b"addb-viewer" not in _head(path):
        return "this program did not write it"
    listing = next((file for file in _descriptions(path) if path.resolve() in set(listed_in(file))), None)
    return f"{listing} lists it" if listing else ""


def _is_among_results(path: Path) -> bool:
    return any(
        (place.name == "results" and (place / "fit.json").is_file())
        or place.name.lower().endswith(SUFFIX + RESULTS)
        for place in path.absolute().parents
    )


def _is_marked(path: Path) -> bool:
    if not path.stat().st_size:
        return False
    with path.open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as content:
        return _MARKED.search(content) is not None


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(_HEAD_BYTES)


def _descriptions(path: Path) -> Iterator[Path]:
    for folder in path.absolute().parents[:_DEEPEST]:
        if (folder / "subject.toml").is_file():
            yield folder / "subject.toml"


def listed_in(description: Path) -> Iterator[Path]:
    """Every file that a subject.toml names; none where it cannot be read."""
    try:
        tables = tomllib.loads(description.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return
    yield from ((description.parent / text).resolve() for text in _texts(tables))


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from _texts(one)
