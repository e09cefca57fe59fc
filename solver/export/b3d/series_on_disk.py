"""A long trial's series in a file without a name: memory holds what is asked of it."""

from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from jaxtyping import Float


class SeriesOnDisk:
    """Numbers by frames, in the order in which they were added; read as slices, or all as an array."""

    def __init__(self, folder: Path, width: int) -> None:
        """Without frames.

        Args:
            folder: where the file is, on a disk; it is gone with the series, however the program ends.
            width: numbers a frame.
        """
        self._file = TemporaryFile(dir=folder)  # noqa: SIM115 (as long as the series)
        self._frames, self._width = 0, width

    def add(self, values: Float[np.ndarray, "frames width"]) -> None:
        """Further frames."""
        self._file.seek(0, 2)
        self._file.write(np.ascontiguousarray(values, float).data)
        self._frames += len(values)

    @property
    def shape(self) -> tuple[int, int]:
        """Frames, and numbers a frame."""
        return self._frames, self._width

    def __len__(self) -> int:
        return self._frames

    def __getitem__(self, frames: slice) -> Float[np.ndarray, "frames width"]:
        start, stop, _ = frames.indices(self._frames)
        values = np.empty((max(0, stop - start), self._width))
        self._file.seek(start * self._width * values.itemsize)
        self._file.readinto(values.data)
        return values

    def __array__(self, dtype: np.dtype | None = None, copy: bool | None = None) -> np.ndarray:
        return self[:] if dtype is None else self[:].astype(dtype, copy=False)


def on_disk(values: Float[np.ndarray, "frames width"], folder: Path) -> Any:
    """The same series, to be read like an array."""
    series = SeriesOnDisk(folder, values.shape[1])
    series.add(values)
    return series
