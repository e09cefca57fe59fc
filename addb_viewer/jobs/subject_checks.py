"""What every command refuses before any time is spent on it."""

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

from solver.capture.capture import Subject
from solver.capture.formats.b3d.places import DECISIONS, recording_of
from solver.common.errors import CaptureError


def check_folder(folder: Path) -> None:
    """Refuse a subject folder that isn't there."""
    if not folder.is_dir() and recording_of(folder) is None:
        given = str(folder).removesuffix(DECISIONS)
        if folder.is_file():
            raise CaptureError(f"{given}: this is a file; give the folder that holds it, or a .b3d file")
        raise CaptureError(
            f"{given}: no such folder; give the folder that holds the recordings, or a .b3d file"
        )


def check_trials(subject: Subject, wanted: Sequence[str]) -> None:
    """Refuse a trial that the subject doesn't have."""
    known = [trial.name for trial in subject.trials]
    for name in wanted:
        if name not in known:
            near = get_close_matches(name, known) or known
            raise CaptureError(f"{subject.folder}: no trial '{name}'; nearest: {', '.join(near)}")
