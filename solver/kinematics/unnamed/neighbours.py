"""Whether a marker may as well be on the next body: it is put there, and the poses are found anew.

Where a marker lies and what it moves with is judged in poses that were fitted with the marker where it was
thought to be. A foot or a hand that few markers hold follows a wrong one, and so confirms it. Only poses that
were fitted with the marker on the other body tell how much better the first one is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from solver.kinematics.frame_solver import solve_frames
from solver.kinematics.unnamed.landmark_mixture import LandmarkMixture
from solver.kinematics.unnamed.settings import (
    INDEPENDENT_FRAMES,
    PROPORTIONS_M,
    RIGID_M,
    SCALED_PROPORTIONS_M,
)
from solver.kinematics.unnamed.whole_recording import (
    Attachment,
    Followed,
    Seen,
    Tolerance,
    attach,
    log_likelihood,
    pose_problem,
)

# [nats] of the comparison with a marker on the next body, the poses fitted with it there
NEIGHBOUR_TEMPER = 2.0
NEIGHBOUR_MOST = 0.8  # odds of the next body at most: what was found first is likelier
NEIGHBOUR_REACH_M = 0.08  # [m] how far off a landmark of the next body may be
LEAST_WEIGHED = 0.05  # belief in a body below which its neighbours are not tried

ROUNDS, STEPS = 2, 4  # of poses and attachment in turn, with the marker on one body; steps of the poses
# joints between them are a few centimetres from the next one, or allow little
_ALSO_NEIGHBOURS = (("tibia", "calcn"), ("humerus", "radius"), ("ulna", "hand"))
_SIDE_BY_SIDE = ("ulna", "radius")


def weighed_against_neighbours(
    seen: Seen, followed: Followed, mixture: LandmarkMixture, markers: Sequence[int] | None = None
) -> Float[np.ndarray, "markers bodies"]:
    """Probability that each marker is on each body, the bodies next to its likeliest one weighed in earnest.

    Args:
        seen: frames of the recording [m].
        followed: an understanding of it, segments scaled.
        mixture: of the default body.
        markers: to weigh; None for all. The others keep what they have.
    """
    fitted = _Fitted(replace(seen, points=seen.points / followed.size), followed, followed.own(mixture))
    before = followed.attachment.on_body(mixture)
    belief = before.copy()
    for i in range(len(before)) if markers is None else markers:
        body = fitted.body[i]
        if before[i, body] < LEAST_WEIGHED:
            continue
        for other in fitted.candidates(i):
            more = fitted.log_likelihood_on(i, other) - fitted.log_likelihood_as_it_is[i]
            more /= NEIGHBOUR_TEMPER
            odds = min(NEIGHBOUR_MOST, float(np.exp(min(0.0, more))))
            belief[i, other] = max(belief[i, other], odds * before[i, body])
        for other in fitted.alongside(i):
            odds = NEIGHBOUR_MOST * fitted.keeps_place(i, other) / fitted.keeps_place(i, body)
            belief[i, other] = max(belief[i, other], min(NEIGHBOUR_MOST, odds) * before[i, body])
        belief[i] *= before[i].sum() / belief[i].sum()
    return belief


@dataclass(frozen=True)
class _Fitted:
    """An understanding, and what becomes of it when one marker changes its body."""

    seen: Seen  # in units of the person's size
    followed: Followed
    mixture: LandmarkMixture  # segments scaled

    @cached_property
    def body(self) -> Int[np.ndarray, " markers"]:
        """Each marker's likeliest."""
        return self.followed.attachment.on_body(self.mixture).argmax(axis=1)

    def candidates(self, marker: int) -> list[int]:
        """Bodies next to the marker's own that have a landmark within reach of it."""
        reach = NEIGHBOUR_REACH_M
        near = self._beyond_spread[marker] < reach
        return [b for b in self._next[self.body[marker]] if near[self.mixture.body == b].any()]

    def alongside(self, marker: int) -> list[int]:
        """The forearm's other bone, for a marker without a place of its own there: either is convention."""
        own = self.mixture.body == self.body[marker]
        share = self.followed.attachment.share[marker]
        tracking = np.array([mark.tracks_only for mark in self.mixture.landmarks])
        names = self.mixture.skeleton.body_names
        stem, _, side = names[self.body[marker]].partition("_")
        if stem not in _SIDE_BY_SIDE or share[own & tracking].sum() < share[own].sum() / 2:
            return []
        return [names.index(f"{other}_{side}") for other in _SIDE_BY_SIDE if other != stem]

    def keeps_place(self, marker: int, body: int) -> float:
        """How well the marker keeps its place on a body, as a likelihood."""
        moved = self.followed.attachment.moved_m2[marker, body]
        return float(np.exp(-0.5 * INDEPENDENT_FRAMES * moved / RIGID_M**2))

    @cached_property
    def log_likelihood_as_it_is(self) -> Float[np.ndarray, " markers"]:
        """Of the whole recording, each marker being on its likeliest body and nowhere else."""
        everywhere, attachment = self._refitted(self.body, self.followed.attachment.share, None)
        own = self.mixture.body[None] == self.body[:, None]
        return everywhere + _log(np.where(own, attachment.share, 0.0).sum(axis=1))

    def log_likelihood_on(self, marker: int, body: int) -> float:
        """Of the whole recording, this marker being on that body and nowhere else."""
        bodies = self.body.copy()
        bodies[marker] = body
        everywhere, attachment = self._refitted(bodies, self._share_on(marker, body), marker)
        of_body = attachment.share[marker, self.mixture.body == body].sum()
        return float(everywhere + _log(of_body))

    def _refitted(
        self,
        bodies: Int[np.ndarray, " markers"],
        share: Float[np.ndarray, "markers landmarks"],
        moved: int | None,
    ) -> tuple[float, Attachment]:
        """Poses and attachment in turn, the markers on these bodies; the moved one is kept on its own."""
        mixture = self.mixture
        attachment, q, every = self.followed.attachment, self.followed.q, np.arange(len(self.followed.q))
        tolerance = Tolerance(RIGID_M, SCALED_PROPORTIONS_M)
        for _ in range(ROUNDS):
            place = replace(attachment, share=share).blended_place(mixture, bodies)
            problem = pose_problem(self.seen, bodies, place, mixture)
            q, _ = solve_frames(problem, q, every, max_iterations=STEPS)
            attachment = attach(self.seen, q, share, mixture, tolerance=tolerance, arms=self.followed.arms)
            share = attachment.share
            if moved is not None:
                of_body = np.where(mixture.body == bodies[moved], share[moved], 0.0)
                share = share.copy()
                share[moved] = of_body / max(of_body.sum(), np.finfo(float).tiny)
        return log_likelihood(attachment, q, mixture), attachment

    def _share_on(self, marker: int, body: int) -> Float[np.ndarray, "markers landmarks"]:
        """The shares as they are, but the marker's among that body's landmarks, by distance."""
        share = self.followed.attachment.share.copy()
        own = self.mixture.body == body
        off = self._beyond_spread[marker] / PROPORTIONS_M
        nearest = np.where(own, off, np.inf).min()
        weight = np.where(own, np.exp(-0.5 * (off**2 - nearest**2)), 0.0)
        share[marker] = weight / weight.sum()
        return share

    @cached_property
    def _beyond_spread(self) -> Float[np.ndarray, "markers landmarks"]:
        """How far from each landmark a marker lies, further than such markers usually do [m]."""
        place = self.followed.attachment.place_body[:, self.mixture.body]
        off = np.linalg.norm(place - self.mixture.place_body, axis=2)
        return np.maximum(0.0, off - 2 * np.sqrt(self.mixture.variance))

    @cached_property
    def _next(self) -> Sequence[Sequence[int]]:
        skeleton = self.mixture.skeleton
        names = skeleton.body_names
        pairs = {(joint.parent, child) for child, joint in enumerate(skeleton.joints) if joint.parent >= 0}
        pairs |= {
            (names.index(f"{a}_{side}"), names.index(f"{b}_{side}"))
            for a, b in _ALSO_NEIGHBOURS
            for side in "rl"
        }
        return [
            sorted({b for pair in pairs if body in pair for b in pair} - {body}) for body in range(len(names))
        ]


def _log(share: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    return np.log(share + np.finfo(float).tiny)
