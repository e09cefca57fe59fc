"""Causes seen in the markers: where each marker lies against the place that all others give it.

A marker that slips drags the fitted pose along and its neighbours seem to move. What remains of the errors
when every change of pose is taken out, P e with P = W − W J (Jᵀ W J)⁻¹ Jᵀ W, is free of that: (P e)_m,
divided by the block P_mm, is the marker's distance from where the others alone would put it, in the axes of
its segment (leave-one-out residual of linear least squares). W allows for soft tissue that moves a segment's
markers together.

These causes are looked for before the wrench balance: the markers are repaired and the pose is fitted again.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float

from solver.common.one_thread import one_thread
from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.causes.observed_trial import Scene
from solver.skeleton.forward import ForwardKinematics, marker_jacobian

CHUNK = 64  # frames whose Jacobians are held at once
TRUSTED_M = 0.04  # a marker this far off counts half
FEWEST_SEEN = 0.5  # share of markers on a frame: with fewer the pose is too loose to judge one
RESOLVED_M = 0.001  # changes below are within what cameras and filters do
# of a marker within a tenth or two of a second, against the priors of how soft tissue moves it
NOISE_M = 0.003
SHIFT_STD_M = 0.03  # prior of how far a marker slips
PULL = 1e-4  # on what no marker sees, in squares of a marker's own weight per rad or m

Places = Float[np.ndarray, "frames markers 3"]  # [m], NaN where unseen


@dataclass(frozen=True, eq=False)
class MarkerFinding(ABC):
    """A cause found in one trial's markers, and how to undo it."""

    target: str
    parameters: Mapping[str, Estimate]
    frames: Range
    gain: float  # in log likelihood of the markers' errors, less what the search over places and times costs

    about: ClassVar[About] = About("")
    of_the_body = False  # the same in all trials of the person, and named once

    @property
    def id(self) -> str:
        """Of the catalogue."""
        return self.about.id

    @abstractmethod
    def repair(self, observed_ground: Places) -> Places:
        """The markers as recorded without it [m]; in the model's order, NaN where unseen.

        Args:
            observed_ground: of the trial and the model in which the cause was found [m].
        """


@dataclass(frozen=True, eq=False)
class PoseFree:
    """Marker errors without what a change of pose can explain.

    Errors are against each marker's usual place (its median in the segment's frame). Weights are relative
    to that of a marker alone: an information of 1 is a marker whose segment is fixed by others.
    """

    seen: Bool[np.ndarray, "frames markers"]
    score_body: Float[np.ndarray, "frames markers 3"]  # P e [m]
    information_body: Float[np.ndarray, "frames markers 3 3"]  # P_mm


@dataclass(frozen=True, eq=False)
class ProjectedChunk:
    """Some frames with every change of pose taken out: P = W − W J (Jᵀ W J)⁻¹ Jᵀ W."""

    frames: slice
    W: Float[np.ndarray, "some markers markers"]
    WJ: Float[np.ndarray, "some markers 3 dofs"]
    halves: Float[np.ndarray, "some markers 3 dofs"]  # W J (Jᵀ W J)⁻¹
    score_body: Float[np.ndarray, "some markers 3"]  # P e [m]


def pose_free(scene: Scene, soft_tissue: float) -> PoseFree:
    """Take all poses out of a trial's marker errors.

    Args:
        scene: with the motion that the markers tell.
        soft_tissue: how far a segment's markers move together, against how far each moves for itself.
    """
    count = len(scene.markers.names)
    score, information = np.zeros((scene.frames, count, 3)), np.zeros((scene.frames, count, 3, 3))
    for chunk in projected_chunks(scene, soft_tissue):
        score[chunk.frames] = chunk.score_body
        lone = np.einsum("tmm->tm", chunk.W)[..., None, None] * np.eye(3)
        information[chunk.frames] = lone - np.einsum("tmid,tmjd->tmij", chunk.halves, chunk.WJ)
    return PoseFree(np.isfinite(scene.markers.observed_ground).all(axis=2), score, information)


def projected_chunks(scene: Scene, soft_tissue: float) -> Iterator[ProjectedChunk]:
    """A trial's marker errors without its poses, some frames at a time; arguments as in `pose_free`."""
    markers, kinematics = scene.markers, ForwardKinematics(scene.skeleton)
    seen = np.isfinite(markers.observed_ground).all(axis=2)
    R = scene.R_ground_body[:, markers.body]
    error = _usual_place_removed(scene, seen, R)
    trust = seen / (1 + (error**2).sum(axis=2) / TRUSTED_M**2)
    of_body = (markers.body[:, None] == np.unique(markers.body)).astype(float)
    count = len(markers.names)
    with one_thread():
        for low in range(0, scene.frames, CHUNK):
            own = slice(low, min(scene.frames, low + CHUNK))
            poses = kinematics.poses(scene.motion.q[own])
            x = kinematics.markers(poses)
            J = marker_jacobian(kinematics, poses, x).reshape(len(x), count, 3, -1)
            J = R[own].transpose(0, 1, 3, 2) @ J
            W = _weights(trust[own], of_body, soft_tissue)
            score, WJ, halves = _projected(W, J, error[own])
            yield ProjectedChunk(own, W, WJ, halves, score)


def near_angles(scene: Scene, body: int) -> Float[np.ndarray, "frames angles"]:
    """Angles of a body's own joint and of those that hang on it, less their means [rad]; not the root's."""
    skeleton = scene.skeleton
    near = [skeleton.joints[body], *(j for j in skeleton.joints if j.parent == body)]
    names = [a.coordinate for j in near if j.parent >= 0 for a in j.axes if a.kind == "rotation"]
    columns = [skeleton.dofs.index(n) for n in dict.fromkeys(names) if n in skeleton.dofs]
    q = scene.motion.q[:, columns]
    return q - q.mean(axis=0)


def seen_share(scene: Scene) -> Float[np.ndarray, " frames"]:
    """Share of the recording's markers that each frame shows."""
    seen = np.isfinite(scene.markers.observed_ground).all(axis=2)
    used = seen.any(axis=0)
    return seen[:, used].mean(axis=1) if used.any() else np.zeros(scene.frames)


def _usual_place_removed(
    scene: Scene, seen: Bool[np.ndarray, "frames markers"], R: Float[np.ndarray, "frames markers 3 3"]
) -> Float[np.ndarray, "frames markers 3"]:
    markers = scene.markers
    error = np.where(seen[..., None], markers.observed_ground - markers.model_ground, 0.0)
    error = np.einsum("tmji,tmj->tmi", R, error)
    for m in np.flatnonzero(seen.any(axis=0)):
        error[seen[:, m], m] -= np.median(error[seen[:, m], m], axis=0)
    return error


def _weights(
    trust: Float[np.ndarray, "some markers"],
    of_body: Float[np.ndarray, "markers segments"],
    soft_tissue: float,
) -> Float[np.ndarray, "some markers markers"]:
    """Inverse of diag(1/trust) + soft_tissue² 11ᵀ within segments (Woodbury)."""
    spread = trust[:, :, None] * of_body
    inner = 1 / (soft_tissue**-2 + spread.sum(axis=1))
    return trust[:, :, None] * np.eye(trust.shape[1]) - (spread * inner[:, None]) @ spread.transpose(0, 2, 1)


def _projected(
    W: Float[np.ndarray, "some markers markers"],
    J: Float[np.ndarray, "some markers 3 dofs"],
    error: Float[np.ndarray, "some markers 3"],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """P e, W J and W J (Jᵀ W J)⁻¹."""
    some, count, _, dofs = J.shape
    WJ = (W @ J.reshape(some, count, 3 * dofs)).reshape(J.shape)
    H = J.reshape(some, -1, dofs).transpose(0, 2, 1) @ WJ.reshape(some, -1, dofs)
    H[:, np.arange(dofs), np.arange(dofs)] += PULL
    halves = (WJ.reshape(some, -1, dofs) @ np.linalg.inv(H)).reshape(J.shape)
    We = W @ error
    g = J.reshape(some, -1, dofs).transpose(0, 2, 1) @ We.reshape(some, -1, 1)
    score = We - (halves.reshape(some, -1, dofs) @ g).reshape(some, count, 3)
    return score, WJ, halves
