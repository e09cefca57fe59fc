"""One rerun recording being filled: whole columns on the trial's two timelines, and static things."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
from jaxtyping import Float, Int, UInt8, UInt32

from addb_viewer.trial_view.drawn_curves import nanoseconds

FRAME, TIME = "frame", "time"  # timelines: frames from 0, and seconds on the recording's clock


class RrdStream:
    """Entities are named by their parts, so that any name of a file may be one."""

    def __init__(self, stream: rr.RecordingStream, times: Float[np.ndarray, " frames"]) -> None:
        self._stream, self._times = stream, times

    @property
    def frames(self) -> int:
        """Number of frames of the trial."""
        return len(self._times)

    def static(self, parts: Sequence[str], *things: rr.AsComponents) -> None:
        """Something that holds at all times; written once."""
        for thing in things:
            self._stream.log(path(parts), thing, static=True)

    def columns(
        self,
        parts: Sequence[str],
        columns: rr.ComponentColumnList,
        *,
        frames: Int[np.ndarray, " rows"] | None = None,
        lengths: Int[np.ndarray, " rows"] | None = None,
    ) -> None:
        """Values of many frames at once.

        Args:
            parts: of the entity's name.
            columns: one value a row, or `lengths` of them.
            frames: those that the rows are about; None: all of them.
            lengths: number of instances on each row; None: one.
        """
        rows = np.arange(self.frames) if frames is None else frames
        if not len(rows):
            return
        indexes = [
            rr.TimeColumn(FRAME, sequence=rows),
            rr.TimeColumn(TIME, duration=nanoseconds(self._times[rows]).astype("timedelta64[ns]")),
        ]
        told = columns if lengths is None else columns.partition(lengths)
        self._stream.send_columns(path(parts), indexes, told, strict=True)

    def samples(
        self, parts: Sequence[str], columns: rr.ComponentColumnList, times: Float[np.ndarray, " rows"]
    ) -> None:
        """Values with a clock of their own [s], on the recording's time alone."""
        index = rr.TimeColumn(TIME, duration=nanoseconds(times).astype("timedelta64[ns]"))
        self._stream.send_columns(path(parts), [index], columns, strict=True)

    def steps(self, parts: Sequence[str], timeline: str, columns: rr.ComponentColumnList, rows: int) -> None:
        """Values on a timeline of their own, counted from 0."""
        if rows:
            index = rr.TimeColumn(timeline, sequence=np.arange(rows))
            self._stream.send_columns(path(parts), [index], columns, strict=True)


def path(parts: Sequence[str]) -> str:
    """An entity's path, whatever characters its parts have."""
    return rr.new_entity_path(list(parts))


def packed(colors: UInt8[np.ndarray, "*rows 3"]) -> UInt32[np.ndarray, "*rows"]:
    """Colours as rerun keeps them, opaque: 0xRRGGBBAA."""
    wide = colors.astype(np.uint32)
    packed: np.ndarray = (wide[..., 0] << 24) | (wide[..., 1] << 16) | (wide[..., 2] << 8) | 0xFF
    return packed
