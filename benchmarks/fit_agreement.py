"""How far two fits of one recording lie apart: angles between segments, and joint centres."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from benchmarks.anatomical_angles import anatomical_angles, landmark_places, landmarks_of
from benchmarks.functional_centres import off_turning_point
from benchmarks.leg_joints import JOINTS, joint_centres, segments
from solver.fit import Fit
from solver.skeleton.forward import body_poses

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
    angles, offset_free = {}, {}
    for name in JOINTS:
        difference = [
            np.degrees(_turned(_sagittal(alone, name, s) - _sagittal(with_model, name, s))) for s in "rl"
        ]
        angles[name] = rms(np.concatenate(difference))
        offset_free[name] = rms(np.concatenate([d - d.mean() for d in difference]))
    centres = {}
    ours, theirs = ([joint_centres(fit, side) for side in "rl"] for fit in (alone, with_model))
    for joint in JOINTS:
        apart = [a[joint] - b[joint] for a, b in zip(ours, theirs, strict=True)]
        centres[joint] = rms(np.linalg.norm(np.concatenate(apart), axis=1))
    return Agreement(
        angles,
        offset_free,
        _anatomical(alone, with_model, renamed),
        centres,
        {joint: _off_turning_point(alone, with_model, joint) for joint in JOINTS},
        *_marker_figures(alone),
    )


def _anatomical(alone: Fit, with_model: Fit, renamed: Mapping[str, str] | None) -> dict[str, float | None]:
    """RMS difference of each angle, by the landmarks that both fits use [°]."""
    labels = landmarks_of(with_model)
    theirs = landmark_places(with_model, labels)
    ours = landmark_places(
        alone, labels if renamed is None else {mark: renamed[label] for mark, label in labels.items()}
    )
    shared = ours.keys() & theirs.keys()
    apart: dict[str, list[np.ndarray]] = {name: [] for name in JOINTS}
    for side in "rl":
        a, b = (
            anatomical_angles({m: places[m] for m in shared}, joint_centres(fit, side), side)
            for fit, places in ((alone, ours), (with_model, theirs))
        )
        for name in JOINTS:
            if a[name] is not None and b[name] is not None:
                apart[name].append(np.degrees(_turned(a[name] - b[name])))
    return {name: rms(np.concatenate(found)) if found else None for name, found in apart.items()}


def _off_turning_point(alone: Fit, with_model: Fit, joint: str) -> tuple[float, float] | None:
    """RMS over the sides of how far each fit lies from the raw markers' turning point [m]."""
    sides = [off_turning_point((alone, with_model), with_model, joint, side) for side in "rl"]
    told = np.array([pair for pair in sides if pair is not None])
    return (rms(told[:, 0]), rms(told[:, 1])) if len(told) else None


def _marker_figures(fit: Fit) -> tuple[int, float]:
    errors = marker_distances(fit)
    return int(np.isfinite(errors).any(axis=0).sum()), float(np.sqrt(np.nanmean(errors**2)))


def marker_distances(fit: Fit) -> Float[np.ndarray, "frames markers"]:
    """Distance of each shared marker of the first trial from the model's [m]."""
    assert fit.groundwork is not None
    trial, match = fit.trials[0], fit.groundwork.match
    apart = trial.model_markers_ground - match.observed(trial.capture.markers)
    return np.linalg.norm(apart, axis=2)


def _sagittal(fit: Fit, joint: str, side: str) -> Float[np.ndarray, " frames"]:
    """Angle [rad] of a joint in the sagittal plane of the segment before it.

    Of the segments, not a coordinate of the model: models turn ankles about different axes, and where one has
    a subtalar joint, another one has locked it.
    """
    before, behind = (fit.skeleton.body_index(name) for name in segments(joint, side))
    R, _ = body_poses(fit.skeleton, fit.trials[0].motion.q)
    direction = np.einsum("tji,tj->ti", R[:, before], R[:, behind, :, POINTING[joint]])
    return np.arctan2(direction[:, 1], direction[:, 0])


def _turned(angle: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """Within half a turn [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))
