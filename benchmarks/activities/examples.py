"""A motion whose activity is known."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.gait.activity import Activity, Kind
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

SIMULATED = "simulated"  # source of synthetic people


@dataclass(frozen=True)
class Example:
    """One trial, or the frames `during` which it is what it is called."""

    source: str  # of persons and laboratory: what is left out together
    trial: str
    activity: Activity
    kind: Kind | None
    skeleton: Skeleton
    feet: tuple[str, ...]
    motion: Motion
    load_BW: Float[np.ndarray, " frames"] | None = None  # all plates [body weights]
    speed_m_s: float | None = None  # true, over the surface
    during: tuple[int, int] | None = None  # None: all frames

    @property
    def person(self) -> str:
        """The simulated one, or the recording's folder."""
        return self.trial.partition("," if self.source == SIMULATED else " ")[0]
