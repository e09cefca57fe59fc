"""The real recordings, every folder that describes a subject below $ADDB_DATA; and which code reads them."""

import hashlib
import os
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from solver.capture.capture import Markers, Subject
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.common.errors import SolverError
from solver.fitting.settings import Settings


def data_folder() -> Path:
    """$ADDB_DATA, else ../shared/data beside the project."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    return Path(os.environ.get("ADDB_DATA", beside))


def described_folders() -> list[Path]:
    """Every folder that describes a subject."""
    return sorted({p.parent for name in ("subject.toml", "_subject.json") for p in data_folder().rglob(name)})


def subjects() -> Iterator[tuple[str, Subject | SolverError]]:
    """Name and subject of every folder that describes one, or why it does not open."""
    root = data_folder()
    for folder in described_folders():
        try:
            yield str(folder.relative_to(root)), open_subject(folder)
        except SolverError as error:
            yield str(folder.relative_to(root)), error


def scaled_reference_models(subject: Subject) -> list[Path]:
    """Models that somebody else scaled to this subject, as they lie beside the recording."""
    return sorted((subject.folder / "reference").glob("*.osim"))


def without_model(subject: Subject) -> Subject:
    """The same recordings, as if nobody had made a model for them."""
    return replace(subject, model=None)


def recordings_of(subject: Subject, trial: str) -> list[Markers]:
    """Markers of a trial and of the static one."""
    reading = Settings().reading
    files = next(t for t in subject.trials if t.name == trial)
    found = [read_trial(files, reading).markers]
    return [*found, read_static(subject.static, reading).markers] if subject.static else found


def program_version() -> str:
    """The last commit that changed the program's packages, and what differs from it."""
    packages = [f":/{name}" for name in ("solver", "addb_viewer", "annotations")]

    def told_by(*words: str) -> str:
        git = ["git", "-C", str(Path(__file__).parent), *words, "--", *packages]
        return subprocess.run(git, capture_output=True, text=True, check=True).stdout

    try:
        commit, edits = told_by("log", "-1", "--format=%h").strip(), told_by("diff", "HEAD")
    except (OSError, subprocess.CalledProcessError):
        return "of no known version"
    return f"{commit}+{hashlib.sha256(edits.encode()).hexdigest()[:7]}" if edits else commit
