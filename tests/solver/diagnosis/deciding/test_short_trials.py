"""Short trials as they are stated: what right plates would record of them."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.gravity import GRAVITY
from solver.diagnosis.deciding.short_trials import IDS, PLANNED, SCALE, short_trials
from solver.simulate.ground_demand import GroundDemand
from solver.skeleton.pinocchio_model import RigidBodyModel

QUIET = slice(10, -10)  # frames away from the filter's ends


@pytest.fixture(scope="module")
def planned(short_scene):
    """By kind, each with its scene."""
    return {t.kind.id: (t, t.scene(short_scene)) for t in short_trials(short_scene, ["plate_2"])}


def about_plate(scene, target):
    """Force, and where it acts on the floor about the plate's middle."""
    plate = next(p for p in scene.plates if p.target == target)
    F, M = plate.wrench_ground[QUIET, :3], plate.wrench_ground[QUIET, 3:]
    at = np.stack([M[:, 2] / F[:, 1], -M[:, 0] / F[:, 1]], axis=1)
    return F, at - plate.centre_ground[[0, 2]]


def test_every_kind_is_planned_but_what_needs_plates_side_by_side(planned):
    assert set(IDS) - {"shift"} == set(planned)
    assert all(scene is not None and scene.name == PLANNED for _, scene in planned.values())


def test_who_was_on_a_scale_is_not_sent_there_again(short_scene):
    assert SCALE.id not in {t.kind.id for t in short_trials(replace(short_scene, scale_factor=1.0), [])}


@pytest.mark.parametrize("kind", ["stand", "squat", "arms", "again", "faster", "back"])
def test_plates_bear_what_the_motion_demands(planned, kind):
    """Of another program's inverse dynamics; half a turn leaves the vertical force as it is."""
    _, scene = planned[kind]
    motion = scene.motion
    demand = GroundDemand(RigidBodyModel(scene.skeleton)).wrench(
        motion.q, motion.velocity, motion.acceleration
    )
    assert scene.required_ground[:, 1] == pytest.approx(demand[:, 1], abs=1e-6)
    on = scene.counts[QUIET] & (np.sum([p.loaded for p in scene.plates], axis=0)[QUIET] > 0)
    measured = scene.measured_ground[QUIET][on]
    assert np.abs(measured - scene.required_ground[QUIET][on])[:, :3].mean() < 0.02 * scene.weight_N


def test_who_stands_still_is_carried_by_one_plate_alone(planned):
    trial, scene = planned["stand"]
    assert trial.words == "stand still on plate_2 for 3 s"
    force, beside = about_plate(scene, "plate_2")
    assert force[:, 1] == pytest.approx(scene.skeleton.mass * GRAVITY, rel=0.01)
    assert np.abs(beside).max() < 0.03
    assert [p.target for p in scene.plates if p.loaded.any()] == ["plate_2"]


def test_facing_the_other_way_turns_the_body_over_the_plate(planned):
    straight, turned = (planned[kind][1] for kind in ("stand", "turned"))
    plate = next(p for p in straight.plates if p.target == "plate_2")
    middle = plate.centre_ground[[0, 2]]
    hand = straight.skeleton.body_index("hand_r")
    before, after = (s.p_ground_body[:, hand][:, [0, 2]] - middle for s in (straight, turned))
    assert after == pytest.approx(-before)
    assert turned.p_ground_body[:, hand, 1] == pytest.approx(straight.p_ground_body[:, hand, 1])


def test_a_squat_lowers_the_body_with_the_feet_in_place(planned):
    scene = planned["squat"][1]
    feet = [scene.skeleton.body_index(name) for name in scene.contacts.foot_bodies]
    assert np.ptp(scene.p_ground_body[:, feet, 1].mean(axis=1)) < 1e-6
    assert np.ptp(scene.com_ground[:, 1]) > 0.15


def test_who_walks_back_is_carried_by_the_plate_that_lies_there(planned, short_scene):
    again, back = (planned[kind][1] for kind in ("again", "back"))
    loads = [[p.wrench_ground[:, 1].sum() for p in scene.plates] for scene in (again, back)]
    assert loads[1] == pytest.approx(loads[0][::-1], rel=0.02)
    there, then = (s.com_ground[-1] - s.com_ground[0] for s in (again, back))
    assert then[[0, 2]] == pytest.approx(-there[[0, 2]])


def test_faster_takes_less_time_and_larger_forces_to_accelerate(planned):
    again, faster = (planned[kind][1] for kind in ("again", "faster"))
    assert faster.frames < again.frames
    assert np.ptp(faster.required_ground[QUIET, 0]) > 1.2 * np.ptp(again.required_ground[QUIET, 0])
