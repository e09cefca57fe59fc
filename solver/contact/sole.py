"""Where the soles are: flat outlines fixed to the foot's bodies, from joint centres alone.

The skeleton's neutral pose gives up and forward; the ankle and the ball of the foot give the length. Neither
bones nor shoes are needed to say which foot stands under a centre of pressure, to a centimetre or two.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

# Shares of an adult foot's length, from its heel: Winter (2009), fig. 4.1 (foot length 0.152, breadth 0.055,
# ankle height 0.039 of stature); the depth holds a centimetre of shoe.
ANKLE = 0.25
BALL = 0.71
DEPTH_BELOW_ANKLE = 0.30
REAR_OUTLINE = ((0.0, 0.07), (0.08, 0.12), (BALL, 0.19))  # (from the heel, half the width)
FRONT_OUTLINE = ((BALL, 0.19), (0.90, 0.15), (1.0, 0.06))
MASS_CENTRE = 0.44  # de Leva (1996), table 4
FORWARD_MARKER = 0.75  # a foot's foremost marker sits about the metatarsal heads

ANKLE_REACH_M = 0.15  # joints of the hind foot lie this near to the foot's origin; the knee does not
SHORTEST_LEVER_M = 0.03  # from the ankle to whatever tells where the toes are
HEIGHT_SLACK_M = 0.04  # the same ankle is 7 cm above the ground barefoot and 10 cm in running shoes


@dataclass(frozen=True)
class SolePart:
    """One rigid piece of a sole: a convex polygon in its body's frame, anticlockwise seen from above."""

    body: int
    corners_body: Float[np.ndarray, "corners 3"]  # [m]
    axes_body: Float[np.ndarray, "3 3"]  # rows: forward, to the left, up

    def distance(self, point_body: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, " frames"]:
        """Distance of points in the body's frame from the polygon [m]; no height below the slack counts."""
        flat = (point_body - self.corners_body[0]) @ self.axes_body.T
        height, point = flat[:, 2], flat[:, :2]
        start = ((self.corners_body - self.corners_body[0]) @ self.axes_body.T)[:, :2]
        edge = np.roll(start, -1, axis=0) - start
        offset = point[:, None] - start
        along = np.clip(np.sum(offset * edge, axis=2) / np.sum(edge**2, axis=1), 0.0, 1.0)
        to_edge = np.linalg.norm(offset - along[..., None] * edge, axis=2).min(axis=1)
        inside = (edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0] >= 0).all(axis=1)
        return np.hypot(np.where(inside, 0.0, to_edge), np.maximum(0.0, np.abs(height) - HEIGHT_SLACK_M))


@dataclass(frozen=True)
class Sole:
    """The sole of one foot: hind and mid foot, and the toes where they are a body of their own."""

    foot_body: str
    parts: tuple[SolePart, ...]

    def distance(
        self,
        R_ground_body: Float[np.ndarray, "frames bodies 3 3"],
        p_ground_body: Float[np.ndarray, "frames bodies 3"],
        point_ground: Float[np.ndarray, "frames 3"],
    ) -> Float[np.ndarray, " frames"]:
        """Distance of one point a frame (a centre of pressure) from the sole [m]; NaN stays NaN."""
        distances = []
        for part in self.parts:
            offset = point_ground - p_ground_body[:, part.body]
            distances.append(part.distance(np.einsum("tji,tj->ti", R_ground_body[:, part.body], offset)))
        return np.min(distances, axis=0)

    def middle(self, reach: float) -> "Sole":
        """Each piece drawn in towards its middle: where pressure is found, which spares a sole's rim.

        Args:
            reach: of the pieces' length and width; 1: all.
        """
        pieces = []
        for part in self.parts:
            centre = part.corners_body.mean(axis=0)
            pieces.append(replace(part, corners_body=centre + reach * (part.corners_body - centre)))
        return replace(self, parts=tuple(pieces))

    def corners_ground(
        self,
        R_ground_body: Float[np.ndarray, "frames bodies 3 3"],
        p_ground_body: Float[np.ndarray, "frames bodies 3"],
    ) -> Float[np.ndarray, "frames corners 3"]:
        """All corners of the outline in the ground frame [m]."""
        return np.concatenate(
            [
                np.einsum("tij,cj->tci", R_ground_body[:, part.body], part.corners_body)
                + p_ground_body[:, None, part.body]
                for part in self.parts
            ],
            axis=1,
        )


def soles(skeleton: Skeleton, foot_bodies: Sequence[str]) -> tuple[Sole, ...]:
    """The soles of the feet at the skeleton's scale.

    Args:
        skeleton: scaled.
        foot_bodies: a body for each foot, as the subject names them ("calcn_r").

    Raises:
        ModelError: no such body, or nothing tells where its toes are.
    """
    neutral = _NeutralPose(skeleton)
    return tuple(neutral.sole(name) for name in foot_bodies)


def independent_feet(skeleton: Skeleton, foot_bodies: Sequence[str]) -> tuple[str, ...]:
    """The foot bodies without those that hang on another one: toes are part of their foot's sole.

    Raises:
        ModelError: a name is no body of the model, or there is none.
    """
    missing = [name for name in foot_bodies if name not in skeleton.body_names]
    if missing or not foot_bodies:
        raise ModelError(
            f"{skeleton.name}: {'no body ' + ', '.join(missing) if missing else 'no foot bodies are named'}. "
            f"Name them with foot_bodies in subject.toml; bodies: {', '.join(skeleton.body_names)}."
        )
    indices = {skeleton.body_index(name): name for name in foot_bodies}
    return tuple(
        name for i, name in indices.items() if not any(p in indices for p in _ancestors(skeleton, i)[1:])
    )


class _NeutralPose:
    """The skeleton with every angle at zero, or as near to it as its range allows: upright, feet level."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        q = np.array([np.clip(0.0, *c.range) for c in skeleton.free_coordinates])
        R, p = body_poses(skeleton, q[None])
        self.R, self.p = R[0], p[0]
        self.up = -skeleton.gravity / np.linalg.norm(skeleton.gravity)

    def sole(self, foot_body: str) -> Sole:
        foot = self.skeleton.body_index(foot_body)
        ankle = self._ankle(foot)
        toes = self._toes(foot, ankle)
        forward, length = self._forward(foot, toes, ankle)
        axes = np.array([forward, np.cross(self.up, forward), self.up])
        heel = ankle - DEPTH_BELOW_ANKLE * length * self.up - ANKLE * length * forward
        if toes is None:
            return Sole(foot_body, (self._part(foot, REAR_OUTLINE + FRONT_OUTLINE[1:], heel, length, axes),))
        rear = self._part(foot, REAR_OUTLINE, heel, length, axes)
        return Sole(foot_body, (rear, self._part(toes, FRONT_OUTLINE, heel, length, axes)))

    def _part(
        self,
        body: int,
        outline: Sequence[tuple[float, float]],
        heel: Float[np.ndarray, "3"],
        length: float,
        axes: Float[np.ndarray, "3 3"],
    ) -> SolePart:
        right = [(x, -width) for x, width in outline]
        left = [(x, width) for x, width in reversed(outline)]
        corners = heel + length * np.array(right + left) @ axes[:2]
        return SolePart(body, (corners - self.p[body]) @ self.R[body], axes @ self.R[body])

    def _joint_centre(self, body: int) -> Float[np.ndarray, "3"]:
        return self.p[body] + self.R[body] @ self.skeleton.joints[body].p_child_frame

    def _ankle(self, foot: int) -> Float[np.ndarray, "3"]:
        """The most proximal joint centre near the foot: talus and heel bone may be two bodies."""
        chain = _ancestors(self.skeleton, foot)
        centres = [self._joint_centre(i) for i in chain if self.skeleton.joints[i].parent >= 0]
        near = [c for c in centres if np.linalg.norm(c - self.p[foot]) < ANKLE_REACH_M]
        return near[-1] if near else self.p[foot]

    def _toes(self, foot: int, ankle: Float[np.ndarray, "3"]) -> int | None:
        children = [i for i, joint in enumerate(self.skeleton.joints) if joint.parent == foot]
        levers = {i: np.linalg.norm(self._level(self._joint_centre(i) - ankle)) for i in children}
        farthest = max(levers, key=lambda i: levers[i], default=None)
        return farthest if farthest is not None and levers[farthest] > SHORTEST_LEVER_M else None

    def _forward(
        self, foot: int, toes: int | None, ankle: Float[np.ndarray, "3"]
    ) -> tuple[Float[np.ndarray, "3"], float]:
        """The level direction from heel to toes, and the foot's length [m]."""
        if toes is not None:
            return _direction(self._level(self._joint_centre(toes) - ankle), BALL - ANKLE)
        markers = [self._in_ground(foot, m.position_body) for m in self.skeleton.markers if m.body == foot]
        ahead = [self._level(m - ankle) for m in markers]
        mass_centre = self._level(self._in_ground(foot, self.skeleton.bodies[foot].com_body) - ankle)
        if ahead and np.linalg.norm(mass_centre) > 0:
            ahead = [a for a in ahead if a @ mass_centre > 0]
        for lever, share in (
            (max(ahead, key=np.linalg.norm, default=np.zeros(3)), FORWARD_MARKER - ANKLE),
            (mass_centre, MASS_CENTRE - ANKLE),
        ):
            if np.linalg.norm(lever) > SHORTEST_LEVER_M:
                return _direction(lever, share)
        raise ModelError(
            f"{self.skeleton.name}: body '{self.skeleton.bodies[foot].name}' is no foot: it has no toes, and "
            "neither markers nor a mass centre ahead of its ankle. Name the foot bodies with foot_bodies in "
            "subject.toml."
        )

    def _in_ground(self, body: int, point_body: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        return self.p[body] + self.R[body] @ point_body

    def _level(self, vector: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        return vector - (vector @ self.up) * self.up


def _direction(lever: Float[np.ndarray, "3"], share: float) -> tuple[Float[np.ndarray, "3"], float]:
    distance = float(np.linalg.norm(lever))
    return lever / distance, distance / share


def _ancestors(skeleton: Skeleton, body: int) -> list[int]:
    """The body itself, its parent, and so on up to the root."""
    chain = [body]
    while skeleton.joints[chain[-1]].parent >= 0:
        chain.append(skeleton.joints[chain[-1]].parent)
    return chain
