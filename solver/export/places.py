"""Where exported files go, and what they are called."""

import re
from pathlib import Path

from solver.errors import FitError


def made(folder: Path) -> Path:
    """The folder, made where it is missing.

    Raises:
        FitError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FitError(
            f"{folder}: cannot be made ({error.strerror}); choose another output folder."
        ) from error
    return folder


def file_stem(name: str) -> str:
    """A trial's or subject's name with what file systems or OpenSim dislike in it replaced by "_"."""
    return re.sub(r"[^\w.+-]+", "_", name, flags=re.ASCII).lstrip(".") or "trial"
