"""Normal equations of weighted points on a tree of bodies, without any point's Jacobian.

A point x moves with X(x) S_k by the axis twist S_k = (ω, v about the ground origin), X(x) = [−[x]×, 1]. What
the points that two axes both carry add to JᵀWJ is S_kᵀ (Σ w X(x)ᵀ X(x)) S_l, and those are the points that
hang on the deeper axis: six by six numbers an axis, as composite rigid bodies have them (Featherstone 2008,
Rigid Body Dynamics Algorithms, section 6.2).
"""

import numpy as np
from jaxtyping import Float, Int

from solver.skeleton.forward import ForwardKinematics, Poses, cross


class SubtreeTerms:
    """The tree of one skeleton with its markers, or with other points on its bodies."""

    def __init__(
        self, kinematics: ForwardKinematics, point_bodies: Int[np.ndarray, " points"] | None = None
    ) -> None:
        """Lay out the tree.

        Args:
            kinematics: of the skeleton.
            point_bodies: index of the body under each point; None: under each marker.
        """
        chain = kinematics.chain
        pairs = list(dict.fromkeys(zip(chain.dof.tolist(), chain.body.tolist(), strict=True)))
        own: dict[int, int] = {}
        others: list[tuple[int, int]] = []
        for dof, body in pairs:
            if dof in own:
                others.append((dof, body))
            else:
                own[dof] = body
        columns = [(dof, own.get(dof, 0)) for dof in range(chain.dofs)] + others
        place = {pair: i for i, pair in enumerate(columns)}
        self.dofs, self.axes = chain.dofs, len(columns)
        self.extra_dof: Int[np.ndarray, " others"] = np.array([dof for dof, _ in others], dtype=int)
        self.column = np.array([place[p] for p in zip(chain.dof.tolist(), chain.body.tolist(), strict=True)])
        below = np.zeros((len(kinematics.skeleton.joints),) * 2, dtype=bool)  # whether a body carries another
        for body, joint in enumerate(kinematics.skeleton.joints):
            below[:, body] = below[:, joint.parent] if joint.parent >= 0 else False
            below[body, body] = True
        bodies = np.array([body for _, body in columns])
        under = kinematics.marker_bodies if point_bodies is None else point_bodies
        self.carried = below[bodies][:, under].astype(float)  # points by axis
        deeper = below[bodies][:, bodies].T.astype(float)  # [k, l]: k hangs on l, or is in the same joint
        same = bodies[:, None] == bodies
        self.at_or_below = deeper
        self.above = np.where(same, 0.0, deeper).T
        self.halved = np.where(same, 0.5, deeper)

    def twists(self, poses: Poses) -> Float[np.ndarray, "frames axes 6"]:
        """Of the axes, in the order of this tree."""
        by_position = poses.twists()
        if np.array_equal(self.column, np.arange(self.axes)):
            return by_position
        S = np.zeros((len(by_position), self.axes, 6))
        for k, column in enumerate(self.column):
            S[:, column] += by_position[:, k]
        return S

    def gradient(
        self,
        S: Float[np.ndarray, "frames axes 6"],
        x: Float[np.ndarray, "frames markers 3"],
        force: Float[np.ndarray, "frames markers 3"],
    ) -> Float[np.ndarray, "frames dofs"]:
        """Jᵀ f of forces at the markers."""
        wrench = self.carried @ np.concatenate([cross(x, force), force], axis=2)
        return self._by_dof((S * wrench).sum(axis=2))

    def same_frame(
        self,
        S: Float[np.ndarray, "frames axes 6"],
        x: Float[np.ndarray, "frames markers 3"],
        weight: Float[np.ndarray, "frames markers"],
    ) -> Float[np.ndarray, "frames dofs dofs"]:
        """Jᵀ W J, symmetric."""
        moved = (self._moments(x, x, weight) @ S[..., None])[..., 0]
        half = (moved @ S.transpose(0, 2, 1)) * self.halved
        return self._by_dofs(half + half.transpose(0, 2, 1))

    def between_frames(
        self,
        S: Float[np.ndarray, "frames axes 6"],
        x: Float[np.ndarray, "frames markers 3"],
        weight: Float[np.ndarray, "pairs markers"],
    ) -> Float[np.ndarray, "pairs dofs dofs"]:
        """J₊ᵀ W J of every frame and the one after it, J₊."""
        return self.between_pairs(S, x[1:], x[:-1], weight)

    def between_pairs(
        self,
        S: Float[np.ndarray, "frames axes 6"],
        later: Float[np.ndarray, "pairs markers 3"],
        earlier: Float[np.ndarray, "pairs markers 3"],
        weight: Float[np.ndarray, "pairs markers"],
    ) -> Float[np.ndarray, "pairs dofs dofs"]:
        """The same of points that are others in each pair of frames."""
        K = self._moments(later, earlier, weight)
        after, before = S[1:], S[:-1]
        product = (K.transpose(0, 1, 3, 2) @ after[..., None])[..., 0] @ before.transpose(0, 2, 1)
        product *= self.at_or_below
        product += (after @ (K @ before[..., None])[..., 0].transpose(0, 2, 1)) * self.above
        return self._by_dofs(product)

    def _moments(
        self,
        later: Float[np.ndarray, "some markers 3"],
        earlier: Float[np.ndarray, "some markers 3"],
        weight: Float[np.ndarray, "some markers"],
    ) -> Float[np.ndarray, "some axes 6 6"]:
        """Σ w X(later)ᵀ X(earlier) of the markers that each axis carries."""
        some, markers = weight.shape
        each = np.empty((some, markers, 16))
        each[..., 0] = weight
        each[..., 1:4] = weight[..., None] * later
        each[..., 4:7] = weight[..., None] * earlier
        each[..., 7:] = (each[..., 4:7, None] * later[..., None, :]).reshape(some, markers, 9)
        total = self.carried @ each
        K = np.zeros((some, self.axes, 6, 6))
        # −[x₊]×[x]× = (x₊·x) 1 − x x₊ᵀ
        K[..., :3, :3] = -total[..., 7:].reshape(some, self.axes, 3, 3)
        trace = total[..., 7] + total[..., 11] + total[..., 15]
        for i in range(3):
            K[..., i, i] += trace
            K[..., 3 + i, 3 + i] = total[..., 0]
            j, k = (i + 1) % 3, (i + 2) % 3
            K[..., k, 3 + j], K[..., j, 3 + k] = total[..., 1 + i], -total[..., 1 + i]
            K[..., 3 + k, j], K[..., 3 + j, k] = -total[..., 4 + i], total[..., 4 + i]
        return K

    def _by_dof(self, by_axis: Float[np.ndarray, "frames axes"]) -> Float[np.ndarray, "frames dofs"]:
        for axis, dof in enumerate(self.extra_dof, self.dofs):
            by_axis[:, dof] += by_axis[:, axis]
        return by_axis[:, : self.dofs]

    def _by_dofs(
        self, by_axes: Float[np.ndarray, "frames axes axes"]
    ) -> Float[np.ndarray, "frames dofs dofs"]:
        for axis, dof in enumerate(self.extra_dof, self.dofs):
            by_axes[:, dof] += by_axes[:, axis]
        for axis, dof in enumerate(self.extra_dof, self.dofs):
            by_axes[:, :, dof] += by_axes[:, :, axis]
        return by_axes[:, : self.dofs, : self.dofs]
