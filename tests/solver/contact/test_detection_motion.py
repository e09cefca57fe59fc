import numpy as np
import pytest

from solver.contact.detection_search import ground_odds, slip_speeds, touching_unloaded
from solver.contact.detection_settings import DetectionSettings
from solver.contact.sole import soles
from solver.contact.wrenches import ContactWrenches

RATE = 100.0
SETTINGS = DetectionSettings()


def slip_of(scene, loaded):
    corners = [sole.corners_ground(*scene.poses()) for sole in soles(scene.skeleton, ("calcn_r", "calcn_l"))]
    return slip_speeds(corners, loaded, RATE)


def test_standing_feet_don_t_slip_on_the_floor_and_swinging_ones_do(walk):
    slip = slip_of(walk, walk.loads > 20)
    odds = ground_odds(slip)
    measured, swinging = walk.loads > 20, walk.ankles[:, :, 1] > walk.ankles[:, :, 1].min() + 0.03
    assert (odds[measured] > 0).mean() > 0.95
    assert (odds[swinging] < 0).mean() > 0.95


def test_a_belt_is_found_out_and_carries_standing_feet(treadmill_walk):
    slip = slip_of(treadmill_walk, treadmill_walk.loads > 20)
    measured = treadmill_walk.loads > 20
    assert np.median(slip[measured]) < 0.05  # m/s, on a belt of 1.3 m/s
    assert (ground_odds(slip)[measured] > 0).mean() > 0.95


def test_on_a_belt_an_unmeasured_stance_is_as_good_as_a_measured_one(treadmill_walk):
    """Only the right foot's plate works; the left foot stands all the same."""
    loaded = treadmill_walk.loads > 20
    left = loaded[:, 1].copy()
    loaded[:, 1] = False
    odds = ground_odds(slip_of(treadmill_walk, loaded))
    assert (odds[left, 1] > 0).mean() > 0.95


def test_a_step_at_any_height_is_a_step(walk):
    """The same walk a metre higher up."""
    raised = type(walk)(walk.skeleton, walk.ankles + np.array([0.0, 1.0, 0.0]), walk.loads, walk.under)
    np.testing.assert_allclose(slip_of(raised, raised.loads > 20), slip_of(walk, walk.loads > 20), atol=1e-9)


def right_foot(load_N, plates):
    """A right foot with this vertical load; it stands still, and the left one is in the air."""
    frames = len(load_N)
    wrench = np.zeros((frames, 2, 6))
    wrench[:, 0, 1] = load_N
    return ContactWrenches(
        foot_bodies=("calcn_r", "calcn_l"),
        wrench_ground=wrench,
        cop_ground=np.full((frames, 2, 3), np.nan),
        observed=np.ones(frames, dtype=bool),
        in_contact=wrench[..., 1] > 20,
        plate=np.asarray(plates),
        wrench_raw_ground=wrench,
    )


FADES_OUT_AND_IN = [700, 300, 60, 0, 0, 0, 40, 200, 700]
ONE_PLATE = [[0]] * 9
STILL = np.column_stack([np.full(9, 2.5), np.full(9, -2.5)])


@pytest.mark.parametrize(
    ("load_N", "plates", "ground", "rate", "touches"),
    [
        (FADES_OUT_AND_IN, ONE_PLATE, STILL, 100.0, [3, 4, 5]),
        (FADES_OUT_AND_IN, ONE_PLATE, STILL, 10.0, []),  # 0.3 s: a foot that stands so long carries something
        ([700, 700, 700, 0, 0, 0, 700, 700, 700], ONE_PLATE, STILL, 100.0, []),  # the plate dropped out
        (FADES_OUT_AND_IN, [[0, -1]] * 4 + [[-1, 0]] * 5, STILL, 100.0, []),  # it stepped to another plate
        (
            FADES_OUT_AND_IN,
            ONE_PLATE,
            np.where(np.arange(9)[:, None] == 4, -1.0, STILL),
            100.0,
            [],
        ),  # it moved
        ([700, 300, 60, 0, 0, 0, 0, 0, 0], ONE_PLATE, STILL, 100.0, []),  # never loaded again
    ],
)
def test_a_foot_that_keeps_still_between_two_fading_loads_touches_its_plate(
    load_N, plates, ground, rate, touches
):
    found = touching_unloaded(right_foot(load_N, plates), ground, 750.0, rate)
    assert np.flatnonzero(found[:, 0]).tolist() == touches
    assert not found[:, 1].any()
