"""A release: folders of reviewed subjects as files that others load."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from addb_viewer.dataset.reader import Release


def open(path: str | Path) -> "Release":
    """A release as tables; PyArrow and NumPy are all that it takes.

    Args:
        path: its folder.

    Raises:
        ReleaseError: the folder is no release, or one of another format.
    """
    from addb_viewer.dataset.reader import open_release  # noqa: PLC0415 (loads PyArrow)

    return open_release(Path(path))
