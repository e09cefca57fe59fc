"""How far two fits of one recording lie apart: angles between segments, and joint centres."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.fit import Fit
from solver.skeleton.forward import body_poses

ANGLES = ("hip", "knee", "ankle")
# the bodies before and behind each joint, and the axis of the latter that turns in the sagittal plane of the
# former: bones point down, feet forwards
SEGMENTS = {"hip": ("pelvis", "femur", 1), "knee": ("femur", "tibia", 1), "ankle": ("tibia", "calcn", 0)}
JOINTS = {"hip": "femur", "knee": "tibia", "ankle": "talus"}


@dataclass(frozen=True)
class Agreement:
    """A fit without the model's markers against the model's own; left and right together."""

    angle_rms_deg: dict[str, float]  # between the segments, in the sagittal plane
    angle_rms_without_offset_deg: dict[str, float]  # each side's mean difference taken off
    centre_rms_m: dict[str, float]
    markers_used: int
    marker_rms_m: float


def compared(alone: Fit, with_model: Fit) -> Agreement:
    """How far a fit without the model's markers is from the model's own."""
    angles, offset_free = {}, {}
    for name in ANGLES:
        difference = [
            np.degrees(_turned(_sagittal(alone, name, s) - _sagittal(with_model, name, s))) for s in "rl"
        ]
        angles[name] = rms(np.concatenate(difference))
        offset_free[name] = rms(np.concatenate([d - d.mean() for d in difference]))
    centres = {}
    for joint, body in JOINTS.items():
        apart = [_origin(alone, f"{body}_{s}") - _origin(with_model, f"{body}_{s}") for s in "rl"]
        centres[joint] = rms(np.linalg.norm(np.concatenate(apart), axis=1))
    return Agreement(angles, offset_free, centres, *_marker_figures(alone))


def _marker_figures(fit: Fit) -> tuple[int, float]:
    errors = marker_errors(fit)
    return int(np.isfinite(errors).any(axis=0).sum()), float(np.sqrt(np.nanmean(errors**2)))


def marker_errors(fit: Fit) -> Float[np.ndarray, "frames markers"]:
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
    before, behind, axis = SEGMENTS[joint]
    R, _ = body_poses(fit.skeleton, fit.trials[0].motion.q)
    index = {name: i for i, name in enumerate(fit.skeleton.body_names)}
    parent = R[:, index.get(f"{before}_{side}", index.get(before, 0))]
    direction = np.einsum("tji,tj->ti", parent, R[:, index[f"{behind}_{side}"], :, axis])
    return np.arctan2(direction[:, 1], direction[:, 0])


def _turned(angle: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """Within half a turn [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _origin(fit: Fit, body: str) -> Float[np.ndarray, "frames 3"]:
    _, p = body_poses(fit.skeleton, fit.trials[0].motion.q)
    return p[:, fit.skeleton.body_index(body)]


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))
