"""What a segment's markers say together of their changes, to be taken off what each says by itself.

With own variances 1/p of the changes and a shared one c² on top, the inverse of their covariance is
diag(p) − p pᵀ c² / (1 + c² P), P = Σ p: one more point, at the weighted mean x̄ = Σ p x / P of the segment's
markers, of weight −c² P² / (1 + c² P). Where markers come and go, the mean is another one in the next pair of
frames.
"""

import numpy as np
from jaxtyping import Float

from solver.dynamics.trajectory.subtree_terms import SubtreeTerms
from solver.skeleton.forward import ForwardKinematics


class SegmentMeans:
    """The means of all segments with markers, for each pair of neighbouring frames."""

    def __init__(
        self,
        kinematics: ForwardKinematics,
        pair_weight: Float[np.ndarray, "pairs markers"],
        shared_variance: Float[np.ndarray, " markers"],
    ) -> None:
        """Weigh them.

        Args:
            kinematics: of the skeleton with its markers.
            pair_weight: p, of each marker by itself.
            shared_variance: c² of each marker's segment, in units of 1/p.
        """
        bodies, self.segment = np.unique(kinematics.marker_bodies, return_inverse=True)
        self.of_segment = (self.segment[:, None] == np.arange(len(bodies))).astype(float)
        self.tree = SubtreeTerms(kinematics, bodies)
        total = pair_weight @ self.of_segment
        shared = shared_variance @ (self.of_segment / self.of_segment.sum(axis=0))
        self.weight = -shared * total**2 / (1 + shared * total)  # of the means
        self.share = (
            pair_weight / np.where(total > 0, total, 1.0)[:, self.segment]
        )  # of each marker in its mean

    def cost(self, change: Float[np.ndarray, "pairs markers 3"]) -> float:
        """Of the markers' changes, below zero."""
        return float((self.weight * (self._means(change) ** 2).sum(axis=2)).sum())

    def pull(self, change: Float[np.ndarray, "pairs markers 3"]) -> Float[np.ndarray, "pairs markers 3"]:
        """The gradient of half the cost by the markers' changes."""
        of_means = self.weight[:, :, None] * self._means(change)
        return self.share[:, :, None] * of_means[:, self.segment]

    def same_frame(
        self, S: Float[np.ndarray, "some axes 6"], x: Float[np.ndarray, "frames markers 3"], frames: slice
    ) -> Float[np.ndarray, "some dofs dofs"]:
        """Gauss-Newton terms at (q_t, q_t) of some frames, from the pairs before and after each of them.

        Args:
            S: the tree's twists at these frames.
            x: the markers of all frames [m].
            frames: of the trial.
        """
        H = np.zeros((len(S), self.tree.dofs, self.tree.dofs))
        later = slice(max(frames.start, 1), frames.stop)  # the second frame of a pair
        pairs = slice(later.start - 1, later.stop - 1)
        at = slice(later.start - frames.start, len(S))
        H[at] += self.tree.same_frame(S[at], self._means(x[later], pairs), self.weight[pairs])
        pairs = slice(frames.start, min(frames.stop, len(self.weight)))  # of which these are the first
        at = slice(0, pairs.stop - pairs.start)
        H[at] += self.tree.same_frame(S[at], self._means(x[pairs], pairs), self.weight[pairs])
        return H

    def between_frames(
        self, S: Float[np.ndarray, "some axes 6"], x: Float[np.ndarray, "some markers 3"], pairs: slice
    ) -> Float[np.ndarray, "pairs dofs dofs"]:
        """Gauss-Newton terms at (q_t, q_(t−1)) of neighbouring frames.

        Args:
            S: the tree's twists at these frames.
            x: the markers there [m].
            pairs: of these frames, as pairs of the trial.
        """
        later, earlier = self._means(x[1:], pairs), self._means(x[:-1], pairs)
        return self.tree.between_pairs(S, later, earlier, -self.weight[pairs])

    def _means(
        self, of_markers: Float[np.ndarray, "some markers 3"], pairs: slice = slice(None)
    ) -> Float[np.ndarray, "some segments 3"]:
        weighted = self.share[pairs][:, :, None] * of_markers
        return self.of_segment.T @ weighted
