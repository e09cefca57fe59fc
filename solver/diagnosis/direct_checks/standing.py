"""Standing on a plate: the point about which the load changes, and what stays without the changes.

While somebody stands, the load shifts to and fro between the feet. How the moment changes with the force
tells about which point, free of every constant; where the mean pressure lies elsewhere, a constant is in it.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.capture.capture import ForcePlate
from solver.capture.plates.centre_of_pressure import surface_of
from solver.common.runs import runs
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.pressing_feet import PressingFoot, pressing_feet
from solver.diagnosis.direct_checks.statement import About, Statement, nats_of

DIRECT_CHECK = "point of the changes"
LEAST_SHIFT_N = 10.0  # root mean square of what goes to and fro
STILL_M = 0.02  # by which a standing foot's middle moves, in all


def standing(trials: Sequence[Measured]) -> list[Statement]:
    """Each plate of each trial on which one foot stands still for long enough."""
    said = []
    for trial in trials:
        feet = pressing_feet(trial.capture.markers, trial.settings)
        for k, plate in enumerate(trial.capture.plates, start=1):
            found = _of_plate(trial, k, plate, feet)
            if found is not None:
                said.append(found)
    return said


def _of_plate(trial: Measured, k: int, plate: ForcePlate, feet: Sequence[PressingFoot]) -> Statement | None:
    settings, times = trial.settings, trial.capture.markers.times
    vertical = trial.vertical_N[:, k - 1]
    with np.errstate(invalid="ignore"):
        loaded = np.abs(vertical) > settings.loaded_N
    stretches = [r for r in runs(loaded) if (r[1] - r[0]) / trial.rate >= settings.standing_s]
    if not stretches or not feet:
        return None
    start, end = max(stretches, key=lambda r: r[1] - r[0])
    still = [f for f in feet if np.ptp(f.middle[start:end], axis=0).max() < STILL_M]
    if not still:
        return None
    height = float(surface_of(plate, trial.reading.conditioning).point_ground[1])
    wrench = _at_frames(plate, times[start:end])
    force, moment = wrench[:, :3], wrench[:, 3:]
    moment = moment - np.cross([0.0, height, 0.0], force)
    found = _point(force, moment, (end - start) / trial.rate)
    if found is None:
        return None
    point, std = found
    mean = np.array([moment[:, 2].mean(), -moment[:, 0].mean()]) / force[:, 1].mean()
    places = [f.middle[start:end].mean(axis=0) for f in still]
    foot = min(places, key=lambda p: float(np.linalg.norm(p - point)))
    off, constant = float(np.linalg.norm(point - foot)), float(np.linalg.norm(mean - point))
    return Statement(
        DIRECT_CHECK,
        f"The load on {plate.name} changes about a point {100 * off:.0f} ± {100 * std:.0f} cm from the "
        f"foot's middle, and its mean pressure lies {100 * constant:.0f} cm from there (normal: within 8).",
        {
            About.PLATE_PLACE: nats_of(off, std, settings.standing_scatter_m, settings.place_usual_m),
            About.PLATE_ZERO: nats_of(constant, std, settings.standing_scatter_m, settings.place_usual_m),
        },
        {"off_m": off, "constant_off_m": constant, "std_m": std},
        trial=trial.capture.name,
        target=f"plate_{k}",
    )


def _at_frames(plate: ForcePlate, times: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 6"]:
    both = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    known = np.isfinite(both).all(axis=1)
    return np.stack([np.interp(times, plate.times[known], column[known]) for column in both.T], axis=1)


def _point(
    force: Float[np.ndarray, "frames 3"], moment: Float[np.ndarray, "frames 3"], seconds: float
) -> tuple[Float[np.ndarray, "2"], float] | None:
    """Where the load changes, in x and z, and how well that is known [m]."""
    change = force[:, 1] - force[:, 1].mean()
    if change.std() < LEAST_SHIFT_N:
        return None
    point, rests = [], []
    for along in (moment[:, 2], -moment[:, 0]):
        rest = along - along.mean()
        slope = float(change @ rest / (change @ change))
        point.append(slope)
        rests.append(float((rest - slope * change).std()))
    independent = max(2.0, 2 * seconds)
    return np.array(point), float(np.linalg.norm(rests) / (change.std() * np.sqrt(independent)))
