"""What the solver sees of each example: the motion as activities are told from, and its windows' features."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from benchmarks.activities.examples import Example
from solver.gait.activity import Activity
from solver.gait.activity_features import features_of, windows_of
from solver.gait.activity_settings import ACTIVITIES, ActivitySettings
from solver.gait.body_motion import BodyMotion, body_motion
from solver.gait.settings import GAIT


@dataclass(frozen=True)
class Look:
    """One example, looked at."""

    example: Example
    motion: BodyMotion
    features: Float[np.ndarray, "windows features"]

    @property
    def source(self) -> str:
        """Persons and laboratory."""
        return self.example.source

    @property
    def activity(self) -> Activity:
        """What happens in it."""
        return self.example.activity


def looked_at(example: Example) -> Look:
    """Features of the windows in which the activity goes on.

    Args:
        example: a motion.
    """
    motion = body_motion(example.skeleton, example.feet, example.motion, GAIT, example.load_BW)
    return with_windows(Look(example, motion, np.empty((0, 0))), ACTIVITIES)


def with_windows(look: Look, settings: ActivitySettings) -> Look:
    """The same motion by other windows.

    Args:
        look: at an example.
        settings: length and distance of windows.
    """
    motion = look.motion
    first, last = look.example.during or (0, motion.frames)
    windows = windows_of(motion, settings)
    chosen = [
        span for span, (a, b) in zip(windows.spans, windows.cells, strict=True) if first <= (a + b) / 2 < last
    ]
    return replace(look, features=np.array([features_of(motion, span) for span in chosen]))
