"""How far two fits of one recording lie apart: angles between segments, and joint centres."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from benchmarks.anatomical_angles import anatomical_angles, landmark_places
from benchmarks.functional_centres import off_turning_point
from benchmarks.labels_of_fit import raw_columns, understood_labels
from benchmarks.leg_joints import JOINTS, PosedFit, posed
from solver.fitting.fit import Fit
from solver.markers.understanding import UnderstoodLabel

POINTING = {"hip": 1, "knee": 1, "ankle": 0}  # axis of the bone behind: thigh and shank down, feet forwards


@dataclass(frozen=True)
class Agreement:
    """A fit without the model's markers against the model's own; left and right together."""

    angle_rms_deg: dict[str, float]  # between the models' bone frames, in the sagittal plane
    angle_rms_without_offset_deg: dict[str, float]  # each side's mean difference taken off
    anatomical_rms_deg: dict[str, float | None]  # between axes by landmarks; None where these are not marked
    centre_rms_m: dict[str, float]
    off_turning_point_m: dict[str, tuple[float, float] | None]  # fit without, model's fit; None: not told
    markers_used: int
    marker_rms_m: float


def compared(alone: Fit, with_model: Fit, renamed: Mapping[str, str] | None = None) -> Agreement:
    """How far a fit without the model's markers is from the model's own.

    Args:
        alone: without the model, or without its markers.
        with_model: the model's own.
        renamed: what each label is called in the fit without; None if as ever.
    """
    ours, theirs = posed(alone), posed(with_model)
    rows = understood_labels(with_model)
    angles, offset_free, centres = {}, {}, {}
    for joint in JOINTS:
        turned = [
            np.degrees(_turned(_sagittal(ours, joint, side) - _sagittal(theirs, joint, side)))
            for side in "rl"
        ]
        angles[joint] = rms(np.concatenate(turned))
        offset_free[joint] = rms(np.concatenate([d - d.mean() for d in turned]))
        apart = [ours.joint_centres(side)[joint] - theirs.joint_centres(side)[joint] for side in "rl"]
        centres[joint] = rms(np.linalg.norm(np.concatenate(apart), axis=1))
    return Agreement(
        angles,
        offset_free,
        _anatomical(ours, theirs, rows, renamed),
        centres,
        _off_turning_points(ours, theirs, rows),
        *_marker_figures(alone),
    )


def _anatomical(
    ours: PosedFit, theirs: PosedFit, rows: Sequence[UnderstoodLabel], renamed: Mapping[str, str] | None
) -> dict[str, float | None]:
    """RMS difference of each angle, by the landmarks that both fits use [°]."""
    labels = {row.landmark: row.label for row in rows if row.landmark is not None and row.used}
    called = labels if renamed is None else {mark: renamed[label] for mark, label in labels.items()}
    places = landmark_places(ours.fit, called), landmark_places(theirs.fit, labels)
    shared = places[0].keys() & places[1].keys()
    apart: dict[str, list[np.ndarray]] = {joint: [] for joint in JOINTS}
    for side in "rl":
        a, b = (
            anatomical_angles({m: marks[m] for m in shared}, fit.joint_centres(side), side)
            for fit, marks in zip((ours, theirs), places, strict=True)
        )
        for joint in JOINTS:
            if a[joint] is not None and b[joint] is not None:
                apart[joint].append(np.degrees(_turned(a[joint] - b[joint])))
    return {joint: rms(np.concatenate(found)) if found else None for joint, found in apart.items()}


def _off_turning_points(
    ours: PosedFit, theirs: PosedFit, rows: Sequence[UnderstoodLabel]
) -> dict[str, tuple[float, float] | None]:
    """RMS over the sides of how far each fit lies from the raw markers' turning points [m]."""
    markers, columns = theirs.fit.trials[0].capture.markers, raw_columns(theirs.fit, rows)
    found: dict[str, tuple[float, float] | None] = {}
    for joint in JOINTS:
        sides = [off_turning_point((ours, theirs), markers, columns, joint, side) for side in "rl"]
        told = np.array([pair for pair in sides if pair is not None])
        found[joint] = (rms(told[:, 0]), rms(told[:, 1])) if len(told) else None
    return found


def _marker_figures(fit: Fit) -> tuple[int, float]:
    errors = marker_distances(fit)
    return int(np.isfinite(errors).any(axis=0).sum()), float(np.sqrt(np.nanmean(errors**2)))


def marker_distances(fit: Fit) -> Float[np.ndarray, "frames markers"]:
    """Distance of each shared marker of the first trial from the model's [m]."""
    assert fit.groundwork is not None
    trial, match = fit.trials[0], fit.groundwork.match
    apart = trial.model_markers_ground - match.observed(trial.capture.markers)
    return np.linalg.norm(apart, axis=2)


def _sagittal(fit: PosedFit, joint: str, side: str) -> Float[np.ndarray, " frames"]:
    """Angle [rad] of a joint in the sagittal plane of the segment before it.

    Of the segments, not a coordinate of the model: models turn ankles about different axes, and where one has
    a subtalar joint, another one has locked it.
    """
    (R_before, _), (R_behind, _) = fit.segments(joint, side)
    direction = np.einsum("tji,tj->ti", R_before, R_behind[:, :, POINTING[joint]])
    return np.arctan2(direction[:, 1], direction[:, 0])


def _turned(angle: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """Within half a turn [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))
