"""Labels put elsewhere by hand are found; slips, loose neighbours and movement are not taken for that."""

import numpy as np
import pytest

from solver.kinematics.label_faults.rigid_neighbours import rigid_neighbours
from solver.kinematics.label_faults.settings import LabelRepairSettings
from solver.kinematics.label_faults.wrong_labels import crashed_labels

SETTINGS = LabelRepairSettings()
MARKER, OTHER = 1, 12  # on the pelvis, on the foot


@pytest.fixture
def found(swinging, crane):
    def look(x, beside=None):
        rigid = rigid_neighbours(x, crane)
        all_labels = x if beside is None else np.concatenate([x, beside[:, None]], axis=1)
        own = tuple(range(x.shape[1]))
        return [
            (c.marker, c.start, c.end, c.onto) for c in crashed_labels(rigid, all_labels, own, swinging.rate)
        ]

    return look


def test_sound_labels(found, swinging):
    assert found(swinging.positions_ground) == []


def test_a_ghost_fixed_in_the_room(found, swinging):
    x = swinging.positions_ground.copy()
    x[100:160, MARKER] = x[100, MARKER] + np.array([0.3, 0.1, 0.0])
    assert found(x) == [(MARKER, 100, 160, None)]


@pytest.mark.parametrize(("start", "end"), [(100, 160), (0, 60), (240, 300)])
def test_another_markers_trajectory(found, swinging, start, end):
    x = swinging.positions_ground.copy()
    x[start:end, MARKER] = x[start:end, OTHER] + 0.002
    assert found(x) == [(MARKER, start, end, OTHER)]


def test_the_trajectory_of_a_label_that_the_model_lacks(found, swinging):
    x = swinging.positions_ground.copy()
    beside = x[:, MARKER] + np.array([0.0, 0.12, 0.0])
    x[100:160, MARKER] = beside[100:160]
    assert found(x, beside) == [(MARKER, 100, 160, x.shape[1])]


def test_two_labels_at_once(found, swinging):
    x = swinging.positions_ground.copy()
    x[100:160, MARKER] += 0.1
    x[130:190, 8] -= 0.1
    assert sorted(found(x)) == [(MARKER, 100, 160, None), (8, 130, 190, None)]


def test_a_marker_that_slipped_is_left_to_the_diagnosis(found, swinging, crane):
    """It stays at another place of its segment."""
    x = swinging.positions_ground.copy()
    a, b, c = x[200:, 0], x[200:, 2], x[200:, 3]
    along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    across = np.cross(along, c - a)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    x[200:, MARKER] += 0.1 * along + 0.06 * across
    assert found(x) == []


def test_what_leaves_gradually_is_movement(found, swinging):
    x = swinging.positions_ground.copy()
    x[100:200, MARKER] += 0.15 * np.sin(np.linspace(0, np.pi, 100))[:, None] ** 2
    assert found(x) == []


def test_where_no_two_neighbours_agree_nothing_is_said(found, swinging):
    x = swinging.positions_ground.copy()
    x[100:160, [0, 1, 2]] += np.random.default_rng(0).normal(0, 0.2, (1, 3, 3))
    assert all(start >= 100 and end <= 160 for _, start, end, _ in found(x))
    x[:, [0, 2, 3]] = np.nan
    assert found(x) == []
