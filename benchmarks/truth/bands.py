"""Whether bands hold what they promise, by recordings whose truth is known."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.truth.ways import TimeHistory
from solver.common.filters import low_pass
from solver.dynamics.dynamics import TrialStd
from solver.dynamics.trajectory.uncertainty import FASTEST_HZ

ENDS_S = 0.1  # at both ends of a trial: filters and splines know no motion beyond
SIDES_SD = 1.96  # of a 95 % band
KINDS = ("angle", "speed", "torque")


def band_figures(
    std: TrialStd | None,
    dofs: Sequence[str],
    ours: TimeHistory,
    truth: TimeHistory,
    counts: Bool[np.ndarray, " frames"],
) -> dict[str, dict[str, list[float]]]:
    """By kind and joint: share of frames whose band holds the truth; the band's half width over the error.

    The error is that which 95 % of the frames stay below. The root's joint is left out.

    Args:
        std: of the fit; None: there are no bands.
        dofs: of the fit's skeleton.
        ours: the fit's.
        truth: on the same frames.
        counts: frames on which torques are compared.
    """
    if std is None:
        return {}
    found: dict[str, dict[str, list[float]]] = {}
    for kind in KINDS:
        errors, half = errors_of(ours, truth, kind), SIDES_SD * getattr(std, kind)
        found[kind] = {}
        for name in (d for d in truth.dofs if d in dofs and d in errors):
            width = half[:, dofs.index(name)]
            on = (
                np.isfinite(width)
                & inner(len(truth.angle), truth.rate)
                & (counts if kind == "torque" else True)
            )
            if on.sum() > 2:
                error = errors[name][on]
                largest = max(float(np.quantile(error, 0.95)), 1e-9)
                found[kind][name] = [float((error < width[on]).mean()), float(width[on].mean() / largest)]
    return found


def errors_of(ours: TimeHistory, truth: TimeHistory, kind: str) -> dict[str, Float[np.ndarray, " frames"]]:
    """By joint, sizes of the errors below `FASTEST_HZ`; of angles about their mean."""
    own, true = getattr(ours, kind), getattr(truth, kind)
    errors = {}
    for name in set(ours.dofs) & set(truth.dofs):
        error = own[:, ours.dofs.index(name)] - true[:, truth.dofs.index(name)]
        if not name.startswith("pelvis") and np.isfinite(error).all():
            error = low_pass(error[:, None], ours.rate, FASTEST_HZ)[:, 0]
            errors[name] = np.abs(error - error.mean() if kind == "angle" else error)
    return errors


def inner(frames: int, rate: float) -> Bool[np.ndarray, " frames"]:
    """Frames away from the ends of a trial."""
    cut = round(ENDS_S * rate)
    kept = np.zeros(frames, dtype=bool)
    kept[cut : frames - cut] = True
    return kept
