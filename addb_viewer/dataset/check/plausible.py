"""Values that bodies and plates do not have: what to look at before a release goes out."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pyarrow as pa
from jaxtyping import Bool, Float

from addb_viewer.dataset.check.finding import Finding, warning
from addb_viewer.dataset.check.physics import column, vector
from addb_viewer.dataset.frame_columns import COORDINATE_NAMES, TRANSLATIONS
from solver.common.runs import runs

RANGES = {
    "age_years": (2.0, 110.0),
    "height_m": (0.7, 2.3),
    "mass_kg": (8.0, 250.0),
    "bmi": (10.0, 60.0),
}
MASS_SHARE = 0.02  # by which the fitted mass may differ from what plates carry
WORST_MARKERS_M = 0.04  # RMS of a trial; Hicks et al. 2015 ask for 0.02, their largest for 0.04
FASTEST_RAD_S = 50.0  # of a joint; knees of sprinters reach 25
FARTHEST_M = 0.35  # of a centre of pressure from the foot body's origin, which is the heel
LOADED_N = 100.0
FROZEN_S = 0.1  # that a centre of pressure stays the very same under load
STILL_M = 0.005  # that the foot goes meanwhile: a standing person's centre of pressure is never the very same


def subject_findings(subject: Mapping[str, Any]) -> Iterator[Finding]:
    """Age, stature and mass.

    Args:
        subject: its row.
    """
    where = str(subject["subject_id"])
    for name, (low, high) in RANGES.items():
        value = subject[name]
        if value is not None and not low <= value <= high:
            yield warning("plausible", where, f"{name} is {value:g}, expected {low:g} to {high:g}")
    carried = subject["mass_from_forces_kg"]
    if carried is not None and abs(subject["mass_kg"] / carried - 1) > MASS_SHARE:
        yield warning(
            "plausible",
            where,
            f"its mass is {subject['mass_kg']:.1f} kg, the plates carry {carried:.1f} kg",
        )


def frame_findings(frames: pa.Table) -> Iterator[Finding]:
    """Markers, speeds of joints, and what feet and plates say of each other.

    Args:
        frames: of one trial.
    """
    trial = str(frames["trial_id"][0])
    off = column(frames, "marker_rms_m")
    off = off[np.isfinite(off)]
    if len(off) and (rms := float(np.sqrt(np.mean(off**2)))) > WORST_MARKERS_M:
        yield warning("plausible", trial, f"markers are {100 * rms:.1f} cm off the skeleton, RMS")
    for name in COORDINATE_NAMES:
        speed = np.abs(column(frames, f"qd_{name}"))
        if name not in TRANSLATIONS and (speed > FASTEST_RAD_S).any():
            yield warning("plausible", trial, f"{name} turns at {np.nanmax(speed):.0f} rad/s")
    for side, words in (("r", "right"), ("l", "left")):
        yield from _foot_findings(frames, side, f"the {words} foot", trial)


def _foot_findings(frames: pa.Table, side: str, foot: str, trial: str) -> Iterator[Finding]:
    force = vector(frames, f"grf_{side}_{{}}_N")
    cop, origin = vector(frames, f"cop_{side}_{{}}_m"), vector(frames, f"foot_{side}_{{}}_m")
    loaded = np.nan_to_num(force[:, 1]) > LOADED_N
    away = np.linalg.norm((cop - origin)[:, [0, 2]], axis=1)
    far = loaded & (away > FARTHEST_M)
    if far.any():
        yield warning(
            "plausible",
            trial,
            f"the centre of pressure of {foot} is up to {np.nanmax(away[far]):.2f} m from its heel "
            f"on {far.sum()} frames",
        )
    rate = _rate(frames)
    for start, end in _frozen(cop, loaded, round(FROZEN_S * rate)):
        if np.linalg.norm(np.ptp(origin[start:end], axis=0)) > STILL_M:
            frame = frames["frame"][start].as_py()
            yield warning(
                "plausible", trial, f"the centre of pressure of {foot} stands still from frame {frame} on"
            )
            break
    for end, before, words in ((0, 1, "first"), (-1, -2, "last")):
        if frames.num_rows > 1 and not force[end].any() and loaded[before]:
            said = f"the force of {foot} is zero on the {words} frame, beside a loaded one"
            yield warning("plausible", trial, said)


def _frozen(
    cop: Float[np.ndarray, "rows 3"], loaded: Bool[np.ndarray, " rows"], least: int
) -> list[tuple[int, int]]:
    """Ranges of rows on which a loaded centre of pressure is the very same."""
    same = np.zeros(len(cop), dtype=bool)
    same[1:] = (np.diff(cop, axis=0) == 0).all(axis=1) & loaded[1:] & loaded[:-1]
    return [(start - 1, end) for start, end in runs(same) if end - start + 1 > least]


def _rate(frames: pa.Table) -> float:
    times = column(frames, "time_s")
    return float(1 / np.median(np.diff(times))) if len(times) > 1 else 1.0
