"""Puppets do what they are said to do: the skeleton's own geometry says so."""

import numpy as np
import pytest

from benchmarks.activities.kinematic_gaits import RATE, Hips, Plant, earlier, kinematic_gait, steps
from benchmarks.activities.performed import PERSONS, _scenes
from solver.common.gravity import GRAVITY
from solver.gait.activity import Activity
from solver.skeleton.forward import body_poses

WHO = kinematic_gait(7)


def moved(plants, duration, hips=None):
    motion = WHO.moved(plants, duration, np.random.default_rng(0), hips)
    return motion.times, body_poses(WHO.skeleton, motion.q)[1]


def test_a_foot_stays_on_its_tread_and_the_next_is_a_riser_higher():
    plants = earlier(steps([(0.3, 0.17)] * 6, 0.7), 1.0)
    times, p = moved(plants, 4.0)
    right = p[:, WHO.skeleton.body_index("talus_r")]
    one, following = (p for p in plants if p.foot == 0 and p.start > 0 and p.end < 4.0)
    levels = []
    for plant in (one, following):
        lasts = plant.end - plant.start
        flat = (times > plant.start + 0.25 * lasts) & (times < plant.start + 0.45 * lasts)
        assert np.ptp(right[flat], axis=0) == pytest.approx(0, abs=0.008)
        levels.append(np.median(right[flat], axis=0))
    assert levels[1] - levels[0] == pytest.approx([0.6, 0.34, 0.0], abs=0.004)


def test_who_is_in_the_air_falls_as_everything_does():
    feet = [
        Plant(foot, begin, end, 0.0, lands=lands, leaves=-0.6, flies=True)
        for foot in range(2)
        for begin, end, lands in ((-9.0, 1.0, 0.0), (1.4, 9.0, -0.6))
    ]
    speed = GRAVITY * 0.4 / 2 / WHO.stretched
    hips = Hips((0.0, 0.5, 1.0, 1.4, 1.8), (1.0, 0.7, 1.04, 1.04, 0.8), (0.0, 0.0, speed, -speed, 0.0))
    times, p = moved(feet, 2.0, hips)
    air = (times > 1.0) & (times < 1.4)
    for body in ("pelvis", "talus_r", "talus_l"):
        height = p[air, WHO.skeleton.body_index(body), 1]
        assert 2 * np.polyfit(times[air], height, 2)[0] == pytest.approx(-GRAVITY, rel=0.02)


def test_nobody_stands_twice_at_once_and_all_that_is_judged_is_in_the_trial():
    scenes = list(_scenes(WHO, np.random.default_rng(PERSONS[0])))
    assert {activity for _, activity, *_ in scenes} >= {
        Activity.STAIRS, Activity.LUNGE, Activity.JUMP, Activity.TRANSITION, Activity.STANDING,
    }  # fmt: skip
    for _, _, _, plants, duration, _, during in scenes:
        for foot in range(2):
            times = [t for p in plants if p.foot == foot for t in (p.start, p.end)]
            assert times == sorted(times)
            assert times[0] <= 0
            assert times[-1] >= duration
        begin, end = during or (0.0, duration)
        assert 0 <= begin < end <= duration + 1 / RATE
