"""Untrusted .npz files of NumPy: nothing is allocated that the file does not hold, or unpickled."""

import math
import zipfile
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

MOST_INFLATED_BYTES = 1 << 30  # compressed arrays together; an hour's extension has a third
_HEADER = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
_BROKEN = (ValueError, KeyError, EOFError, NotImplementedError, zipfile.BadZipFile, RuntimeError)


def stored_arrays(path: Path, *names: str) -> dict[str, np.ndarray]:
    """The arrays of an .npz file, by name.

    Args:
        path: the file.
        names: those wanted; none: all.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no .npz, an array is missing, or one is larger than the file can hold.
    """
    try:
        with zipfile.ZipFile(path) as packed:
            members = {info.filename.removesuffix(".npy"): info for info in packed.infolist()}
            wanted = [members[name] for name in names or members]
            _check_sizes(path, packed, wanted)
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in names or members}
    except _BROKEN as error:
        if isinstance(error, KeyError):
            raise ValueError(f"there is no array {error}") from error
        raise ValueError(str(error) or type(error).__name__) from error


def _check_sizes(path: Path, packed: zipfile.ZipFile, members: list[zipfile.ZipInfo]) -> None:
    on_disk, inflated = path.stat().st_size, 0
    for info in members:
        with packed.open(info) as file:
            version = npy.read_magic(file)
            if version not in _HEADER:
                raise ValueError(f"array '{info.filename}' is of an unknown version {version}")
            shape, _, kind = _HEADER[version](file)
            held = info.file_size - file.tell()
        needed = math.prod(shape) * kind.itemsize
        if needed != held:
            raise ValueError(
                f"array '{info.filename}' of shape {shape} takes {needed} bytes, and the file holds {held}"
            )
        if info.compress_type == zipfile.ZIP_STORED and held > on_disk:
            raise ValueError(f"array '{info.filename}' is larger than the file")
        inflated += 0 if info.compress_type == zipfile.ZIP_STORED else held
    if inflated > MOST_INFLATED_BYTES:
        raise ValueError(
            f"its compressed arrays take {inflated / 1e9:.1f} GB, more than {MOST_INFLATED_BYTES / 1e9:.1f}"
        )
