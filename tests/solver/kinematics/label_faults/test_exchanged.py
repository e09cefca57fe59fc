"""Pairs exchanged by hand are found with their frames; what a distance cannot tell is left."""

import numpy as np
import pytest

from solver.kinematics.label_faults.rigid_neighbours import rigid_neighbours
from solver.kinematics.label_faults.settings import LabelRepairSettings
from solver.kinematics.label_faults.wrong_labels import exchanged_back, exchanged_pairs

SETTINGS = LabelRepairSettings()
PELVIS, OTHERS, FEMUR = (0, 2), (1, 3), (4, 5)  # the last alike to their only neighbour but for 14 mm


def on_the_model(crane):
    x = np.array([marker.position_body for marker in crane.markers])
    body = np.array([marker.body for marker in crane.markers])
    distance = np.linalg.norm(x[:, None] - x[None], axis=2)
    return np.where(body[:, None] == body, distance, np.nan)


@pytest.fixture
def found(swinging, crane):
    def look(x, elsewhere_m=None):
        rigid = rigid_neighbours(x, crane)
        nowhere = np.full(rigid.usual_m.shape, np.nan)
        return exchanged_pairs(rigid, nowhere if elsewhere_m is None else elsewhere_m, swinging.rate)

    return look


def test_sound_labels(found, swinging):
    assert found(swinging.positions_ground) == ()


@pytest.mark.parametrize(
    ("pair", "start", "end"),
    [(PELVIS, 100, 160), (PELVIS, 0, 90), (PELVIS, 230, 300), (PELVIS, 50, 55), (FEMUR, 40, 130)],
)
def test_an_exchange(found, swinging, pair, start, end):
    (swap,) = found(exchanged_back(swinging.positions_ground, pair, start, end))
    assert (swap.pair, swap.start, swap.end) == (pair, start, end)
    assert swap.repaired_off_m < 0.003
    assert swap.off_m > 0.012


def test_two_stretches_of_one_pair_and_a_second_pair(found, swinging):
    x = swinging.positions_ground
    for pair, start, end in ((PELVIS, 20, 60), (PELVIS, 200, 240), (OTHERS, 100, 150)):
        x = exchanged_back(x, pair, start, end)
    assert sorted((s.pair, s.start, s.end) for s in found(x)) == [
        (PELVIS, 20, 60),
        (PELVIS, 200, 240),
        (OTHERS, 100, 150),
    ]


def test_an_exchange_within_a_gap_where_only_one_label_is_seen_at_first(found, swinging):
    x = exchanged_back(swinging.positions_ground, PELVIS, 100, 160)
    x[95:105, list(PELVIS)] = np.nan
    x[105:112, PELVIS[0]] = np.nan
    (swap,) = found(x)
    assert (swap.pair, swap.start, swap.end) == (PELVIS, 105, 160)


def test_most_of_the_trial_exchanged_is_seen_where_distances_are_known_from_elsewhere(found, swinging, crane):
    """Without them the rest looks exchanged: what holds for most frames is taken for right."""
    x = exchanged_back(swinging.positions_ground, PELVIS, 80, 300)
    (wrong,) = found(x)
    assert (wrong.start, wrong.end, wrong.named_right) == (0, 80, True)
    (known,) = found(x, on_the_model(crane))
    assert not known.named_right
    (right,) = found(exchanged_back(swinging.positions_ground, PELVIS, 80, 150), on_the_model(crane))
    assert right.named_right


def test_a_marker_elsewhere_is_no_exchange(found, swinging):
    x = swinging.positions_ground.copy()
    x[100:160, 0] += 0.1
    assert found(x) == ()


def test_exchanging_twice_is_nothing(swinging):
    x = swinging.positions_ground
    once = exchanged_back(x, PELVIS, 10, 20)
    np.testing.assert_array_equal(once[10:20, 0], x[10:20, 2])
    np.testing.assert_array_equal(exchanged_back(once, PELVIS, 10, 20), x)
