"""What is to be done to one subject, what came of it, and what is left out, and why."""

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from addb_viewer.dataset.release_subject import BuildOptions, ReleaseSubject
from solver.capture.atomic import write_whole
from solver.common.typed_json import from_plain, plain

REASONS = {
    "subject": {
        "withdrawn": "the person was left out by --without, now or in an earlier build; no other is given",
        "no_licence": "no licence, neither in subject.toml nor by --licence; or no SPDX identifier",
        "no_consent": "consent is not public",
        "unreadable": "the folder or file cannot be read",
        "not_two_contact_bodies": "forces act on other than two feet, or no name shows the right one",
        "duplicate_subject": "the same recordings as another subject's",
        "no_trials": "none of its trials is kept",
        "fit_failed": "the fit ended in an error",
        "worker_died": "the process that fitted it died three times",
        "timed_out": "its fit took longer than --time-out; the next build tries again",
    },
    "trial": {
        "static": "it scales the body and is no trial",
        "not_listed": "its markers belong to no trial of the subject: subject.toml does not name them",
        "unreadable": "its files cannot be read",
        "no_forces": "no force plate was recorded",
        "too_short": "fewer than 12 frames",
        "unusable": "a person marked it unusable; the detail says for what, and why",
        "not_reviewed": "nobody has finished its review, and --unreviewed was not given",
        "duplicate_trial": "the same recording as another trial",
        "no_dynamics": "too few frames count for a fit to the forces",
        "no_counting_frames": "no frame counts",
        "non_finite": "the fit has values that are no numbers",
    },
    "range": {
        "no_pose": "too few markers are seen to know where the body is",
        "erroneous": "a person said that the frames must not be used",
    },
    "segment": {"too_short": "fewer than 12 frames"},
}
"""By level, in the order in which they are asked; the first that holds is told."""


@dataclass(frozen=True)
class LeftOut:
    """Something that is not in the release."""

    level: str
    id: str
    reason: str
    detail: str = ""
    start_frame: int | None = None
    end_frame: int | None = None
    frames: int = 0
    hours: float = 0.0

    def __post_init__(self) -> None:
        """Only reasons that the table above has."""
        if self.reason not in REASONS[self.level]:
            raise ValueError(f"no reason '{self.reason}' for a {self.level}")


def hours_of(frames: int, rate_hz: float) -> float:
    """How long so many frames last [h]."""
    return frames / rate_hz / 3600


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
    write_whole(folder / FILE, json.dumps(plain(receipt), ensure_ascii=False, allow_nan=False))


def valid_receipt(folder: Path, key: str) -> Receipt | None:
    """The receipt of a task, if it was done with the same inputs and its files are there; else None."""
    try:
        receipt = from_plain(json.loads((folder / FILE).read_text(encoding="utf-8")), Receipt)
    except (OSError, ValueError):
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


@dataclass(frozen=True)
class Task:
    """A subject to be fitted, and where its files go."""

    key: str  # SHA-256 of all that the files depend on
    place: Path  # of the subject: folder or .b3d file
    who: ReleaseSubject
    trials: tuple[str, ...]  # that are wanted
    options: BuildOptions
    out: Path  # folder of the files
    frames: int  # of all wanted trials

    def write(self, path: Path) -> None:
        """As JSON, for a process of its own."""
        path.write_text(json.dumps(plain(self)), encoding="utf-8")


def read_task(path: Path) -> Task:
    """What `Task.write` wrote."""
    return from_plain(json.loads(path.read_text(encoding="utf-8")), Task)
