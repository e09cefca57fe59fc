"""Force plates against cameras in time: late, at another rate, or filtered on their own."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.signal import butter, filtfilt

from solver.capture.capture import Capture, ForcePlate
from solver.simulate.faults.plates import silent, with_wrench

Clock = Callable[[Float[np.ndarray, " samples"]], Float[np.ndarray, " samples"]]
WHOLE_SAMPLE = 1e-6  # of a sample: nearer than this, samples are shifted, not interpolated


def late(capture: Capture, offset_s: float) -> Capture:
    """Recorded force(t) = true force(t − offset_s); the recording loses what nobody knows at its ends."""
    return _retimed(capture, lambda times: times - offset_s)


def stretched(capture: Capture, stretch: float) -> Capture:
    """Recorded force time = (1 + stretch) × true time, zero at the trial's start."""
    return _retimed(capture, lambda times: times / (1 + stretch))


def low_passed(capture: Capture, cutoff_Hz: float) -> Capture:
    """Forces and moments filtered (Butterworth of second order, forwards and backwards); markers are not."""
    plates = []
    for plate in capture.plates:
        b, a = butter(2, cutoff_Hz, fs=plate.rate)
        wrench = np.hstack([plate.force_ground, plate.moment_ground])
        smooth = filtfilt(b, a, wrench, axis=0)
        plates.append(_pressed_only(plate, smooth) if silent(plate).any() else _kept(plate, smooth))
    return replace(capture, plates=tuple(plates))


def cut(capture: Capture, first: int, last: int) -> Capture:
    """Frames first to last (end exclusive) of markers, and the forces of that time, both from time 0."""
    markers = capture.markers
    since = first / markers.rate
    until = (last - 1) / markers.rate
    plates = []
    for plate in capture.plates:
        t = plate.times - markers.start_time
        keep = (t > since - 0.5 / plate.rate) & (t < until + 0.5 / plate.rate)
        plates.append(
            replace(
                plate,
                force_ground=plate.force_ground[keep],
                moment_ground=plate.moment_ground[keep],
                cop_ground=plate.cop_ground[keep],
                start_time=markers.start_time + float(t[keep][0]) - since,
            )
        )
    seen = replace(markers, positions_ground=markers.positions_ground[first:last])
    return replace(capture, markers=seen, plates=tuple(plates))


def _retimed(capture: Capture, clock: Clock) -> Capture:
    start = capture.markers.start_time
    frames = capture.markers.times - start
    asked = clock(frames)
    known = (asked >= -1e-9) & (asked <= min(p.times[-1] for p in capture.plates) - start + 1e-9)
    plates = tuple(_resampled(plate, start, clock) for plate in capture.plates)
    inside = np.flatnonzero(known)
    changed = replace(capture, plates=plates)
    return cut(changed, int(inside[0]), int(inside[-1]) + 1)


def _resampled(plate: ForcePlate, start: float, clock: Clock) -> ForcePlate:
    """The plate's true columns at other times; whole samples are moved, others interpolated."""
    own = plate.times - plate.start_time
    asked = clock(plate.times - start) + start - plate.start_time
    position = np.clip(asked * plate.rate, 0, plate.samples - 1)
    nearest = np.round(position).astype(int)
    wrench = np.hstack([plate.force_ground, plate.moment_ground])
    if np.abs(position - nearest).max() < WHOLE_SAMPLE:
        return replace(
            plate,
            force_ground=wrench[nearest, :3],
            moment_ground=wrench[nearest, 3:],
            cop_ground=plate.cop_ground[nearest],
        )
    between = CubicSpline(own, wrench)(np.clip(asked, own[0], own[-1]))
    between[silent(plate)[nearest]] = 0.0
    here = replace(plate, cop_ground=plate.cop_ground[nearest])
    return with_wrench(here, between[:, :3], between[:, 3:])


def _pressed_only(plate: ForcePlate, wrench: Float[np.ndarray, "samples 6"]) -> ForcePlate:
    """A program that writes zeros without load does so after its filter too."""
    pressed = wrench[:, 1] > 12.0
    zeroed = np.where(pressed[:, None], wrench, 0.0)
    return _kept(plate, zeroed)


def _kept(plate: ForcePlate, wrench: Float[np.ndarray, "samples 6"]) -> ForcePlate:
    height = np.nanmedian(plate.cop_ground[:, 1])
    everywhere = np.where(np.isfinite(plate.cop_ground), plate.cop_ground, (0.0, height, 0.0))
    return with_wrench(replace(plate, cop_ground=everywhere), wrench[:, :3], wrench[:, 3:])
