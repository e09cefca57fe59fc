"""Arms that carry one marker a joint: a straight elbow may as well bend backwards, and must not."""

from dataclasses import replace

import numpy as np
import pytest

from solver.kinematics.calibration import calibrate, choose_frames
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions

LEGS = tuple(
    side + name for side in "LR" for name in ("ASI", "PSI", "THI", "KNE", "TIB", "ANK", "HEE", "TOE")
)
MARKERS = (*LEGS, "C7", "CLAV", "STRN", "T10", "LSHO", "RSHO", "LELB", "RELB", "LWRA", "RWRA")
FRAMES = 40


def marked(height_m=1.72):
    body = default_skeleton(height_m=height_m)
    return body.with_markers([m for m in body.markers if m.name in MARKERS])


def arms_turned_inwards(body, rng):
    """A walk with bent elbows and the hands before the belly."""
    q = np.tile(body.default_q, (FRAMES, 1))
    phase = np.linspace(0, 2 * np.pi, FRAMES)
    for side, shift in (("r", 0.0), ("l", np.pi)):
        for name, angle in {
            "hip_flexion": 0.4 * np.sin(phase + shift),
            "knee_angle": 0.4 + 0.3 * np.cos(phase + shift),
            "arm_flex": -0.3 * np.sin(phase + shift),
            "arm_add": -0.15,
            "arm_rot": rng.uniform(0.2, 1.3) + 0.2 * np.sin(phase),
            "elbow_flex": 0.4 + 0.2 * np.sin(phase + shift + 1),
            "pro_sup": 1.2,
        }.items():
            q[:, body.dofs.index(f"{name}_{side}")] = angle
    return q


def fitted_arms(seed, height_m, without=()):
    """The motion, and that found from markers off their places; coordinates by name [rad]."""
    rng = np.random.default_rng(seed)
    person = marked(height_m)
    q = arms_turned_inwards(person, rng)
    off = [replace(m, position_body=m.position_body + rng.normal(0, 0.008, 3)) for m in person.markers]
    x = marker_positions(person.with_markers(off), q) + rng.normal(0, 0.001, (FRAMES, len(off), 3))
    kept = [i for i, marker in enumerate(off) if marker.name not in without]
    body = marked()
    body = body.with_markers([m for m in body.markers if m.name not in without])
    settings = KinematicsSettings()
    fitted = calibrate(body, choose_frames([x[:, kept]], None, settings), settings).skeleton
    found = inverse_kinematics(fitted, x[:, kept], 100.0, settings)
    return dict(zip(body.dofs, q.T, strict=True)), dict(zip(body.dofs, found.T, strict=True))


@pytest.mark.parametrize(("seed", "height_m"), [(1, 1.75), (4, 1.75), (5, 1.35), (8, 1.75)])
def test_an_elbow_with_one_marker_beyond_it_bends_as_elbows_do(seed, height_m):
    true, found = fitted_arms(seed, height_m)
    for elbow in ("elbow_flex_r", "elbow_flex_l"):
        assert found[elbow].min() > 0
        assert np.corrcoef(found[elbow], true[elbow])[0, 1] > 0.9


@pytest.mark.parametrize("without", [("LWRA", "RWRA"), ("LELB", "RELB")])
@pytest.mark.parametrize("seed", [0, 3])
def test_what_a_lone_elbow_or_wrist_marker_leaves_free_stays_near_neutral(seed, without):
    _, found = fitted_arms(seed, 1.75, without)
    for side in "rl":
        assert np.abs(found[f"arm_rot_{side}"]).max() < np.radians(15)
        assert found[f"elbow_flex_{side}"].min() > np.radians(-5)
