"""Notes on markers that lie far off: what they ask about."""

from dataclasses import replace

import numpy as np
import pytest

from solver.kinematics.marker_errors import marker_errors, shoulder_markers, turned_head
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.rotations import rotation_about

NAMES = ("RSHO", "LSHO", "C7", "RASI", "LASI")
FRAMES = slice(10, 20)


def marked(names, frames=40):
    """The default body with these markers, and where they are; it looks along x, its right is z."""
    skeleton = default_skeleton()
    by_name = {m.name: m for m in skeleton.markers}
    skeleton = skeleton.with_markers([by_name[name] for name in names])
    return skeleton, marker_positions(skeleton, np.tile(skeleton.default_q, (frames, 1)))


@pytest.fixture(scope="module")
def standing():
    return marked(NAMES)


def notes_of(standing, marker, moved):
    skeleton, model = standing
    measured = model.copy()
    measured[FRAMES, NAMES.index(marker)] += moved
    errors, notes = marker_errors(skeleton, NAMES, model, measured, KinematicsSettings())
    assert errors.maximum == pytest.approx(np.linalg.norm(moved))
    return notes


@pytest.mark.parametrize(("marker", "inwards"), [("RSHO", -1), ("LSHO", 1)])
def test_a_shoulder_that_rises(standing, marker, inwards):
    (note,) = notes_of(standing, marker, [-0.01, 0.06, 0.05 * inwards])
    assert note == (
        f"marker {marker} is up to 8 cm off in frames 10-19: the shoulder rose? The model has no shoulder "
        "girdle."
    )


@pytest.mark.parametrize(
    ("marker", "moved"),
    [
        ("RSHO", (0.0, 0.06, 0.05)),  # outwards
        ("RSHO", (0.0, 0.08, 0.0)),  # straight up
        ("RSHO", (0.0, 0.0, -0.08)),  # straight inwards
        ("RSHO", (0.0, 0.11, -0.11)),  # too far
        ("RSHO", (0.0, -0.06, -0.05)),  # downwards
        ("RSHO", (0.08, 0.0, 0.0)),
        ("C7", (0.0, 0.08, 0.0)),
        ("RASI", (0.0, 0.06, -0.05)),
    ],
)
def test_what_else_is_far_off_may_have_slipped(standing, marker, moved):
    (note,) = notes_of(standing, marker, moved)
    assert "slipped, swapped or mislabelled?" in note


@pytest.mark.parametrize("other", ["C7", "RFHD", "LBHD"])
def test_a_shoulder_on_another_trajectory_may_be_mislabelled(other):
    names = ("RSHO", "LSHO", other)
    skeleton, model = marked(names)
    measured = model.copy()
    measured[FRAMES, 0] = model[FRAMES, 2]
    _, notes = marker_errors(skeleton, names, model, measured, KinematicsSettings())
    assert "slipped, swapped or mislabelled?" in notes[0]


def test_a_shoulder_that_rises_on_few_of_its_far_frames(standing):
    """Most of them say what is asked."""
    skeleton, model = standing
    measured = model.copy()
    measured[FRAMES, 0] += [0.0, 0.0, 0.08]
    measured[10:13, 0] = model[10:13, 0] + [0.0, 0.06, -0.05]
    _, notes = marker_errors(skeleton, NAMES, model, measured, KinematicsSettings())
    assert "slipped, swapped or mislabelled?" in notes[0]


def test_near_markers_have_no_note(standing):
    assert notes_of(standing, "RSHO", (0.0, 0.03, -0.03)) == ()


def test_shoulder_markers_are_those_on_the_trunk_beside_the_joints():
    found = shoulder_markers(default_skeleton())
    assert {"RSHO", "LSHO", "R_Shoulder", "RACR"} <= found
    assert not found & {"C7", "CLAV", "RUPA", "RELB", "STRN"}


def test_a_trunk_with_one_arm_tells_no_shoulders():
    """As where a shoulder blade carries each arm."""
    skeleton = default_skeleton()
    left = next(i for i, name in enumerate(skeleton.body_names) if name == "humerus_l")
    joints = list(skeleton.joints)
    joints[left] = replace(joints[left], parent=skeleton.body_index("pelvis"))
    assert shoulder_markers(replace(skeleton, joints=tuple(joints))) == frozenset()


def test_one_shoulder_alone_tells_no_inside(standing):
    skeleton, model = standing
    measured = model.copy()
    measured[FRAMES, 0] += (0.0, 0.06, -0.05)
    skeleton = skeleton.with_markers([m for m in skeleton.markers if m.name != "LSHO"])
    rest = [i for i, name in enumerate(NAMES) if name != "LSHO"]
    names = tuple(NAMES[i] for i in rest)
    _, notes = marker_errors(skeleton, names, model[:, rest], measured[:, rest], KinematicsSettings())
    assert "slipped, swapped or mislabelled?" in notes[0]


HEAD = ("RFHD", "LFHD", "RBHD", "LBHD")


def turning(deg, head=HEAD):
    """A trunk that turns by 50° and a head that turns by `deg` against it, over 60 frames and back."""
    skeleton, x = marked((*head, "C7", "CLAV", "STRN", "RSHO", "LSHO", "RASI"), frames=60)
    there = np.sin(np.linspace(0, 2 * np.pi, 60)) ** 9
    neck = x[:, [len(head)]] * [1, 0, 1]
    x[:, : len(head)] = rotated(x[:, : len(head)] - neck, np.radians(deg) * there) + neck
    return skeleton, rotated(x, np.radians(50) * there[::-1])


def rotated(x, angle):
    return x @ rotation_about(np.array([0.0, 1.0, 0.0]), angle).transpose(0, 2, 1)


@pytest.mark.parametrize("deg", [40, 80])
@pytest.mark.parametrize("head", [HEAD, HEAD[:2]])
def test_a_head_that_turns_against_a_trunk_without_a_neck(deg, head):
    skeleton, x = turning(deg, head)
    found, turn = turned_head(skeleton, [turning(0, head)[1], x])
    assert found == head
    assert np.degrees(turn) == pytest.approx(deg, abs=4)  # not counting its two farthest frames


def test_a_head_that_hardly_turns_or_has_one_marker_stays():
    assert turned_head(turning(15)[0], [turning(15)[1]])[0] == ()
    assert turned_head(turning(80, HEAD[:1])[0], [turning(80, HEAD[:1])[1]])[0] == ()


@pytest.mark.parametrize("head", [HEAD, HEAD[:2]])
def test_two_exchanged_markers_are_no_turning_head(head):
    skeleton, x = turning(40, head)
    x[20:30, [0, 1]] = x[20:30, [1, 0]]
    assert turned_head(skeleton, [turning(40, head)[1], x])[0] == ()
