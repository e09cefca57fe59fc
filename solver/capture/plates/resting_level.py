"""Where a plate is seen empty: it rests at one level while nobody is near it, whatever its size and sign."""

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate, Markers
from solver.capture.plates.centre_of_pressure import centre_of_pressure, surface_of
from solver.capture.plates.force_settings import CONDITIONING, ConditioningSettings
from solver.capture.plates.plate_sign_settings import PLATE_SIGN, PlateSignSettings
from solver.capture.plates.zero_level import commonest
from solver.common.plate_figures import HALF_SIDE_M, LOAD_N, UNTARED_SHARE
from solver.common.runs import runs

BESIDE_M = 0.2  # beyond its outermost marker a foot reaches so far
LEG_M = (
    0.5  # above the plate: higher markers are on the trunk and on arms, which reach beside a plate at will
)
PERSON_M = 1.2  # from the middle marker: what is farther away is a thing, or a computed point at the origin
SEEN_SHARE = 0.75  # of the most markers that are seen at once; with fewer, a foot may be anywhere
MOST_LEVELS = 3  # at which a plate rests: empty, under one foot, under both
FEWEST_RETURNS = 3  # to one level from loads between: nobody who stands presses so evenly
OFTEN = 0.99  # of the readings lie to one side of an empty plate's
HUM_S = 0.04  # readings are judged by their mean over two periods of the mains (2.4 where it has 60 Hz)


def resting_samples(
    plate: ForcePlate,
    markers: Markers,
    settings: PlateSignSettings = PLATE_SIGN,
    conditioning: ConditioningSettings = CONDITIONING,
) -> Bool[np.ndarray, " samples"]:
    """Samples of the empty plate; none where the recording does not show it.

    Their means, in which hum and vibration cancel, stay within a plate's noise of one level, or of a slow
    drift, and nobody is near at some of them: no marker is above the plate, none of a leg beside it. Or the
    plate comes back to that level from every load and never goes beyond, as on treadmills, which have
    somebody above them all the time.

    Args:
        plate: as read, y up, whichever way it counts.
        markers: of the same recording, y up.
        settings: for how long a plate rests.
        conditioning: how closely, and what tells its surface.
    """
    vertical = _without_hum(plate)
    quiet = _quiet(vertical, plate.rate, settings, conditioning)
    fewest = settings.rest_s * plate.rate
    left = quiet.copy()
    for _ in range(MOST_LEVELS):
        if left.sum() < fewest:
            break
        level = commonest(vertical[left], conditioning.zero_bin_N)
        resting = quiet & (np.abs(vertical - level) <= conditioning.zero_noise_N)
        alone = resting & _nobody_near(plate, resting, markers, conditioning)
        if alone.sum() >= fewest or _returned_to(vertical, resting, plate.rate, settings, conditioning):
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
    vertical: Float[np.ndarray, " samples"],
    rate: float,
    settings: PlateSignSettings,
    conditioning: ConditioningSettings,
) -> Bool[np.ndarray, " samples"]:
    """Samples in stretches of a rest's length whose readings differ by no more than noise."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # noqa: PLC0415 (slow to load)

    known = np.isfinite(vertical)
    window = max(2, round(settings.rest_s * rate)) | 1
    highest = maximum_filter1d(np.where(known, vertical, np.inf), window, mode="constant", cval=np.inf)
    lowest = minimum_filter1d(np.where(known, vertical, -np.inf), window, mode="constant", cval=-np.inf)
    middles = highest - lowest <= 2 * conditioning.zero_noise_N
    return np.asarray(maximum_filter1d(middles, window, mode="constant"))


def _nobody_near(
    plate: ForcePlate,
    resting: Bool[np.ndarray, " samples"],
    markers: Markers,
    conditioning: ConditioningSettings,
) -> Bool[np.ndarray, " samples"]:
    """Samples at which the person is seen, and away from the plate."""
    place = _place(plate, resting, conditioning)
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


def _place(
    plate: ForcePlate, resting: Bool[np.ndarray, " samples"], conditioning: ConditioningSettings
) -> Float[np.ndarray, "points 3"]:
    """The plate's corners, else where loads press on it if it is empty while it rests [m]."""
    if plate.corners_ground is not None and np.isfinite(plate.corners_ground).all():
        return plate.corners_ground
    force = plate.force_ground - np.median(plate.force_ground[resting], axis=0)
    moment = plate.moment_ground - np.median(plate.moment_ground[resting], axis=0)
    with np.errstate(invalid="ignore"):
        size = np.abs(force[:, 1])
        loaded = size > max(LOAD_N, UNTARED_SHARE * float(np.nanmax(size)))
    sign = np.sign(np.nansum(force[loaded, 1]))
    points = centre_of_pressure(sign * force[loaded], sign * moment[loaded], surface_of(plate, conditioning))
    return points[np.isfinite(points).all(axis=1)]


def _returned_to(
    vertical: Float[np.ndarray, " samples"],
    resting: Bool[np.ndarray, " samples"],
    rate: float,
    settings: PlateSignSettings,
    conditioning: ConditioningSettings,
) -> bool:
    """Whether these rests lie between loads, agree, and are the least that the plate bears."""
    rests = [(a, b) for a, b in runs(resting) if b - a >= settings.rest_s * rate]
    if len(rests) < FEWEST_RETURNS:
        return False
    levels = np.array([np.median(vertical[a:b]) for a, b in rests])
    away = vertical[np.isfinite(vertical)] - np.median(vertical[resting])
    side = np.sign(away[np.argmax(np.abs(away))])
    one_sided = (side * away > -2 * conditioning.zero_noise_N).mean() >= OFTEN
    little = np.abs(away) <= conditioning.zero_largest_N
    flat = resting.sum() >= conditioning.zero_flat_share * little.sum()
    loads = sum(
        np.nanmax(np.abs(vertical[a:b] - level), initial=0.0) > LOAD_N
        for (_, a), (b, _), level in zip(rests, rests[1:], levels, strict=False)
    )
    agree = np.abs(levels - np.median(levels)) <= conditioning.zero_drift_N
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
