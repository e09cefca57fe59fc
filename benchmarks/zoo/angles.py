"""Angles and moments that a file carries itself, beside those of a fit; signs and offsets are conventions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import ezc3d
import numpy as np

from addb_viewer.api.fitted_trial import FittedTrial

LEAST_RANGE_DEG = 15.0  # what moves by less is mostly noise and convention
FEWEST = 20
COORDINATES = {
    "HipAngles": "hip_flexion",
    "KneeAngles": "knee_angle",
    "AnkleAngles": "ankle_angle",
    "ElbowAngles": "elbow_flex",
}
SIDES = {"L": "l", "R": "r"}


@dataclass(frozen=True)
class Agreement:
    """A coordinate of a fit against an output of the file."""

    coordinate: str
    follows: float  # correlation, whatever the sign
    off_deg: float  # RMS of the difference, less its mean
    words: str


def agreement(file: Path, trial: FittedTrial, outputs: Sequence[str]) -> Iterator[Agreement]:
    """Sagittal angles of both sides that move enough.

    Args:
        file: C3D with model outputs among its points; its frames are those of the trial.
        trial: fitted.
        outputs: names of outputs without their side, as "KneeAngles".
    """
    contents = ezc3d.c3d(str(file))
    points = contents["data"]["points"]
    labels = [label.split(":")[-1] for label in contents["parameters"]["POINT"]["LABELS"]["value"]]
    for output in outputs:
        for side, ending in SIDES.items():
            coordinate = f"{COORDINATES[output]}_{ending}"
            if f"{side}{output}" not in labels or coordinate not in trial.coordinates.names:
                continue
            theirs = points[0, labels.index(f"{side}{output}")].astype(float)
            theirs[theirs == 0.0] = np.nan
            ours = np.degrees(trial.coordinates[coordinate])
            found = _compared(ours, theirs)
            if found is not None:
                r, off = found
                yield Agreement(coordinate, r, off, f"{trial.name} {coordinate} r {r:.2f}, {off:.1f}°")


def included_agreement(
    q: np.ndarray, first: np.ndarray, middle: np.ndarray, last: np.ndarray
) -> float | None:
    """Correlation of a flexion with the angle that three markers include; None where it moves too little.

    Args:
        q: [frames] [rad] grows as the limb bends.
        first, middle, last: [frames, 3] [m].
    """
    a, b = first - middle, last - middle
    cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    bent = 180.0 - np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    known = np.isfinite(q) & np.isfinite(bent)
    if known.sum() < FEWEST or np.ptp(bent[known]) < LEAST_RANGE_DEG:
        return None
    return float(np.corrcoef(np.degrees(q[known]), bent[known])[0, 1])


def _compared(ours: np.ndarray, theirs: np.ndarray) -> tuple[float, float] | None:
    if len(ours) != len(theirs):
        return None
    known = np.isfinite(ours) & np.isfinite(theirs)
    if known.sum() < FEWEST or np.ptp(theirs[known]) < LEAST_RANGE_DEG:
        return None
    r = float(np.corrcoef(ours[known], theirs[known])[0, 1])
    off = ours[known] - np.sign(r) * theirs[known]
    return abs(r), float(np.std(off))
