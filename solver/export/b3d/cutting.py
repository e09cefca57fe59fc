"""A piece of a trial as a trial of its own, as the format keeps long recordings."""

from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np

from solver.capture.formats.b3d.schema import B3dTrial, PassFrames, SensorFrames

_ALL = ("missing_GRF_reason", "has_manual_GRF_annotation")  # a value a frame, in a trial's header
_OF_PASS = ("marker_rms", "marker_max", "linear_residual", "angular_residual", "joints_max_velocity")
Frames = TypeVar("Frames", SensorFrames, PassFrames)


def cut(trial: B3dTrial, start: int, end: int, index: int, **about: Any) -> B3dTrial:
    """Frames start to end − 1 of a whole trial; it says of itself where it comes from.

    Args:
        trial: whole.
        start: first frame.
        end: the first that no longer belongs.
        index: number of the piece, from 0.
        about: what else its header says.
    """
    whole, step = trial.header, trial.header.trial_timestep
    rows = slice(start, end)
    passes = tuple(
        replace(header, **{name: getattr(header, name)[rows] for name in _OF_PASS})
        for header in whole.processing_pass_header
    )
    begin = whole.original_start_time
    own: dict[str, Any] = {
        "name": f"{whole.name}_split{index}",
        "trial_length": end - start,
        "processing_pass_header": passes,
        "split_index": index,
        "original_start_frame": start,
        "original_end_frame": end,
        "original_start_time": begin + start * step,
        "original_end_time": begin + end * step,
        **{name: getattr(whole, name)[rows] for name in _ALL},
        **about,
    }
    return B3dTrial(
        replace(whole, **own),
        _rows(trial.sensors, rows),
        tuple(_rows(frames, rows) for frames in trial.passes),
    )


def _rows(frames: Frames, rows: slice) -> Frames:
    """Those rows of every series that there is."""
    own: dict[str, Any] = {
        field.name: np.asarray(getattr(frames, field.name)[rows])
        for field in fields(frames)
        if field.name != "unknown" and all(getattr(frames, field.name).shape)
    }
    return replace(frames, **own)
