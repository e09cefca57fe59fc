"""What changes in a recording's numbers when a plate, a clock, a cable, a program or a marker is wrong.

Every function takes what is true and returns what is recorded, as the catalogue states it. Where a plate
reads exactly nothing it goes on reading nothing, unless said otherwise.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline
from scipy.signal import butter, filtfilt
from scipy.spatial.transform import Rotation

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.skeleton.forward import cross

LOADED_N = 20.0  # vertical force with which a centre of pressure means something
Clock = Callable[[Float[np.ndarray, " samples"]], Float[np.ndarray, " samples"]]
WHOLE_SAMPLE = 1e-6  # of a sample: nearer than this, samples are shifted, not interpolated
FEWEST_MARKERS = 3  # that make a frame


def loaded(plate: ForcePlate, least_N: float = LOADED_N) -> Bool[np.ndarray, " samples"]:
    """Samples with a foot on the plate."""
    return (plate.force_ground[:, 1] > least_N) & np.isfinite(plate.cop_ground).all(axis=1)


def silent(plate: ForcePlate) -> Bool[np.ndarray, " samples"]:
    """Samples that a program has set to zero."""
    return (plate.force_ground == 0).all(axis=1)


def centre(plate: ForcePlate) -> Float[np.ndarray, "3"]:
    """Middle of the extent of the loaded centre of pressure [m]; the origin for a plate never stepped on."""
    points = plate.cop_ground[loaded(plate)]
    return (points.min(axis=0) + points.max(axis=0)) / 2 if len(points) else np.zeros(3)


def free_moment(plate: ForcePlate) -> Float[np.ndarray, "samples 3"]:
    """Moment about the file's centre of pressure; about the origin where it gives none [N·m]."""
    return plate.moment_ground - cross(np.nan_to_num(plate.cop_ground), plate.force_ground)


def rebuild(
    plate: ForcePlate,
    force: Float[np.ndarray, "samples 3"],
    cop: Float[np.ndarray, "samples 3"],
    free: Float[np.ndarray, "samples 3"],
) -> ForcePlate:
    """The plate with other columns: force, centre of pressure (NaN unknown), moment about that point."""
    moment = free + cross(np.nan_to_num(cop), force)
    return replace(plate, force_ground=force, moment_ground=moment, cop_ground=cop)


def with_wrench(
    plate: ForcePlate, force: Float[np.ndarray, "samples 3"], moment: Float[np.ndarray, "samples 3"]
) -> ForcePlate:
    """The plate with another wrench about the ground origin, and the centre of pressure that goes with it."""
    known = np.isfinite(plate.cop_ground).all(axis=1)
    height = float(np.median(plate.cop_ground[known, 1])) if known.any() else 0.0
    pressed = known & (force[:, 1] > LOADED_N / 2)
    vertical = np.where(pressed, force[:, 1], np.nan)
    x = (moment[:, 2] + height * force[:, 0]) / vertical
    z = (height * force[:, 2] - moment[:, 0]) / vertical
    cop = np.stack([x, np.where(pressed, height, np.nan), z], axis=1)
    return replace(plate, force_ground=force, moment_ground=moment, cop_ground=cop)


def change_gain(plate: ForcePlate, gain_error: float) -> ForcePlate:
    """Recorded = (1 + gain_error) × true, force and moment; the centre of pressure stays."""
    return replace(
        plate,
        force_ground=(1 + gain_error) * plate.force_ground,
        moment_ground=(1 + gain_error) * plate.moment_ground,
    )


def add_bias(plate: ForcePlate, bias_N: Float[np.ndarray, "3"], while_unloaded: bool) -> ForcePlate:
    """A constant force added at the plate's centre; the loaded centre of pressure moves accordingly.

    Args:
        plate: true.
        bias_N: ground frame [N].
        while_unloaded: whether samples set to zero get it too.
    """
    on = np.ones(plate.samples, dtype=bool) if while_unloaded else ~silent(plate)
    added = np.where(on[:, None], bias_N, 0.0)
    moment = plate.moment_ground + cross(centre(plate), added)
    return with_wrench(plate, plate.force_ground + added, moment)


def shift_plate(plate: ForcePlate, shift_m: Float[np.ndarray, "3"]) -> ForcePlate:
    """Recorded centre of pressure = true + shift; force and free moment stay."""
    known = np.isfinite(plate.cop_ground).all(axis=1)
    cop = np.where(known[:, None], plate.cop_ground + shift_m, np.nan)
    return rebuild(plate, plate.force_ground, cop, free_moment(plate))


def turn_plate(plate: ForcePlate, yaw_deg: float) -> ForcePlate:
    """Recorded force and centre of pressure = R_y(yaw) × true about the plate's centre."""
    turn = Rotation.from_euler("Y", yaw_deg, degrees=True)
    middle = centre(plate)
    cop = middle + turn.apply(plate.cop_ground - middle)
    return rebuild(plate, turn.apply(plate.force_ground), cop, turn.apply(free_moment(plate)))


def tilt_plate(plate: ForcePlate, tilt_x_deg: float, tilt_z_deg: float) -> ForcePlate:
    """Recorded force vectors = R(rotation vector (tilt_x, 0, tilt_z)) × true; centre of pressure stays."""
    tilt = Rotation.from_rotvec(np.radians([tilt_x_deg, 0.0, tilt_z_deg]))
    return rebuild(plate, tilt.apply(plate.force_ground), plate.cop_ground, free_moment(plate))


def exchange_readings(one: ForcePlate, other: ForcePlate) -> tuple[ForcePlate, ForcePlate]:
    """Forces and free moments of two plates exchanged; each keeps its centre-of-pressure columns."""
    return (
        rebuild(one, other.force_ground, one.cop_ground, free_moment(other)),
        rebuild(other, one.force_ground, other.cop_ground, free_moment(one)),
    )


def misread_axes(plate: ForcePlate, axes: str) -> ForcePlate:
    """`x`: that component has the wrong sign; `xz`: the two are exchanged; centre of pressure stays."""
    force = plate.force_ground.copy()
    columns = ["xyz".index(axis) for axis in axes]
    force[:, columns] = -force[:, columns] if len(columns) == 1 else force[:, columns[::-1]]
    return rebuild(plate, force, plate.cop_ground, free_moment(plate))


def blank_samples(plate: ForcePlate, samples: slice) -> ForcePlate:
    """No force at all over some samples."""
    force, moment, cop = plate.force_ground.copy(), plate.moment_ground.copy(), plate.cop_ground.copy()
    force[samples], moment[samples], cop[samples] = 0.0, 0.0, np.nan
    return replace(plate, force_ground=force, moment_ground=moment, cop_ground=cop)


def stances(plate: ForcePlate, shortest_s: float = 0.15) -> list[slice]:
    """Runs of samples in which the plate bears a foot, whole ones only (not cut by the recording's ends)."""
    on = loaded(plate)
    edges = np.flatnonzero(np.diff(on.astype(int)))
    starts = [int(e) + 1 for e in edges if on[e + 1]]
    runs = []
    for start in starts:
        ends = [int(e) + 1 for e in edges if e >= start and not on[e + 1]]
        if ends and (ends[0] - start) / plate.rate >= shortest_s:
            runs.append(slice(start, ends[0]))
    return runs


def delay(capture: Capture, offset_s: float) -> Capture:
    """Recorded force(t) = true force(t − offset_s); the recording loses what nobody knows at its ends."""
    return _retime(capture, lambda times: times - offset_s)


def stretch_time(capture: Capture, stretch: float) -> Capture:
    """Recorded force time = (1 + stretch) × true time, zero at the trial's start."""
    return _retime(capture, lambda times: times / (1 + stretch))


def low_passed(capture: Capture, cutoff_Hz: float) -> Capture:
    """Forces and moments filtered (Butterworth of second order, forwards and backwards); markers are not."""
    plates = []
    for plate in capture.plates:
        b, a = butter(2, cutoff_Hz, fs=plate.rate)
        wrench = np.hstack([plate.force_ground, plate.moment_ground])
        smooth = filtfilt(b, a, wrench, axis=0)
        plates.append(_keep_pressing(plate, smooth) if silent(plate).any() else _kept(plate, smooth))
    return replace(capture, plates=tuple(plates))


def cut(capture: Capture, first: int, last: int) -> Capture:
    """Frames first to last (end exclusive) of markers, and the forces of that time, both from time 0."""
    markers = capture.markers
    since, until = first / markers.rate, (last - 1) / markers.rate
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
                point_ground=None if plate.point_ground is None else plate.point_ground[keep],
                start_time=markers.start_time + float(t[keep][0]) - since,
            )
        )
    seen = replace(markers, positions_ground=markers.positions_ground[first:last])
    return replace(capture, markers=seen, plates=tuple(plates))


def _retime(capture: Capture, clock: Clock) -> Capture:
    start = capture.markers.start_time
    frames = capture.markers.times - start
    asked = clock(frames)
    known = (asked >= -1e-9) & (asked <= min(p.times[-1] for p in capture.plates) - start + 1e-9)
    plates = tuple(_resample(plate, start, clock) for plate in capture.plates)
    inside = np.flatnonzero(known)
    changed = replace(capture, plates=plates)
    return cut(changed, int(inside[0]), int(inside[-1]) + 1)


def _resample(plate: ForcePlate, start: float, clock: Clock) -> ForcePlate:
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


def _keep_pressing(plate: ForcePlate, wrench: Float[np.ndarray, "samples 6"]) -> ForcePlate:
    """A program that writes zeros without load does so after its filter too."""
    pressed = wrench[:, 1] > 12.0
    zeroed = np.where(pressed[:, None], wrench, 0.0)
    return _kept(plate, zeroed)


def _kept(plate: ForcePlate, wrench: Float[np.ndarray, "samples 6"]) -> ForcePlate:
    height = np.nanmedian(plate.cop_ground[:, 1])
    everywhere = np.where(np.isfinite(plate.cop_ground), plate.cop_ground, (0.0, height, 0.0))
    return with_wrench(replace(plate, cop_ground=everywhere), wrench[:, :3], wrench[:, 3:])


def follow_markers(
    markers: Markers, names: list[str]
) -> tuple[Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"]]:
    """The frame of a group of markers: rotation from their shape, and centroid; gaps are bridged.

    Kabsch W. Acta Cryst A 1976; 32: 922-923. The shape is that of the middle frame that sees them all.
    """
    points = markers.positions_ground[:, [markers.names.index(name) for name in names]]
    whole = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    shape = points[whole[len(whole) // 2]] if len(whole) else np.full(points.shape[1:], np.nan)
    R = np.full((len(points), 3, 3), np.nan)
    centroid = np.full((len(points), 3), np.nan)
    for t, seen in enumerate(np.isfinite(points).all(axis=2)):
        if seen.sum() < FEWEST_MARKERS:
            continue
        here, there = points[t, seen], shape[seen]
        u, _, vt = np.linalg.svd((here - here.mean(axis=0)).T @ (there - there.mean(axis=0)))
        sign = np.sign(np.linalg.det(u @ vt))
        R[t] = u @ np.diag([1.0, 1.0, sign]) @ vt
        centroid[t] = here.mean(axis=0) + R[t] @ (shape.mean(axis=0) - there.mean(axis=0))
    return _fill_rotations(R), _fill(centroid)


def slip_marker(
    markers: Markers,
    name: str,
    shift: Float[np.ndarray, "3"],
    time_s: float,
    R_ground: Float[np.ndarray, "frames 3 3"],
) -> Markers:
    """The marker displaced by `shift` [m], in axes that turn with its segment, from a time on."""
    positions = markers.positions_ground.copy()
    after = markers.times - markers.start_time >= time_s
    positions[after, markers.names.index(name)] += (R_ground @ shift)[after]
    return replace(markers, positions_ground=positions)


def swap_markers(markers: Markers, one: str, other: str, first: int, last: int) -> Markers:
    """Two markers exchanged from a frame to another, end exclusive."""
    positions = markers.positions_ground.copy()
    a, b = markers.names.index(one), markers.names.index(other)
    positions[first:last, [a, b]] = positions[first:last, [b, a]]
    return replace(markers, positions_ground=positions)


def scale_markers(markers: Markers, scale: float) -> Markers:
    """Recorded marker = scale × true, about the laboratory's origin."""
    return replace(markers, positions_ground=scale * markers.positions_ground)


def soft(
    markers: Markers,
    names: list[str],
    *,
    R_ground: Float[np.ndarray, "frames 3 3"],
    R_next: Float[np.ndarray, "frames 3 3"],
    direction: Float[np.ndarray, "3 3"],
    rms_m: float,
) -> Markers:
    """All markers of a segment displaced together with the angle between it and its neighbour.

    The displacement in the segment's axes is direction · (rotation vector to the neighbour less its mean),
    scaled so that its length is `rms_m` in the mean square over frames.
    """
    angles = Rotation.from_matrix(R_ground.transpose(0, 2, 1) @ R_next)
    turn = (angles.mean().inv() * angles).as_rotvec()
    move = (turn - turn.mean(axis=0)) @ direction.T
    move *= rms_m / np.sqrt(np.mean(np.sum(move**2, axis=1)))
    positions = markers.positions_ground.copy()
    columns = [markers.names.index(name) for name in names]
    positions[:, columns] += (R_ground @ move[..., None])[..., 0][:, None]
    return replace(markers, positions_ground=positions)


def _fill(values: Float[np.ndarray, "frames n"]) -> Float[np.ndarray, "frames n"]:
    """Gaps bridged by straight lines, ends held."""
    known: Bool[np.ndarray, " frames"] = np.isfinite(values).all(axis=1)
    t = np.arange(len(values))
    return np.stack([np.interp(t, t[known], column[known]) for column in values.T], axis=1)


def _fill_rotations(R: Float[np.ndarray, "frames 3 3"]) -> Float[np.ndarray, "frames 3 3"]:
    flat = _fill(R.reshape(len(R), 9)).reshape(-1, 3, 3)
    u, _, vt = np.linalg.svd(flat)
    return u @ vt
