"""What a worker leaves beside its files: that they are whole, what they are, and rows of shared tables."""

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from addb_viewer.dataset.left_out import LeftOut
from solver.capture.atomic import write_whole

FILE = "receipt.json"


@dataclass(frozen=True)
class MadeFile:
    """A file of the release."""

    sha256: str
    bytes: int
    rows: int | None = None


@dataclass(frozen=True)
class Receipt:
    """What came of a task."""

    key: str
    files: Mapping[str, MadeFile] = field(default_factory=dict)  # by path in the release
    rows: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)  # by table
    inputs: Mapping[str, str] = field(default_factory=dict)  # SHA-256 by path in the subject
    settings: str = ""  # of the fit, as TOML
    left_out: tuple[LeftOut, ...] = ()
    failed: LeftOut | None = None  # of the whole subject; then there are no files
    seconds: float = 0.0
    peak_MB: float = 0.0


def made_file(path: Path, rows: int | None = None) -> MadeFile:
    """Size and SHA-256 of a file."""
    with path.open("rb") as file:
        return MadeFile(hashlib.file_digest(file, "sha256").hexdigest(), path.stat().st_size, rows)


def write_receipt(receipt: Receipt, folder: Path) -> None:
    """Last of all, whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / FILE, json.dumps(asdict(receipt), ensure_ascii=False, allow_nan=False))


def valid_receipt(folder: Path, key: str) -> Receipt | None:
    """The receipt of a task, if it was done with the same inputs and its files are there; else None."""
    try:
        plain = json.loads((folder / FILE).read_text(encoding="utf-8"))
        receipt = Receipt(
            key=plain["key"],
            files={name: MadeFile(**one) for name, one in plain["files"].items()},
            rows=plain["rows"],
            inputs=plain["inputs"],
            settings=plain["settings"],
            left_out=tuple(LeftOut(**one) for one in plain["left_out"]),
            failed=None if plain["failed"] is None else LeftOut(**plain["failed"]),
            seconds=plain["seconds"],
            peak_MB=plain["peak_MB"],
        )
    except (OSError, ValueError, KeyError, TypeError):
        return None
    whole = all(_has_size(folder / name, one.bytes) for name, one in receipt.files.items())
    return receipt if receipt.key == key and whole else None


def emptied(folder: Path) -> Path:
    """The folder, with nothing in it that a killed worker left."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def _has_size(path: Path, size: int) -> bool:
    try:
        return path.stat().st_size == size
    except OSError:
        return False
