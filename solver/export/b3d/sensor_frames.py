"""What was measured, at the markers' frames: markers, and the plates before any conditioning."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.formats.b3d.schema import SensorFrames
from solver.capture.plates.conditioning import gaps_filled, resampled
from solver.capture.plates.force_settings import ConditioningSettings
from solver.skeleton.forward import cross


def marker_names(captures: Sequence[Capture]) -> tuple[str, ...]:
    """Every marker of any trial, in the order in which they come up."""
    return tuple(dict.fromkeys(name for capture in captures for name in capture.markers.names))


def sensor_frames(
    capture: Capture, names: Sequence[str], plates: int, settings: ConditioningSettings
) -> SensorFrames:
    """Markers in the order of `names`, NaN where unseen; plates, and zeros up to as many as `plates`.

    Force and moment are resampled to the markers' frames, and turned to act on the person; nothing else is
    done to them. The moment is about the stored centre of pressure, or about the ground origin while there is
    none. NaN on frames that the recording doesn't cover.
    """
    frames = capture.markers.frames
    cop, torque, force = np.zeros((3, frames, plates, 3))
    for k, plate in enumerate(capture.plates):
        cop[:, k], torque[:, k], force[:, k] = _wrench_at_frames(plate, capture.markers.times, settings)
    return SensorFrames(
        marker_obs=_observed(capture.markers, names).reshape(frames, -1),
        raw_force_plate_cop=cop.reshape(frames, -1),
        raw_force_plate_torque=torque.reshape(frames, -1),
        raw_force_plate_force=force.reshape(frames, -1),
    )


def corners(capture: Capture) -> Float[np.ndarray, " 12*plates"]:
    """Four corners a plate [m]; NaN for those of a plate whose place isn't known."""
    unknown = np.full((4, 3), np.nan)
    return np.array(
        [unknown if plate.corners_ground is None else plate.corners_ground for plate in capture.plates]
    ).reshape(-1)


def _observed(markers: Markers, names: Sequence[str]) -> Float[np.ndarray, "frames markers 3"]:
    observed = np.full((markers.frames, len(names), 3), np.nan)
    observed[:, [names.index(name) for name in markers.names]] = markers.positions_ground
    return observed


def _wrench_at_frames(
    plate: ForcePlate, times: Float[np.ndarray, " frames"], settings: ConditioningSettings
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
    """Centre of pressure [m], moment about it [N·m] and force [N]."""
    whole, _, _ = gaps_filled(plate, settings)
    at_frames, covered = resampled(whole, times, settings)
    cop = np.nan_to_num(at_frames.cop_ground)
    torque = at_frames.moment_ground - cross(cop, at_frames.force_ground)
    outside = ~covered[:, None]
    return (
        np.where(outside, np.nan, cop),
        np.where(outside, np.nan, torque),
        np.where(outside, np.nan, at_frames.force_ground),
    )
