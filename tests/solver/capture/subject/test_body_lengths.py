"""Points of a solved skeleton are its joints: each keeps its distance from neighbours that move."""

import numpy as np
import pytest

from solver.capture.capture import Markers, TrialFiles
from solver.capture.formats.recording_files import read_markers
from solver.capture.formats.trc import write_trc
from solver.capture.subject.body_lengths import joints_of_a_skeleton
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError

PARENT = {
    "Hips": None, "Spine": "Hips", "Chest": "Spine", "Head": "Chest",
    "LeftUpLeg": "Hips", "LeftLeg": "LeftUpLeg", "LeftFoot": "LeftLeg", "LeftToe": "LeftFoot",
    "RightUpLeg": "Hips", "RightLeg": "RightUpLeg", "RightFoot": "RightLeg", "RightToe": "RightFoot",
    "LeftArm": "Chest", "LeftForeArm": "LeftArm", "LeftHand": "LeftForeArm",
    "RightArm": "Chest", "RightForeArm": "RightArm", "RightHand": "RightForeArm",
}  # fmt: skip
RECORDED = (
    "opencap_subject4/MarkerData/walking1.trc",
    "walk_gait2354_subject01/subject01_walk1.trc",
    "synthetic_arnold2013_subject01/markers.trc",
)


def suit(seed, frames=120, swing=0.5):
    """Bones of fixed lengths that swing about where they hang."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 2 * np.pi, frames)
    points = {}
    for name, parent in PARENT.items():
        if parent is None:
            points[name] = np.column_stack([0.5 * time, 1 + 0.02 * np.sin(2 * time), 0 * time])
            continue
        upwards = 1.0 if name in ("Spine", "Chest", "Head") else -1.0
        aim = rng.normal(0, 0.4, 3) + np.array([0, upwards, 0])
        ways = aim + swing * np.sin(time[:, None] + rng.uniform(0, 6, 3))
        ways *= rng.uniform(0.15, 0.45) / np.linalg.norm(ways, axis=1, keepdims=True)
        points[name] = points[parent] + ways
    return Markers(tuple(points), np.stack(list(points.values()), axis=1), 60.0)


@pytest.mark.parametrize("seed", range(5))
def test_joints_of_a_suit_are_told_whatever_they_are_called(seed):
    markers = suit(seed)
    renamed = Markers(tuple(f"P{k}" for k in range(len(markers.names))), markers.positions_ground, 60.0)
    assert len(joints_of_a_skeleton(markers)) == len(joints_of_a_skeleton(renamed)) >= 6


def test_markers_on_skin_are_none():
    """A centimetre of soft tissue, and points that nobody moves."""
    markers = suit(1)
    noise = np.random.default_rng(2).normal(0, 0.003, markers.positions_ground.shape)
    assert not joints_of_a_skeleton(Markers(markers.names, markers.positions_ground + noise, 60.0))
    assert not joints_of_a_skeleton(suit(1, swing=0.0))


@pytest.mark.real
@pytest.mark.parametrize("file", RECORDED)
def test_no_recorded_markers_are_taken_for_joints(real_data, file):
    assert not joints_of_a_skeleton(read_markers(real_data / file, None).upright)


def test_a_trial_of_joints_is_refused_with_a_reason(tmp_path):
    write_trc(tmp_path / "walk.trc", suit(3))
    with pytest.raises(CaptureError, match=r"joints of a skeleton .*not markers"):
        read_trial(TrialFiles("walk", tmp_path / "walk.trc"))
