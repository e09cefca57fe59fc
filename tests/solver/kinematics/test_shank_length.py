"""The shank, between epicondyles and malleoli: what the static trial shows, and what experts made of it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.fitting.settings import Settings
from solver.kinematics.calibration import calibrate, choose_frames
from solver.kinematics.default_body_naming import landmarks_by_name
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.settings import KinematicsSettings
from solver.markers.understanding import understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.osim import load_skeleton

SETTINGS = KinematicsSettings()
ENDS = ("knee_lateral", "knee_medial", "ankle_lateral", "ankle_medial")


def shank(skeleton, name_of):
    """From the middle of the epicondyles to that of the malleoli, knees straight, mean of both sides [m]."""
    q = skeleton.default_q.copy()
    q[[i for i, dof in enumerate(skeleton.dofs) if dof.startswith("knee_angle")]] = 0.0
    place = dict(zip(skeleton.marker_names, marker_positions(skeleton, q[None])[0], strict=True))
    both = []
    for side in "rl":
        outer, inner, outer_ankle, inner_ankle = (place[name_of[f"{end}_{side}"]] for end in ENDS)
        both.append(np.linalg.norm((outer + inner - outer_ankle - inner_ankle) / 2))
    return float(np.mean(both))


@cache
def calibrated(folder, trial):
    """The default body on a recording, and its labels by landmark."""
    subject = replace(open_subject(folder), model=None)
    files = next(t for t in subject.trials if t.name == trial)
    moving = read_trial(files, Settings().reading).markers
    static = read_static(subject.static, Settings().reading).markers
    named = name_markers(default_skeleton(mass_kg=subject.mass_kg), [moving, static], default_body=True)
    observed = named.match.observed
    frames = choose_frames([observed(moving)], observed(static), SETTINGS)
    found = calibrate(named.match.skeleton(named.skeleton), frames, SETTINGS).skeleton
    return found, landmarks_by_name(named.match)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("folder", "trial", "by_hand"),
    [
        ("opencap_subject4", "walking1", "manually_scaled.osim"),
        ("opencap_subject6", "walking1", "hand_scaled.osim"),
        ("walk_gait2354_subject01", "walk1", "subject01_simbody.osim"),
        ("sprint_overground_dorn2012_JA1_9ms", "run0900cms", "hand_scaled.osim"),
        ("sprint_overground_dorn2012_JA1_9ms", "run0900cms", "JA1_SCALED_Osim40.osim"),
    ],
)
def test_the_default_body_has_the_shanks_of_models_that_experts_scaled(real_data, folder, trial, by_hand):
    found, ours = calibrated(real_data / folder, trial)
    expert = load_skeleton(real_data / folder / "reference" / by_hand)
    theirs = {row.landmark: row.label for row in understand(expert.marker_names).labels if row.landmark}
    assert shank(found, ours) == pytest.approx(shank(expert, theirs), abs=0.010)
