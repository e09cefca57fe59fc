"""A person who walks and swings the arms, with markers whose labels say nothing."""

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.markers.atlas import atlas, landmark_marker
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions

SIDED = (
    "asis", "psis", "thigh_wand", "thigh_front", "knee_lateral", "knee_medial", "shank_wand", "shank_front",
    "ankle_lateral", "ankle_medial", "heel", "mt2_head", "mt5_head", "acromion", "elbow_lateral",
    "elbow_medial", "wrist_radial", "wrist_ulnar", "head_front", "head_back",
)  # fmt: skip
PLACES = (*(f"{name}_{side}" for name in SIDED for side in "rl"), "c7", "notch", "xiphoid", "t10")
HEADING_RAD = 2.0


def walking(body, frames=60):
    """Two steps towards HEADING_RAD, right arm with left leg; made by hand, no part of the search."""
    q = np.tile(body.default_q, (frames, 1))
    phase = np.linspace(0, 2 * np.pi, frames)
    travelled = np.linspace(0.0, 1.4, frames)
    for side, shift in (("r", 0.0), ("l", np.pi)):
        swing = np.sin(phase + shift)
        for name, angle in {
            "hip_flexion": 0.1 + 0.4 * swing,
            "knee_angle": 0.4 + 0.35 * np.cos(phase + shift),
            "ankle_angle": 0.15 * np.cos(phase + shift),
            "arm_flex": -0.35 * swing,
            "elbow_flex": 0.5 - 0.2 * swing,
        }.items():
            q[:, body.dofs.index(f"{name}_{side}")] = angle
    q[:, body.dofs.index("pelvis_rotation")] = HEADING_RAD
    q[:, body.dofs.index("pelvis_tx")] += travelled * np.cos(HEADING_RAD)
    q[:, body.dofs.index("pelvis_tz")] -= travelled * np.sin(HEADING_RAD)
    return q


@pytest.fixture(scope="session")
def walker():
    """Markers of a person 1.80 m tall, off their landmarks by 8 mm, and the truth by label."""
    rng = np.random.default_rng(3)
    body = default_skeleton(height_m=1.80)
    order = rng.permutation(len(PLACES))
    labels = tuple(f"M{i:03d}" for i in range(len(PLACES)))
    places = {label: atlas()[PLACES[k]] for label, k in zip(labels, order, strict=True)}
    marked = body.with_markers([landmark_marker(mark, label, body) for label, mark in places.items()])
    x = marker_positions(marked, walking(body))
    off = rng.normal(0.0, 0.008 / np.sqrt(3), (1, len(labels), 3))
    noise = rng.normal(0.0, 0.001, x.shape)
    return Markers(labels, x + off + noise, 100.0), places
