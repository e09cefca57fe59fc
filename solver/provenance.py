"""From which inputs, with which versions, a fit was made; two fits of equal provenance are the same fit."""

import hashlib
import os
import platform
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from solver.capture.capture import Subject, TrialFiles

_PACKAGES = ("addb-viewer", "numpy", "scipy", "pin", "ezc3d")
_DESCRIPTION = ("mass_kg", "height_m", "sex", "age_years", "foot_bodies")


def provenance_of(subject: Subject, trials: Sequence[TrialFiles]) -> dict[str, str]:
    """Versions, the subject's description, and the SHA-256 of every file that a fit of these trials reads.

    Args:
        subject: the opened folder.
        trials: those to be fitted.
    """
    made_with = {name: _version(name) for name in _PACKAGES}
    described = {name: str(getattr(subject, name)) for name in _DESCRIPTION}
    hashes = {
        f"sha256 {Path(os.path.relpath(path, subject.folder)).as_posix()}": _sha256(path)
        for path in _inputs(subject, trials)
    }
    return {"python": platform.python_version(), **made_with, **described, **hashes}


def _inputs(subject: Subject, trials: Sequence[TrialFiles]) -> Iterable[Path]:
    shared = (subject.model, subject.static)
    of_trials = (path for trial in trials for path in (trial.markers, trial.forces, *trial.reviews))
    return dict.fromkeys(path for path in (*shared, *of_trials) if path is not None)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
