"""How fast a person walks or runs in a stretch of a trial, by the motion of the markers alone."""

import numpy as np

from addb_viewer.dataset.figures import Row
from addb_viewer.dataset.frame_rows import TrialRows
from addb_viewer.dataset.segments import Segment
from addb_viewer.dataset.trial_labels import TrialLabels
from solver.export.b3d.model import joints_in_order
from solver.gait.speed import overground_speed, treadmill_speed

GAITS = ("walk", "run")


def average_speed(rows: TrialRows, stretch: Segment, labels: TrialLabels) -> Row:
    """Speed [m/s] and how it was found; None where nobody says that it is gait, or where.

    Args:
        rows: of the trial.
        stretch: frames that are meant.
        labels: what people say of the trial.
    """
    kind, speed = labels.trial_type, None
    if labels.activity in GAITS and kind == "overground":
        speed = overground_speed(np.asarray(rows.first_pass.com_vel)[stretch.rows])
    elif labels.activity in GAITS and kind == "treadmill":
        speed = _on_belt(rows, stretch)
    return {"average_speed_m_s": speed, "speed_kind": None if speed is None else kind}


def _on_belt(rows: TrialRows, stretch: Segment) -> float | None:
    """By the ankles of standing feet; None where the model calls no joint an ankle."""
    names = [rows.skeleton.joints[joint].name for joint in joints_in_order(rows.skeleton)]
    ankles = [f"ankle_{side}" for side in rows.sides]
    if not set(ankles) <= set(names):
        return None
    frames, grid = rows.gridded.grid.frames, rows.gridded.grid
    centres = np.asarray(rows.first_pass.world_frame_joint_centers).reshape(frames, -1, 3)
    on_ground = np.zeros((frames, len(rows.sides)), dtype=bool)
    for phase in rows.gridded.phases:
        on_ground[phase.start : phase.end, phase.foot] = True
    places = [names.index(name) for name in ankles]
    return treadmill_speed(centres[stretch.rows][:, places], on_ground[stretch.rows], grid.rate)
