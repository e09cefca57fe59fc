"""The sole of the default body's foot: contact points for planting it, and its outline."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.skeleton.default_frames import body_frames
from solver.skeleton.segment_tables import ANKLE_ALONG_FOOT, BALL_ALONG_FOOT, Sex, lengths

SIDES = ("r", "l")  # order of the feet wherever an axis runs over feet


@dataclass(frozen=True)
class Sole:
    """Lengths of a right foot [m]; the sole's frame lies on the ground below calcn's origin, x to the toe."""

    heel: float  # back of the heel, negative
    ball: float
    toe_tip: float
    half_width: float
    thickness: float  # calcn's origin above the sole
    ankle: float  # ankle centre before the origin

    @property
    def length(self) -> float:
        """From the back of the heel to the tip of the toes [m]."""
        return self.toe_tip - self.heel

    def point(self, along: float, across: float) -> Float[np.ndarray, "2"]:
        """(x, z) of the right sole from shares of length (0 heel, 1 toes) and half width (1 lateral)."""
        return np.array([self.heel + along * self.length, across * self.half_width])

    def planted_points(self) -> tuple[tuple[str, Float[np.ndarray, "3"]], ...]:
        """Points of the right foot that stay put while it carries load: body, position in it [m].

        The heel is a point of calcn, the forefoot a triangle of the toes: the foot rolls over its ball.
        """
        toes = self.toe_tip - self.ball
        return (
            ("calcn", np.array([self.heel + 0.1 * self.length, -self.thickness, 0.0])),
            ("toes", np.array([0.0, -self.thickness, 0.7 * self.half_width])),
            ("toes", np.array([0.0, -self.thickness, -0.7 * self.half_width])),
            ("toes", np.array([0.7 * toes, -self.thickness, 0.0])),
        )

    def flat_position(self, body: str, position: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """A point of calcn or toes in the sole's frame while the foot lies flat, toes straight [m]."""
        forward = self.ball if body == "toes" else 0.0
        return position + np.array([forward, self.thickness, 0.0])

    def contains(
        self, points: Float[np.ndarray, "times 2"], margin: float = 0.0
    ) -> Bool[np.ndarray, " times"]:
        """Whether points (x, z) lie on the sole, drawn as a rounded bar [m]."""
        radius = self.half_width
        nearest = np.clip(points[:, 0], self.heel + radius, self.toe_tip - radius)
        return np.hypot(points[:, 0] - nearest, points[:, 1]) <= radius + margin


def sole_of(height_m: float, sex: Sex | None) -> Sole:
    """The sole that goes with `default_skeleton` of that stature and sex."""
    of = lengths(height_m, sex)
    frames = body_frames(of)
    return Sole(
        heel=-frames.heel_behind_calcn,
        ball=frames.toes_calcn[0],
        toe_tip=frames.toes_calcn[0] + (1 - BALL_ALONG_FOOT) * of.foot,
        half_width=of.foot_breadth / 2,
        thickness=frames.calcn_above_sole,
        ankle=ANKLE_ALONG_FOOT * of.foot - frames.heel_behind_calcn,
    )
