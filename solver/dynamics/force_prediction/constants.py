"""A wrench that goes with the person and never changes: a plate's zero level, a leaning model, a rucksack."""

import numpy as np

from solver.dynamics.force_prediction.columns import Columns
from solver.dynamics.force_prediction.heading_frame import HeadingFrame
from solver.dynamics.force_prediction.settings import PredictionSettings

KIND = "constants"


def constant_columns(frame: HeadingFrame, weight_N: float, settings: PredictionSettings) -> Columns:
    """Six: one an axis of the heading frame.

    Args:
        frame: of the trial.
        weight_N: of the person.
        settings: scatter of the constants.
    """
    units = np.broadcast_to(np.eye(6), (len(frame.origin_ground), 6, 6))
    share = settings.constant_force_share, settings.constant_arm_m
    return Columns(KIND, frame.to_ground(units), weight_N * np.repeat(share, 3))
