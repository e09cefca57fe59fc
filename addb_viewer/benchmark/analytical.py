"""The baseline without training: differences of the motion, F = m a, even split, contact by motion alone."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.benchmark.completing import CUTOFF_HZ
from addb_viewer.benchmark.differences import central_differences
from addb_viewer.benchmark.task import Log, Predicted, Seen, Trials
from solver.common.filters import low_pass
from solver.contact.settings import ContactSettings
from solver.contact.sole import soles
from solver.contact.touching import touching
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel

LOW_M = (
    0.1  # of a foot body's origin above the lowest one: on the ground (as the paper's public tools have it)
)

ContactRule = Literal["height", "soles"]


@dataclass(frozen=True)
class Analytical:
    """Total force m (z̈ − g), in equal parts on the feet that are on the ground; no moment."""

    name: str = "analytical"
    cutoff_Hz: float | None = None  # of the motion, before it is differenced; None: unfiltered
    contact: ContactRule = "height"  # of the feet's origins; or by the soles' height and speed

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """Nothing is learnt."""

    def predict(self, seen: Seen) -> Predicted:
        """See the class."""
        q = seen.q if self.cutoff_Hz is None else low_pass(seen.q, seen.rate, self.cutoff_Hz)
        velocity, acceleration = central_differences(q, seen.rate)
        model = RigidBodyModel(seen.skeleton)
        com = model.centre_of_mass_acceleration(q, velocity, acceleration)
        total = seen.mass_kg * (com - seen.skeleton.gravity)
        on_ground = feet_on_ground(replace(seen, q=q), self.contact)
        share = on_ground / np.maximum(on_ground.sum(axis=1, keepdims=True), 1)
        force = share[:, :, None] * total[:, None, :]
        return Predicted(force, np.zeros_like(force), acceleration=acceleration, velocity=velocity, q=q)


def feet_on_ground(seen: Seen, rule: ContactRule) -> Bool[np.ndarray, "frames feet"]:
    """Which feet are on the ground, by motion alone.

    Args:
        seen: the motion.
        rule: "height": the foot body's origin is less than 0.1 m above the lowest of the stretch; "soles": a
            corner of the sole is as low as the sole gets, and moves with the ground or belt.
    """
    R, p = body_poses(seen.skeleton, seen.q)
    if rule == "height":
        height: Float[np.ndarray, "frames feet"] = p[:, list(seen.feet), 1]
        return height < height.min() + LOW_M
    corners = [sole.corners_ground(R, p) for sole in soles(seen.skeleton, seen.foot_bodies)]
    nobody = np.zeros((seen.frames, len(corners)), dtype=bool)
    return touching(corners, nobody, seen.rate, ContactSettings())


def filtered(cutoff_Hz: float = CUTOFF_HZ, contact: ContactRule = "height") -> Analytical:
    """The same on filtered motion.

    Args:
        cutoff_Hz: of the filter of order 3, forwards and backwards.
        contact: as in `Analytical`.
    """
    name = f"analytical-{cutoff_Hz:g}Hz" + ("-soles" if contact == "soles" else "")
    return Analytical(name, cutoff_Hz, contact)
