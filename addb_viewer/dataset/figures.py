"""Figures of a trial or a segment, over its frames on the release's grid."""

from typing import Any

import numpy as np
from jaxtyping import Float

from addb_viewer.dataset.gridded_trial import GriddedTrial
from addb_viewer.dataset.segments import Segment
from solver.common.gravity import GRAVITY
from solver.dynamics.thresholds import Figures, Thresholds, verdicts

Row = dict[str, Any]  # a row of a table: value by column, None for null


def measures(gridded: GriddedTrial, rows: Segment, mass_kg: float, height_m: float) -> Row:
    """Marker errors over all frames; residuals over those that are `used`.

    Args:
        gridded: the trial.
        rows: its frames that are meant.
        mass_kg: fitted.
        height_m: of the person.
    """
    dynamics = gridded.trial.dynamics
    assert dynamics is not None
    distance = gridded.trial.marker_errors.distance[rows.rows]
    seen = distance[np.isfinite(distance)]
    residual = dynamics.residual_root[rows.rows][dynamics.used[rows.rows]]
    weight = mass_kg * GRAVITY
    return {
        "marker_rms_m": _rms(seen) if len(seen) else None,
        "marker_max_m": float(seen.max()) if len(seen) else None,
        "linear_rms_bw": _rms_norm(residual[:, :3], weight),
        "angular_rms_bwh": _rms_norm(residual[:, 3:], weight * height_m),
    }


def verdicts_of(row: Row) -> dict[str, bool | None]:
    """Which limits the residuals keep: linear, angular, and both as the dataset paper has them.

    Args:
        row: of `measures`.
    """
    told = verdicts(Figures(row["linear_rms_bw"], row["angular_rms_bwh"], None, None), Thresholds())
    linear, angular, paper = told["linear"], told["angular"], told["angular_paper"]
    unknown = linear is None or angular is None
    return {
        "linear": linear,
        "angular": angular,
        "hicks": None if unknown else bool(linear and angular),
        "paper": None if unknown else bool(linear and paper),
    }


def phase_shares(gridded: GriddedTrial, rows: Segment, right: int) -> Row:
    """Shares of the counting frames with no foot on a plate, one, or both; None without such frames.

    Args:
        gridded: the trial.
        rows: its frames that are meant.
        right: column of the right foot.
    """
    contacts = gridded.trial.contacts
    assert contacts is not None
    on_plate = contacts.in_contact[rows.rows][gridded.verdicts.counts[rows.rows]]
    names = ("flight_share", "single_right_share", "single_left_share", "double_share")
    if not len(on_plate):
        return dict.fromkeys(names)
    number = on_plate[:, right].astype(int) + 2 * on_plate[:, 1 - right].astype(int)
    return dict(zip(names, (np.bincount(number, minlength=4) / len(number)).tolist(), strict=True))


def held_out(gridded: GriddedTrial) -> Row:
    """Residuals on held-out blocks, RMS; None where none was held out."""
    found = gridded.trial.held_out
    if found is None or not found.frames.any():
        return {"held_out_linear_rms_N": None, "held_out_angular_rms_Nm": None}
    missed: Float[np.ndarray, "frames 6"] = found.residual_root[found.frames]
    return {
        "held_out_linear_rms_N": _rms_norm(missed[:, :3], 1.0),
        "held_out_angular_rms_Nm": _rms_norm(missed[:, 3:], 1.0),
    }


def _rms(values: Float[np.ndarray, " n"]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _rms_norm(vectors: Float[np.ndarray, "n 3"], unit: float) -> float | None:
    return _rms(np.linalg.norm(vectors, axis=1)) / unit if len(vectors) else None
