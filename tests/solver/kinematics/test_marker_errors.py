"""Notes on markers that lie far off: what they ask about."""

import numpy as np
import pytest

from solver.kinematics.marker_errors import marker_errors
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions

NAMES = ("RSHO", "LSHO", "C7", "RASI", "LASI")
FRAMES = slice(10, 20)


@pytest.fixture(scope="module")
def standing():
    """The default body's upper markers over 40 frames; it looks along x, its right is z."""
    skeleton = default_skeleton()
    by_name = {m.name: m for m in skeleton.markers}
    skeleton = skeleton.with_markers([by_name[name] for name in NAMES])
    return skeleton, marker_positions(skeleton, np.tile(skeleton.default_q, (40, 1)))


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
        "girdle. It had little weight there"
    )


@pytest.mark.parametrize(
    ("marker", "moved"),
    [
        ("RSHO", (0.0, 0.06, 0.05)),  # outwards
        ("RSHO", (0.0, -0.06, -0.05)),  # downwards
        ("RSHO", (0.08, 0.0, 0.0)),
        ("C7", (0.0, 0.08, 0.0)),
        ("RASI", (0.0, 0.06, -0.05)),
    ],
)
def test_what_else_is_far_off_may_have_slipped(standing, marker, moved):
    (note,) = notes_of(standing, marker, moved)
    assert "slipped, swapped or mislabelled?" in note


def test_near_markers_have_no_note(standing):
    assert notes_of(standing, "RSHO", (0.0, 0.03, -0.03)) == ()


def test_one_shoulder_alone_tells_no_inside(standing):
    skeleton, model = standing
    measured = model.copy()
    measured[FRAMES, 0] += (0.0, 0.06, -0.05)
    skeleton = skeleton.with_markers([m for m in skeleton.markers if m.name != "LSHO"])
    rest = [i for i, name in enumerate(NAMES) if name != "LSHO"]
    names = tuple(NAMES[i] for i in rest)
    _, notes = marker_errors(skeleton, names, model[:, rest], measured[:, rest], KinematicsSettings())
    assert "slipped, swapped or mislabelled?" in notes[0]
