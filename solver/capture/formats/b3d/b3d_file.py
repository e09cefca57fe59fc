"""Reads .b3d files: the header at once, each trial's frames where they lie on the disk."""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import overload

import numpy as np
from google.protobuf.message import DecodeError
from jaxtyping import UInt8

from solver.capture.atomic import whole_file
from solver.capture.formats.b3d.b3d_fields import (
    B3dFile,
    B3dTrial,
    Header,
    PassFrames,
    SensorFrames,
    decode_message,
    encode_message,
)
from solver.capture.formats.b3d.frames import (
    Layout,
    LayoutError,
    faults,
    layout_to_write,
    pack_frames,
    unpack_frames,
)
from solver.common.errors import CaptureError

LENGTH = struct.Struct("<q")  # of the header, in bytes
MEND = "Export or download it again."
FRAMES_AT_ONCE = 4096  # a few megabytes


def read_b3d(path: Path) -> B3dFile:
    """Open a .b3d file.

    No size that the file states is believed before it has been held against the file's own. Trials are read
    one by one when `trials` is asked for them: their series are views of the file, which therefore must stay
    as it is for as long as they are used.

    Raises:
        CaptureError: it is no .b3d file, it is cut off or damaged; the same while a trial is read.
    """
    path = Path(path)
    header, start = _header(path)
    return B3dFile(header, _TrialsInFile(path, header, start))


def _header(path: Path) -> tuple[Header, int]:
    """The header, and where the frames begin."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            prefix = file.read(LENGTH.size)
            length = LENGTH.unpack(prefix)[0] if len(prefix) == LENGTH.size else 0
            if not 0 < length <= size - LENGTH.size:
                raise CaptureError(
                    f"{path}: no .b3d file, or only the beginning of one: it has {size} bytes, and its first "
                    f"eight announce a header of {length}. {MEND}"
                )
            data = file.read(length)
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read ({error.strerror}).") from error
    try:
        header = decode_message(Header, data)
    except DecodeError as error:
        raise CaptureError(f"{path}: no .b3d file, or damaged: its header is unreadable. {MEND}") from error
    start = LENGTH.size + length
    _check_sizes(path, header, size - start)
    return header, start


def _check_sizes(path: Path, header: Header, given: int) -> None:
    """Hold what the header says against the bytes that there are."""
    stated = [header.raw_sensor_frame_size, header.processing_pass_frame_size]
    stated += [trial.trial_length for trial in header.trial_header]
    if min(stated) < 0:
        raise CaptureError(f"{path}: damaged: its header states a negative size. {MEND}")
    if header.num_trials not in (0, len(header.trial_header)):
        raise CaptureError(
            f"{path}: damaged: its header counts {header.num_trials} trials and describes "
            f"{len(header.trial_header)}. {MEND}"
        )
    needed = sum(_trial_bytes(header))
    if given != needed:
        wrong = "is cut off" if given < needed else "does not end where it should"
        raise CaptureError(
            f"{path}: {wrong}: its header asks for {needed} bytes of frames, and {given} follow. {MEND}"
        )


def _trial_bytes(header: Header) -> list[int]:
    return [
        trial.trial_length * _stride(header, len(trial.processing_pass_header))
        for trial in header.trial_header
    ]


def _stride(header: Header, passes: int) -> int:
    """Bytes from one frame of a trial to the next."""
    return header.raw_sensor_frame_size + passes * header.processing_pass_frame_size


@dataclass(frozen=True)
class _TrialsInFile(Sequence[B3dTrial]):
    """Trials that are opened when they are asked for."""

    path: Path
    header: Header
    start: int  # of the first trial's frames

    @cached_property
    def _starts(self) -> list[int]:
        return list(accumulate(_trial_bytes(self.header), initial=self.start))

    def __len__(self) -> int:
        return len(self.header.trial_header)

    @overload
    def __getitem__(self, index: int) -> B3dTrial: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[B3dTrial, ...]: ...

    def __getitem__(self, index: int | slice) -> B3dTrial | tuple[B3dTrial, ...]:
        if isinstance(index, slice):
            return tuple(self._trial(i) for i in range(len(self))[index])
        return self._trial(range(len(self))[index])

    def _trial(self, index: int) -> B3dTrial:
        about = self.header.trial_header[index]
        raw = self._bytes(index)
        first, size = self.header.raw_sensor_frame_size, self.header.processing_pass_frame_size
        try:
            trial = B3dTrial(
                header=about,
                sensors=unpack_frames(SensorFrames, raw[:, :first]),
                passes=tuple(
                    unpack_frames(PassFrames, raw[:, first + k * size : first + (k + 1) * size])
                    for k in range(len(about.processing_pass_header))
                ),
            )
            fault = next(faults(self.header, trial), None)
        except LayoutError as error:
            fault = str(error)
        if fault is not None:
            raise CaptureError(f"{self.path}: damaged: trial {index} '{about.name}': {fault}. {MEND}")
        return trial

    def _bytes(self, index: int) -> UInt8[np.ndarray, "frames bytes"]:
        """A trial's frames as they lie in the file, one row a frame."""
        about = self.header.trial_header[index]
        shape = about.trial_length, _stride(self.header, len(about.processing_pass_header))
        if not all(shape):
            return np.zeros(shape, np.uint8)
        try:
            return np.memmap(self.path, np.uint8, mode="r", offset=self._starts[index], shape=shape)
        except (OSError, ValueError) as error:
            raise CaptureError(f"{self.path}: changed or removed while it was read ({error}).") from error


def write_b3d(b3d: B3dFile, path: Path) -> None:
    """Write a .b3d file, whole or not at all; it may take the place of the one that it was read from.

    Frame sizes, trial headers and their number are those of `trials`, whatever the header says. A file that
    was read is written back byte by byte, as long as its writer kept to the order of the field numbers.

    Raises:
        CaptureError: the file cannot be written, or header and frames do not fit together.
    """
    path = Path(path)
    sensors, passes = _layouts(b3d)
    headers = []
    for index, trial in enumerate(b3d.trials):
        fault = next(faults(b3d.header, trial), None) or _fault_of_layout(trial, sensors, passes)
        if fault is not None:
            raise CaptureError(
                f"{path}: cannot be written as B3D: trial {index} '{trial.header.name}': {fault}."
            )
        headers.append(trial.header)
    header = replace(
        b3d.header,
        trial_header=tuple(headers),
        num_trials=len(headers) if b3d.header.num_trials else 0,  # most writers leave it out
        raw_sensor_frame_size=len(sensors.template),
        processing_pass_frame_size=len(passes.template),
    )
    try:
        data = encode_message(header)
    except (TypeError, ValueError) as error:
        raise CaptureError(f"{path}: cannot be written as B3D: {error}.") from error
    with whole_file(path, overwrite=True) as file:
        file.write(LENGTH.pack(len(data)))
        file.write(data)
        for trial in b3d.trials:
            for block in _blocks(trial, sensors, passes):
                file.write(block)


def _layouts(b3d: B3dFile) -> tuple[Layout, Layout]:
    """Of the first trial's sensors, and of the first pass that there is: all others must have the same."""
    sensors = passes = None
    for trial in b3d.trials:
        sensors = sensors or layout_to_write(trial.sensors)
        passes = passes or (layout_to_write(trial.passes[0]) if trial.passes else None)
        if passes is not None:
            break
    nothing = Layout(b"", {})
    return sensors or nothing, passes or nothing


def _fault_of_layout(trial: B3dTrial, sensors: Layout, passes: Layout) -> str | None:
    of_passes = all(layout_to_write(frames) == passes for frames in trial.passes)
    if layout_to_write(trial.sensors) == sensors and of_passes:
        return None
    return "its frames hold other series, or other numbers of values, than those of the first trial"


def _blocks(trial: B3dTrial, sensors: Layout, passes: Layout) -> Iterator[bytes]:
    """A trial's bytes, some thousand frames at a time: sensors, then each pass, frame by frame."""
    for start in range(0, trial.header.trial_length, FRAMES_AT_ONCE):
        end = min(start + FRAMES_AT_ONCE, trial.header.trial_length)
        parts = [pack_frames(trial.sensors, sensors, start, end)]
        parts += [pack_frames(frames, passes, start, end) for frames in trial.passes]
        yield np.hstack(parts).tobytes()
