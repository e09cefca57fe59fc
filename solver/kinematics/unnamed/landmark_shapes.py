"""Which markers of one body are at its landmarks, by the shape that they make.

Poses are found with the markers where they were first thought to be, and a body that turned towards a wrong
marker confirms it. The distances between markers of one body do not depend on its pose: here the body is laid
anew on its markers for every choice. A landmark goes to the marker with which the shape is likelier, and a
marker with a rival is held as loosely as the two lie apart.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from solver.kinematics.unnamed.landmark_mixture import LandmarkMixture
from solver.markers.atlas import Landmark
from solver.skeleton.rotations import nearest_rotation

FEWEST = 4  # landmarks of a body whose shape is looked at; with three, most markers make a likely shape
BETTER = float(np.log(3.0))  # log likelihood that another marker must gain; else what was found first stays


@dataclass(frozen=True)
class BodyShape:
    """The landmarks of one body on its markers."""

    at: Mapping[int, Landmark]  # marker to landmark
    spread_m: Mapping[int, float]  # how far each of these may lie from its landmark
    place_body: Mapping[int, Float[np.ndarray, "3"]]  # [m] of every marker, the body laid on its landmarks


def by_shape(
    at: Mapping[int, Landmark],
    measured_body: Mapping[int, Float[np.ndarray, "3"]],
    mixture: LandmarkMixture,
) -> BodyShape:
    """Give the landmarks of one body to the markers that make the likeliest shape, one change at a time.

    Args:
        at: the landmarks of its markers, as thought.
        measured_body: places [m] of all its markers in its frame, in poses that may be wrong.
        mixture: at the person's size, segments scaled.
    """
    now = _Laid(at, measured_body, mixture)
    if len(at) < FEWEST:
        spreads = {i: mark.spread_m for i, mark in at.items()}
        return BodyShape(dict(at), spreads, dict(measured_body))
    while True:
        best = min(now.others(), key=lambda other: other.misfit, default=now)
        if best.misfit > now.misfit - BETTER:
            break
        now = best
    places = now.places() if now.at != at else dict(measured_body)
    return BodyShape(now.at, {i: now.spread(i) for i in now.at}, places)


@dataclass(frozen=True)
class _Laid:
    """A choice of markers for the landmarks, and the body laid on them (Kabsch)."""

    at: Mapping[int, Landmark]
    measured: Mapping[int, Float[np.ndarray, "3"]]
    mixture: LandmarkMixture

    def others(self, loser: int | None = None) -> Sequence["_Laid"]:
        """All choices in which one landmark, or the loser's, goes to a marker that has none."""
        free = [i for i in self.measured if i not in self.at]
        return [
            _Laid(
                {j if i == lost else i: mark for i, mark in self.at.items()},
                self.measured,
                self.mixture,
            )
            for lost in self.at
            if loser in (None, lost)
            for j in free
        ]

    @cached_property
    def misfit(self) -> float:
        """Half the squared deviations from the landmarks, in their standard deviations."""
        landmarks, variance = self._landmarks
        laid = self.places()
        off = np.array([laid[i] for i in self.at]) - landmarks
        return float(0.5 * ((off**2).sum(axis=1) / variance).sum())

    def spread(self, marker: int) -> float:
        """Of the marker about its landmark [m]: wider where others may be there in its place."""
        mark = self.at[marker]
        rivals = self.others(marker)
        odds = np.exp([min(0.0, self.misfit - rival.misfit) for rival in rivals])
        apart = [
            float(
                np.linalg.norm(
                    self.measured[next(iter(rival.at.keys() - self.at.keys()))] - self.measured[marker]
                )
            )
            for rival in rivals
        ]
        doubt = float(odds @ np.square(apart)) / (1 + odds.sum()) if rivals else 0.0
        return float(np.sqrt(mark.spread_m**2 + doubt))

    def places(self) -> dict[int, Float[np.ndarray, "3"]]:
        """Of all markers in the frame of the body as it is laid [m]."""
        landmarks, variance = self._landmarks
        weight = (1 / variance) / (1 / variance).sum()
        points = np.array([self.measured[i] for i in self.at])
        from_points, to_landmarks = weight @ points, weight @ landmarks
        R = nearest_rotation(np.einsum("m,mi,mj->ij", weight, landmarks - to_landmarks, points - from_points))
        return {i: R @ (p - from_points) + to_landmarks for i, p in self.measured.items()}

    @cached_property
    def _landmarks(self) -> tuple[Float[np.ndarray, "marks 3"], Float[np.ndarray, " marks"]]:
        """Places [m] and variances [m²] of the landmarks, in the order of `at`."""
        index = [self.mixture.landmarks.index(mark) for mark in self.at.values()]
        room = self.mixture.settings.scaled_proportions_m**2
        return self.mixture.place_body[index], self.mixture.variance[index] + room
