"""Gauss-Newton terms of the marker error, per frame, from sums over each body's markers.

A marker at x on a body moves with the twist (ω, v) of that body as ω × x + v. So, to the pose, the markers of
a body act like point masses: their weights' moments up to second order, summed over everything that an axis
carries, give JᵀWJ without forming J. The cost per frame is that of a mass matrix.
"""

from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from solver.skeleton.forward import ForwardKinematics, Poses, cross

UNIQUE = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # entries of a symmetric 3×3 matrix


class MarkerTerms:
    """The markers of one skeleton, sorted by body, ready to be summed over many frames."""

    def __init__(self, kinematics: ForwardKinematics) -> None:
        self.kinematics = kinematics

    @cached_property
    def _by_body(
        self,
    ) -> tuple[Int[np.ndarray, " markers"], Int[np.ndarray, " starts"], Int[np.ndarray, " starts"]]:
        bodies = self.kinematics.marker_bodies
        order = np.argsort(bodies, kind="stable")
        carrying, starts = np.unique(bodies[order], return_index=True)
        return order, starts, carrying

    @cached_property
    def _order(
        self,
    ) -> tuple[Int[np.ndarray, " positions"], Int[np.ndarray, " driven"], list[tuple[int, int]]]:
        """Positions with the first of every driven dof in front; these dofs; (dof's row, row) of the rest."""
        dof = self.kinematics.chain.dof
        driven, first = np.unique(dof, return_index=True)
        rest = np.setdiff1d(np.arange(len(dof)), first)
        row = {int(d): i for i, d in enumerate(driven)}
        return (
            np.concatenate([first, rest]),
            driven,
            [(row[int(dof[k])], len(driven) + i) for i, k in enumerate(rest)],
        )

    @cached_property
    def _ancestry(self) -> Float[np.ndarray, "positions positions"]:
        """Entry (k, l): 1 where p_l comes before p_k on the way from the ground, and ½ where it is p_k."""
        order, _, _ = self._order
        body = self.kinematics.chain.body
        above = self.kinematics.carries[:, body].T & np.tri(len(body), k=-1, dtype=bool)
        return (above + 0.5 * np.eye(len(body)))[np.ix_(order, order)]

    def normal_equations(
        self,
        poses: Poses,
        markers_ground: Float[np.ndarray, "frames markers 3"],
        error_ground: Float[np.ndarray, "frames markers 3"],
        weight: Float[np.ndarray, "frames markers"],
    ) -> tuple[Float[np.ndarray, "frames dofs dofs"], Float[np.ndarray, "frames dofs"]]:
        """JᵀWJ and JᵀW e of every frame.

        Args:
            poses: of the skeleton.
            markers_ground: model markers [m].
            error_ground: model minus measured [m]; zero where unseen.
            weight: of each marker [1/m²]; zero where unseen.
        """
        order, driven, further = self._order
        carried = self._composites(markers_ground, error_ground, weight)[:, self.kinematics.chain.body[order]]
        twist = poses.twists()[:, order]
        angular, linear = twist[..., :3], twist[..., 3:]
        total, first, second = carried[..., 0:1], carried[..., 1:4], carried[..., 4:10]
        wrench = np.empty_like(twist)
        wrench[..., :3] = _rotational_inertia(second, angular) + cross(first, linear)
        wrench[..., 3:] = total * linear + cross(angular, first)
        half = wrench @ twist.transpose(0, 2, 1)
        half *= self._ancestry
        H = half + half.transpose(0, 2, 1)
        g = np.einsum("tki,tki->tk", twist, carried[..., 10:16])
        for row, k in further:
            H[:, row] += H[:, k]
            g[:, row] += g[:, k]
        for row, k in further:
            H[:, :, row] += H[:, :, k]
        return self._all_dofs(H[:, : len(driven), : len(driven)], g[:, : len(driven)])

    def _all_dofs(
        self, H: Float[np.ndarray, "frames driven driven"], g: Float[np.ndarray, "frames driven"]
    ) -> tuple[Float[np.ndarray, "frames dofs dofs"], Float[np.ndarray, "frames dofs"]]:
        """With zeros for coordinates that move nothing."""
        _, driven, _ = self._order
        dofs = self.kinematics.chain.dofs
        if len(driven) == dofs:
            return H, g
        wide_H, wide_g = np.zeros((len(H), dofs, dofs)), np.zeros((len(H), dofs))
        wide_H[:, driven[:, None], driven] = H
        wide_g[:, driven] = g
        return wide_H, wide_g

    def _composites(
        self,
        x: Float[np.ndarray, "frames markers 3"],
        e: Float[np.ndarray, "frames markers 3"],
        weight: Float[np.ndarray, "frames markers"],
    ) -> Float[np.ndarray, "frames bodies 16"]:
        """Per body and all it carries: Σw, Σw x, Σw xxᵀ (six entries), Σw x×e, Σw e."""
        order, starts, carrying = self._by_body
        x, e, w = x[:, order], e[:, order], weight[:, order, None]
        weighted = w * x
        table = np.empty((*x.shape[:2], 16))
        table[..., 0:1] = w
        table[..., 1:4] = weighted
        for column, (i, j) in enumerate(UNIQUE):
            table[..., 4 + column] = weighted[..., i] * x[..., j]
        table[..., 10:13] = cross(weighted, e)
        table[..., 13:16] = w * e
        joints = self.kinematics.skeleton.joints
        sums = np.zeros((x.shape[0], len(joints), 16))
        sums[:, carrying] = np.add.reduceat(table, starts, axis=1)
        for body in range(len(joints) - 1, -1, -1):
            if joints[body].parent >= 0:
                sums[:, joints[body].parent] += sums[:, body]
        return sums


def _rotational_inertia(
    second: Float[np.ndarray, "*batch 6"], angular: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """Σw x × (ω × x) = tr(S) ω − S ω with S = Σw xxᵀ."""
    xx, yy, zz, xy, xz, yz = np.moveaxis(second, -1, 0)
    wx, wy, wz = np.moveaxis(angular, -1, 0)
    return np.stack(
        [
            (yy + zz) * wx - xy * wy - xz * wz,
            (xx + zz) * wy - xy * wx - yz * wz,
            (xx + yy) * wz - xz * wx - yz * wy,
        ],
        axis=-1,
    )
