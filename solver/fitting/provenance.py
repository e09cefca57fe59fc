"""From which inputs, with which versions, a fit was made; two fits of equal provenance are the same fit."""

import hashlib
import json
import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from solver.capture.capture import Subject, TrialFiles
from solver.capture.formats.qtm_tsv import force_files
from solver.common.file_names import readable
from solver.contact.force_review import ForceReview, as_plain
from solver.dynamics.trajectory.extension import Extension

_PACKAGES = ("addb-viewer", "numpy", "scipy", "pin", "ezc3d")
_REVIEW = "sha256 of the review of "
_EXTENSION = "sha256 of the accepted extension"
_FILE = "sha256 "
_RANGES = "ranges of "
_SAID = "said of "
_FILES = "files of "
_DESCRIPTION = ("mass_kg", "height_m", "sex", "age_years", "foot_bodies", "model_is")
_SHARED = ("model", "static")  # files that every trial of the subject is read with


def provenance_of(
    subject: Subject,
    trials: Sequence[TrialFiles],
    reviews: Mapping[str, ForceReview] | None = None,
    extension: Extension | None = None,
) -> dict[str, str]:
    """Versions, the description, which file is what, and the SHA-256 of all that a fit of the trials reads.

    Args:
        subject: the opened folder.
        trials: those to be fitted.
        reviews: by trial, what people say about its forces.
        extension: what acts beside the recorded forces.
    """
    made_with = {name: _version(name) for name in _PACKAGES}
    described = {name: str(getattr(subject, name)) for name in _DESCRIPTION}
    shared = {name: _places(subject, getattr(subject, name)) for name in _SHARED}
    files = {f"{_FILES}{t.name}": _places(subject, t.markers, t.forces) for t in trials}
    hashes = {f"{_FILE}{_places(subject, path)}": _sha256(path) for path in inputs_of(subject, trials)}
    reviewed = {
        f"{_REVIEW}{t.name}": hashlib.sha256(json.dumps(as_plain(reviews[t.name])).encode()).hexdigest()
        for t in trials
        if reviews and t.name in reviews
    }
    said = {f"{_SAID}{trial.name}": words for trial in trials if (words := _words(trial))}
    ranges = {f"{_RANGES}{trial.name}": str(trial.ranges) for trial in trials if trial.ranges}
    extended = {_EXTENSION: extension.fingerprint} if extension else {}
    versions = {"python": platform.python_version(), **made_with}
    roles = {**shared, **files}
    return {**versions, **described, **roles, **hashes, **said, **ranges, **reviewed, **extended}


def other_recordings(one: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """Which files and entries of a description two provenances know otherwise, whatever the versions."""
    decided = (_REVIEW, _EXTENSION)
    both = [
        name
        for name in one
        if name in other
        and (
            name in (*_DESCRIPTION, *_SHARED)
            or (name.startswith((_FILE, _FILES, _SAID, _RANGES)) and not name.startswith(decided))
        )
    ]
    return [name.removeprefix(_FILE) for name in both if one[name] != other[name]]


def differences(then: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """In which inputs and versions two provenances differ, in words; reviews aside.

    Args:
        then: of the earlier one.
        now: of the later one.
    """
    names = [name for name in {**then, **now} if then.get(name) != now.get(name)]
    return [_in_words(name, then, now) for name in names if not name.startswith(_REVIEW)]


def extension_in(provenance: Mapping[str, str]) -> str | None:
    """Fingerprint of the extension that a fit was made with; None where it was made with none."""
    return provenance.get(_EXTENSION)


def without_reviews(provenance: Mapping[str, str]) -> dict[str, str]:
    """The provenance that a fit of the same files would have if nobody had flagged anything."""
    return {name: value for name, value in provenance.items() if not name.startswith(_REVIEW)}


def _in_words(name: str, then: Mapping[str, str], now: Mapping[str, str]) -> str:
    if name == _EXTENSION:
        return "the accepted causes"
    if name.startswith(_FILES) and not (name in then and name in now):
        trial = name.removeprefix(_FILES)
        return f"{trial} is {'new' if name in now else 'gone'}"
    if name.startswith(_FILE) or name in (*_DESCRIPTION, *_SHARED):
        return name.removeprefix(_FILE)
    if name.startswith((_FILES, _SAID, _RANGES)):
        return name
    return f"{name} {then.get(name)} is {now.get(name)} now"


def _words(trial: TrialFiles) -> str:
    """What a person said about the trial's files beside their names; empty where nothing."""
    plates = [
        f"{plate.name!r}: sign {plate.sign}, zero {plate.zero_N}"
        for plate in sorted(trial.plates, key=lambda plate: plate.name)
    ]
    axes = [f"{key} {word}" for key in ("up", "moments", "prefix") if (word := getattr(trial, key))]
    return "; ".join([*axes, *plates])


def _places(subject: Subject, *paths: Path | None) -> str:
    """Where files lie, as seen from the subject's folder."""
    given = [Path(os.path.relpath(path, subject.folder)).as_posix() for path in paths if path is not None]
    return readable(", ".join(given)) or "none"


def inputs_of(subject: Subject, trials: Sequence[TrialFiles] | None = None) -> Iterable[Path]:
    """Every file that a fit of these trials, or of all, reads."""
    shared = (subject.model, subject.static, subject.marker_map)
    chosen = subject.trials if trials is None else trials
    forces = (path for trial in chosen if trial.forces for path in force_files(trial.forces))
    of_trials = (path for trial in chosen for path in (trial.markers, *trial.reviews))
    return dict.fromkeys(path for path in (*shared, *of_trials, *forces) if path is not None)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
