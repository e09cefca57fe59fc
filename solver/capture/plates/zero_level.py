"""The zero level of a force plate that was not tared: found where nobody stands on it, and taken off."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate, Markers
from solver.capture.plates.centre_of_pressure import centre_of_pressure, surface_of
from solver.capture.plates.force_settings import CONDITIONING, ConditioningSettings
from solver.capture.plates.plate_sign import REST_S
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import HALF_SIDE_M, JUDGED_N, LOAD_N, UNTARED_SHARE
from solver.common.true_runs import runs

OTHER_PLACE_M = 0.1  # by which a level's lever may differ between rests and loads
EDGE_N = 200.0  # a load below it comes or goes
BESIDE_M = 0.2  # beyond its outermost marker a foot reaches so far
# above the plate: higher markers are on the trunk and on arms, which reach beside a plate at will
LEG_M = 0.5
PERSON_M = 1.2  # from the middle marker: what is farther away is a thing, or a computed point at the origin
SEEN_SHARE = 0.75  # of the most markers that are seen at once; with fewer, a foot may be anywhere
MOST_LEVELS = 3  # at which a plate rests: empty, under one foot, under both
FEWEST_RETURNS = 3  # to one level from loads between: nobody who stands presses so evenly
ONE_SIDED_SHARE = 0.99  # of the readings lie to one side of an empty plate's
HUM_S = 0.04  # readings are judged by their mean over two periods of the mains (2.4 where it has 60 Hz)
ZERO_SHARE = UNTARED_SHARE  # a fifth of the plate's greatest force is a load, not a zero level
ZERO_BIN_N = 2.0  # of the histogram in which the level is looked for: the noise of a quiet plate
ZERO_STRETCH_S = 0.05  # and for so long; loading and unloading cross 20 N within 10 ms
# of the time with little load, that a level below zero must hold: a bias does for nine tenths, what a low-
# pass of 3 to 6 Hz leaves between steps for three quarters at most
ZERO_FLAT_SHARE = 0.8
ZERO_SMALLEST_N = 1.0  # smaller offsets are noise of their own estimate
ZERO_DRIFT_N = 3.0  # a zero level that moves by more from the first to the last stretch is reported


def zeroed(
    plate: ForcePlate, settings: ConditioningSettings = CONDITIONING
) -> tuple[ForcePlate, tuple[Note, ...]]:
    """The plate less the constant wrench that it shows while unloaded, and what was taken off.

    Left alone: plates that are never unloaded, files whose unloaded samples were set to exactly zero, and
    what a slow filter left between steps, which swings below zero and back.

    Args:
        plate: force up on the foot; NaN where nothing was recorded.
        settings: what counts as unloaded.
    """
    unloaded = unloaded_stretches(plate, settings)
    if not unloaded.any():
        return plate, ()
    level = level_of(plate, unloaded, settings)
    force = np.median(level[:, :3], axis=0)
    if float(np.linalg.norm(force)) < ZERO_SMALLEST_N:
        return plate, ()
    seconds = unloaded.sum() / plate.rate
    listed = ", ".join(f"{component:.1f}" for component in force)
    notes: tuple[Note, ...] = noted(
        Kind.PLATES,
        f"{plate.name}: reads {listed} N (x, y, z) while unloaded ({seconds:.2f} s); taken off as its zero "
        "level",
    )
    if np.ptp(level[:, 1]):
        notes += noted(
            Kind.OTHER,
            f"{plate.name}: its zero level drifts from {level[0, 1]:.1f} to {level[-1, 1]:.1f} N vertically; "
            "the drift is taken off as well",
        )
    return less(plate, level), notes


def level_of(
    plate: ForcePlate, resting: Bool[np.ndarray, " samples"], settings: ConditioningSettings
) -> Float[np.ndarray, "samples 6"]:
    """Force and moment of the empty plate: constant, or along a line between the rests if that drifts.

    Where a file writes no centre of pressure while the plate rests, its moment then is none of the plate's.

    Args:
        plate: as it is.
        resting: its empty samples.
        settings: from which drift on.
    """
    wrench = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    levels = [float(np.median(wrench[start:end, 1])) for start, end in runs(resting)]
    level = np.tile(np.median(wrench[resting], axis=0), (plate.samples, 1))
    if abs(levels[-1] - levels[0]) > ZERO_DRIFT_N:
        order = np.flatnonzero(resting)
        slope, at_zero = np.polyfit(order, wrench[resting], 1)
        level = np.clip(np.arange(plate.samples), order[0], order[-1])[:, None] * slope + at_zero
    if plate.point_ground is not None and np.isnan(plate.point_ground[resting]).any(axis=1).mean() > 0.5:
        at_edges = _moment_at_edges(plate, level[:, :3], settings)
        if np.linalg.norm(at_edges - level[0, 3:]) > OTHER_PLACE_M * np.linalg.norm(level[0, :3]):
            level[:, 3:] = at_edges
    return level


def _moment_at_edges(
    plate: ForcePlate, level_N: Float[np.ndarray, "samples 3"], settings: ConditioningSettings
) -> Float[np.ndarray, "3"]:
    """A constant moment without which the pressure stays where it is as a load comes or goes [N·m].

    The pressure is (moment − constant) / force, which small forces spread far if the constant is wrong.
    """
    assert plate.point_ground is not None
    force = plate.force_ground - level_N
    up = np.abs(force[:, 1])
    with_point = np.isfinite(plate.point_ground).all(axis=1) & (np.abs(plate.force_ground[:, 1]) > JUDGED_N)
    edge = with_point & (up > settings.threshold_N) & (up < EDGE_N + np.abs(level_N[:, 1]))
    edges = runs(edge)
    if not edges:
        return np.zeros(3)
    columns = np.zeros((int(edge.sum()), 1 + len(edges)))
    columns[:, 0] = 1 / force[edge, 1]
    columns[
        np.arange(len(columns)), 1 + np.repeat(range(len(edges)), [end - start for start, end in edges])
    ] = 1
    levers = plate.moment_ground[edge][:, [0, 2]] / force[edge, 1:2]
    (about_x, about_z), *_ = np.linalg.lstsq(columns, levers, rcond=None)[0]
    return np.array([about_x, 0.0, about_z])


def less(plate: ForcePlate, level: Float[np.ndarray, "samples 6"]) -> ForcePlate:
    """The plate less a zero level."""
    return replace(
        plate,
        force_ground=plate.force_ground - level[:, :3],
        moment_ground=plate.moment_ground - level[:, 3:],
    )


def unloaded_stretches(plate: ForcePlate, settings: ConditioningSettings) -> Bool[np.ndarray, " samples"]:
    """Where nobody stands on the plate; nowhere if the file set such samples to zero, or a filter rings."""
    nobody = np.zeros(plate.samples, dtype=bool)
    fewest = max(2, round(ZERO_STRETCH_S * plate.rate))
    if any(end - start >= fewest for start, end in runs((plate.force_ground == 0).all(axis=1))):
        return nobody
    finite = np.isfinite(plate.force_ground).all(axis=1) & np.isfinite(plate.moment_ground).all(axis=1)
    vertical = np.where(finite, plate.force_ground[:, 1], np.inf)
    if not finite.any():
        return nobody
    peak = float(np.abs(vertical[finite]).max())
    limit = settings.zero_largest_N
    if peak > limit + settings.zero_noise_N:
        limit = min(limit, ZERO_SHARE * peak)
    low = vertical[np.abs(vertical) <= limit]
    if len(low) < fewest:
        return nobody
    level = commonest(low)
    near = np.abs(vertical - level) <= settings.zero_noise_N
    for start, end in runs(near):
        if end - start >= fewest:
            nobody[start:end] = True
    rings = level < 0 and nobody.sum() < ZERO_FLAT_SHARE * len(low)
    return np.zeros_like(nobody) if rings else nobody


def commonest(values: Float[np.ndarray, " values"]) -> float:
    """Middle of the fullest bin of a histogram smoothed over three bins."""
    low = np.floor(values.min() / ZERO_BIN_N) * ZERO_BIN_N
    counts = np.bincount(((values - low) / ZERO_BIN_N).astype(int))
    smooth = np.convolve(counts, np.ones(3), mode="same")
    return float(low + (np.argmax(smooth) + 0.5) * ZERO_BIN_N)


def resting_samples(
    plate: ForcePlate, markers: Markers, conditioning: ConditioningSettings = CONDITIONING
) -> Bool[np.ndarray, " samples"]:
    """Samples of the empty plate; none where the recording does not show it.

    Their means, in which hum and vibration cancel, stay within a plate's noise of one level, or of a slow
    drift, and nobody is near at some of them: no marker is above the plate, none of a leg beside it. Or the
    plate comes back to that level from every load and never goes beyond, as on treadmills, which have
    somebody above them all the time.

    Args:
        plate: as read, y up, whichever way it counts.
        markers: of the same recording, y up.
        conditioning: how closely, and what tells its surface.
    """
    vertical = _without_hum(plate)
    quiet = _quiet(vertical, plate.rate, conditioning)
    fewest = REST_S * plate.rate
    left = quiet.copy()
    for _ in range(MOST_LEVELS):
        if left.sum() < fewest:
            break
        level = commonest(vertical[left])
        resting = quiet & (np.abs(vertical - level) <= conditioning.zero_noise_N)
        alone = resting & _nobody_near(plate, resting, markers)
        if alone.sum() >= fewest or _returned_to(vertical, resting, plate.rate, conditioning):
            return _along_a_drift(vertical, quiet, resting, conditioning)
        left &= ~resting
    return np.zeros_like(quiet)


def _without_hum(plate: ForcePlate) -> Float[np.ndarray, " samples"]:
    """Vertical readings, each the mean of those around; NaN where one of a wrench is not known [N]."""
    known = np.isfinite(plate.force_ground).all(axis=1) & np.isfinite(plate.moment_ground).all(axis=1)
    window = np.ones(min(round(HUM_S * plate.rate) | 1, plate.samples))
    total = np.convolve(np.where(known, plate.force_ground[:, 1], 0.0), window, "same")
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(known, total / np.convolve(known, window, "same"), np.nan)


def _quiet(
    vertical: Float[np.ndarray, " samples"], rate: float, conditioning: ConditioningSettings
) -> Bool[np.ndarray, " samples"]:
    """Samples in stretches of a rest's length whose readings differ by no more than noise."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # noqa: PLC0415 (slow to load)

    known = np.isfinite(vertical)
    window = max(2, round(REST_S * rate)) | 1
    highest = maximum_filter1d(np.where(known, vertical, np.inf), window, mode="constant", cval=np.inf)
    lowest = minimum_filter1d(np.where(known, vertical, -np.inf), window, mode="constant", cval=-np.inf)
    middles = highest - lowest <= 2 * conditioning.zero_noise_N
    return np.asarray(maximum_filter1d(middles, window, mode="constant"))


def _nobody_near(
    plate: ForcePlate, resting: Bool[np.ndarray, " samples"], markers: Markers
) -> Bool[np.ndarray, " samples"]:
    """Samples at which the person is seen, and away from the plate."""
    place = _place(plate, resting)
    frames = np.round((plate.times - markers.start_time) * markers.rate).astype(int)
    during = (frames >= 0) & (frames < markers.frames)
    seen = np.isfinite(markers.positions_ground).all(axis=2)
    if not len(place) or not seen.any():
        return np.zeros_like(during)
    across = markers.positions_ground[:, :, [0, 2]]
    middle = np.full((markers.frames, 1, 2), np.nan)
    middle[seen.any(axis=1), 0] = np.nanmedian(across[seen.any(axis=1)], axis=1)
    (low_x, _, low_z), (high_x, top, high_z) = place.min(axis=0), place.max(axis=0)
    with np.errstate(invalid="ignore"):
        on_leg = markers.positions_ground[:, :, 1] < top + LEG_M
        beside_m = np.where(on_leg, BESIDE_M, 0.0) + (HALF_SIDE_M if plate.corners_ground is None else 0.0)
        near = (np.linalg.norm(across - middle, axis=2) < PERSON_M) & (
            np.maximum.reduce(
                [
                    low_x - across[..., 0],
                    across[..., 0] - high_x,
                    low_z - across[..., 1],
                    across[..., 1] - high_z,
                ]
            )
            <= beside_m
        )
    enough = np.maximum(1.0, SEEN_SHARE * seen.sum(axis=1).max())
    away = (seen.sum(axis=1) >= enough) & ~near.any(axis=1)
    return during & away[np.clip(frames, 0, markers.frames - 1)]


def _place(plate: ForcePlate, resting: Bool[np.ndarray, " samples"]) -> Float[np.ndarray, "points 3"]:
    """The plate's corners, else where loads press on it if it is empty while it rests [m]."""
    if plate.corners_ground is not None and np.isfinite(plate.corners_ground).all():
        return plate.corners_ground
    force = plate.force_ground - np.median(plate.force_ground[resting], axis=0)
    moment = plate.moment_ground - np.median(plate.moment_ground[resting], axis=0)
    with np.errstate(invalid="ignore"):
        size = np.abs(force[:, 1])
        loaded = size > max(LOAD_N, UNTARED_SHARE * float(np.nanmax(size)))
    sign = np.sign(np.nansum(force[loaded, 1]))
    points = centre_of_pressure(sign * force[loaded], sign * moment[loaded], surface_of(plate))
    return points[np.isfinite(points).all(axis=1)]


def _returned_to(
    vertical: Float[np.ndarray, " samples"],
    resting: Bool[np.ndarray, " samples"],
    rate: float,
    conditioning: ConditioningSettings,
) -> bool:
    """Whether these rests lie between loads, agree, and are the least that the plate bears."""
    rests = [(a, b) for a, b in runs(resting) if b - a >= REST_S * rate]
    if len(rests) < FEWEST_RETURNS:
        return False
    levels = np.array([np.median(vertical[a:b]) for a, b in rests])
    away = vertical[np.isfinite(vertical)] - np.median(vertical[resting])
    side = np.sign(away[np.argmax(np.abs(away))])
    one_sided = (side * away > -2 * conditioning.zero_noise_N).mean() >= ONE_SIDED_SHARE
    little = np.abs(away) <= conditioning.zero_largest_N
    flat = resting.sum() >= ZERO_FLAT_SHARE * little.sum()
    loads = sum(
        np.nanmax(np.abs(vertical[a:b] - level), initial=0.0) > LOAD_N
        for (_, a), (b, _), level in zip(rests, rests[1:], levels, strict=False)
    )
    agree = np.abs(levels - np.median(levels)) <= ZERO_DRIFT_N
    return bool(one_sided and flat and agree.sum() >= FEWEST_RETURNS and loads >= FEWEST_RETURNS - 1)


def _along_a_drift(
    vertical: Float[np.ndarray, " samples"],
    quiet: Bool[np.ndarray, " samples"],
    resting: Bool[np.ndarray, " samples"],
    conditioning: ConditioningSettings,
) -> Bool[np.ndarray, " samples"]:
    """Likewise of a level that rises or falls slowly: quiet samples near the line through these."""
    order = np.arange(len(vertical)) / len(vertical)
    for _ in range(MOST_LEVELS):
        line = np.polynomial.Polynomial.fit(order[resting], vertical[resting], 1)(order)
        if np.ptp(line) > conditioning.zero_largest_N:
            break
        resting = quiet & (np.abs(vertical - line) <= conditioning.zero_noise_N)
    return resting
