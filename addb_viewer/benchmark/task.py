"""The task: what a predictor is shown, what it answers, and what it is held against.

Ground frame, y up, SI units; forces and moments are those on the person. Feet stand in the order right, left.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.errors import SolverError
from solver.skeleton.skeleton import Skeleton


class BenchmarkError(SolverError):
    """A run that cannot be made, or whose figures would mean nothing."""


FEET = ("r", "l")


@dataclass(frozen=True)
class SeenMarkers:
    """Recorded markers: only for predictors that say they need them."""

    names: tuple[str, ...]
    position_ground: Float[np.ndarray, "frames markers 3"]  # [m] NaN where not seen


@dataclass(frozen=True)
class Seen:
    """All that a predictor is shown of a stretch of motion: neither forces nor who it is."""

    q: Float[np.ndarray, "frames dofs"]  # noisy coordinates as the markers alone have them [rad or m]
    rate: float  # [Hz]
    skeleton: Skeleton  # scaled; unless the run says otherwise its inertias have not seen the forces
    height_m: float
    foot_bodies: tuple[str, str]  # right, left
    markers: SeenMarkers | None = None

    @property
    def mass_kg(self) -> float:
        """Of the skeleton."""
        return self.skeleton.mass

    @property
    def frames(self) -> int:
        """How many there are."""
        return len(self.q)

    @property
    def feet(self) -> tuple[int, int]:
        """The skeleton's indices of the feet."""
        right, left = (self.skeleton.body_index(name) for name in self.foot_bodies)
        return right, left


@dataclass(frozen=True)
class Predicted:
    """What a predictor says: forces and moments, and of the rest what it wants to say itself.

    Without an acceleration the harness differences the motion and changes the root's translations so that the
    centre of mass obeys the forces; without torques it does inverse dynamics.
    """

    force: Float[np.ndarray, "frames feet 3"]  # on each foot [N]
    moment: Float[np.ndarray, "frames feet 3"]  # on each foot about its body's origin at the shown q [N·m]
    acceleration: Float[np.ndarray, "frames dofs"] | None = None  # of the coordinates [rad/s² or m/s²]
    velocity: Float[np.ndarray, "frames dofs"] | None = None  # that belongs to it [rad/s or m/s]
    q: Float[np.ndarray, "frames dofs"] | None = None  # likewise [rad or m]; None: as shown
    torque: Float[np.ndarray, "frames dofs"] | None = None  # generalized forces, the root's too [N·m or N]
    force_sd: Float[np.ndarray, "frames feet 3"] | None = None  # standard deviation of each component [N]


@dataclass(frozen=True)
class Measured:
    """What the release has of the same frames: force plates, and the motion fitted to them."""

    counts: Bool[np.ndarray, " frames"]  # every foot's force was measured and is right
    phase: Int[np.ndarray, " frames"]  # 0 flight, 1 right, 2 left, 3 both; -1 unknown
    activity: np.ndarray  # a word a frame
    mass_kg: float  # of the fitted skeleton
    force: Float[np.ndarray, "frames feet 3"]  # [N] NaN where it does not count
    moment: Float[np.ndarray, "frames feet 3"]  # about the foot body's origin [N·m] likewise
    foot_ground: Float[np.ndarray, "frames feet 3"]  # that origin [m]
    cop_ground: Float[np.ndarray, "frames feet 3"]  # centre of pressure [m] NaN where unloaded
    com_acceleration: Float[np.ndarray, "frames 3"]  # gravity is not taken off [m/s²]
    torque: Float[np.ndarray, "frames dofs"]  # [N·m or N]


@dataclass(frozen=True)
class Example:
    """A stretch of consecutive frames of a trial."""

    person_id: str
    subject_id: str
    trial_id: str
    frame: Int[np.ndarray, " frames"]  # in the trial, on the release's grid
    seen: Seen
    measured: Measured


class Trials(Protocol):
    """Some persons' stretches of motion; each round reads them from the release again."""

    @property
    def persons(self) -> frozenset[str]:
        """Whose they are."""

    @property
    def fingerprint(self) -> str:
        """Another one where the release or the shown skeleton is another."""

    def __iter__(self) -> Iterator[Example]:
        """One after the other, so that memory holds one."""


class Log(Protocol):
    """Where a predictor says how it gets on, and where it may keep files."""

    folder: Path

    def __call__(self, **figures: float | str) -> None:
        """A row of figures."""


class Predictor(Protocol):
    """A way to tell forces from motion. `fit` may do nothing; `needs_markers` may be left out."""

    @property
    def name(self) -> str:
        """As tables and folders have it."""

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """Learn from some persons; choose by others."""

    def predict(self, seen: Seen) -> Predicted:
        """Say what acts on the feet."""


def central_differences(
    q: Float[np.ndarray, "frames dofs"], rate: float
) -> tuple[Float[np.ndarray, "frames dofs"], Float[np.ndarray, "frames dofs"]]:
    """(q[t+1] − q[t−1]) / 2Δt and (q[t−1] − 2 q[t] + q[t+1]) / Δt²; ends repeat their neighbours'.

    Args:
        q: three frames or more [rad or m].
        rate: [Hz].
    """
    velocity, acceleration = np.empty_like(q), np.empty_like(q)
    velocity[1:-1] = (q[2:] - q[:-2]) * (rate / 2)
    acceleration[1:-1] = (q[:-2] - 2 * q[1:-1] + q[2:]) * rate**2
    for end, beside in ((0, 1), (-1, -2)):
        velocity[end], acceleration[end] = velocity[beside], acceleration[beside]
    return velocity, acceleration
