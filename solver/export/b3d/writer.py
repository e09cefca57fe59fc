"""Writes .b3d files."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from solver.capture.atomic import whole_file
from solver.capture.formats.b3d.checks import faults
from solver.capture.formats.b3d.frames import Layout, layout_to_write, packed
from solver.capture.formats.b3d.reader import LENGTH
from solver.capture.formats.b3d.schema import B3dFile, B3dTrial
from solver.capture.formats.b3d.wire import encoded
from solver.common.errors import CaptureError

FRAMES_AT_ONCE = 4096  # a few megabytes


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
        data = encoded(header)
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
        parts = [packed(trial.sensors, sensors, start, end)]
        parts += [packed(frames, passes, start, end) for frames in trial.passes]
        yield np.hstack(parts).tobytes()
