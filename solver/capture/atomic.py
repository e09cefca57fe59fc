"""Files that appear whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from solver.errors import CaptureError


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that a run killed half-way leaves the previous one as it was.

    Args:
        path: where the file belongs; its folder must exist.
        text: the contents; written as UTF-8 with the line ends it has.

    Raises:
        CaptureError: the folder is missing or cannot be written to.
    """
    data = text.encode()
    with whole_file(path) as file:
        file.write(data)


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A file to write into that takes the place of the previous one once the block has ended without error.

    Args:
        path: where the file belongs; its folder must exist.

    Raises:
        CaptureError: the folder is missing or cannot be written to, or the disk is full.
    """
    path = Path(path)
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as draft:
            try:
                yield draft  # type: ignore[misc]
            except BaseException:
                draft.close()
                os.unlink(draft.name)
                raise
    except OSError as error:
        raise CaptureError(
            f"{path}: cannot write here ({error.strerror}); choose another output folder."
        ) from error
    try:
        os.chmod(draft.name, 0o644)  # a temporary file starts out private to its writer
        os.replace(draft.name, path)
    except OSError as error:
        os.unlink(draft.name)
        raise CaptureError(
            f"{path}: cannot be replaced ({error.strerror}); close the program that has it open."
        ) from error
