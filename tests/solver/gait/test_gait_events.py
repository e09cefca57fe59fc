"""Stances by hand: a sole that stops and leaves, a plate that is loaded, and both together."""

import numpy as np
import pytest

from solver.capture.capture import FootEvent, ForcePlate
from solver.capture.plates.force_settings import CONDITIONING
from solver.gait import foot_motion as of_feet
from solver.gait.cycles import cycles_of
from solver.gait.foot_motion import foot_motion
from solver.gait.gait_events import (
    Kind,
    Source,
    Stance,
    events_of,
    stances_as_stated,
    stances_from_feet,
    stances_from_plates,
    stances_of_both,
)
from solver.gait.settings import GAIT
from solver.gait.trial_gait import joint_power

RATE, STRIDE_S, SPEED = 100.0, 1.1, 1.3
STANCE_S = 0.66


def heel(times, phase_s):
    """A foot that stands for 0.66 s and swings a stride ahead by a smooth step, twelve centimetres high."""
    k, u = np.divmod(times - phase_s, STRIDE_S)
    swing = np.clip((u - STANCE_S) / (STRIDE_S - STANCE_S), 0.0, 1.0)
    forward = SPEED * phase_s + SPEED * STRIDE_S * (k + 10 * swing**3 - 15 * swing**4 + 6 * swing**5)
    up = 0.12 * np.sin(np.pi * swing) ** 2
    return np.column_stack([forward, up, np.zeros_like(times)])


def soles_of(times, belt_m_s=0.0):
    """Two flat soles, ten centimetres apart from the middle; on a belt, everything moves back."""
    back = np.column_stack([belt_m_s * times, 0 * times, 0 * times])
    corners = np.array([[0.0, 0.0, -0.04], [0.0, 0.0, 0.04], [0.22, 0.0, -0.04], [0.22, 0.0, 0.04]])
    feet = [heel(times, phase) - back + [0.0, 0.0, side] for phase, side in ((0.0, 0.1), (0.55, -0.1))]
    root = np.column_stack([(SPEED - belt_m_s) * times, 0.9 + 0 * times, 0 * times])
    return [foot[:, None] + corners for foot in feet], feet, root


@pytest.fixture(params=[0.0, SPEED], ids=["floor", "belt"])
def walk(request):
    times = 2.0 + np.arange(400) / RATE
    corners, heels, root = soles_of(times, request.param)
    return times, corners, heels, foot_motion(corners, root, times, GAIT)


def test_soles_of_a_long_trial_move_as_by_one_spline(monkeypatch):
    times = np.arange(2000) / RATE
    corners, _, root = soles_of(times, SPEED)
    whole = foot_motion(corners, root, times, GAIT)
    monkeypatch.setattr(of_feet, "FRAMES_AT_ONCE", 500)  # of 500 steps a second, some 8192 are read together
    parts = foot_motion(corners, root, times, GAIT)

    for name in ("slip", "surface", "pace", "sole"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=0, atol=1e-9)


def test_slip_alone_finds_every_stance(walk):
    times, _, _, motion = walk
    stances = stances_from_feet(motion)
    for foot, phase in ((0, 0.0), (1, 0.55)):
        own = [stance for stance in stances if stance.foot == foot]
        contacts = [s.contact_s for s in own if s.contact_s is not None]
        offs = [s.off_s for s in own if s.off_s is not None]
        expected = phase + STRIDE_S * np.arange(10)
        inside = expected[(expected > times[0] + 0.1) & (expected < times[-1] - 0.1)]
        assert np.abs(np.array(contacts)[:, None] - inside).min(axis=0).max() < 0.09
        assert len(contacts) == len(inside)
        leaving = (expected + STANCE_S)[
            (expected + STANCE_S > times[0]) & (expected + STANCE_S < times[-1] - 0.1)
        ]
        assert np.abs(np.array(offs)[:, None] - leaving).min(axis=0).max() < 0.12


def test_figures_are_the_walk_that_was_made(walk):
    """Over a belt as over a floor: a foot's travel is the surface's and its own."""
    times, _, heels, motion = walk
    cycles = cycles_of(stances_from_feet(motion), motion, heels, times)
    assert len(cycles) >= 4
    for cycle in cycles:
        assert cycle.duration_s == pytest.approx(STRIDE_S, abs=0.01)
        assert cycle.stride_length_m == pytest.approx(SPEED * STRIDE_S, rel=0.01)
        assert cycle.speed_m_s == pytest.approx(SPEED, rel=0.01)
        assert cycle.cadence_per_min == pytest.approx(120 / STRIDE_S, rel=0.01)
        assert cycle.step_length_m == pytest.approx(SPEED * STRIDE_S / 2, rel=0.05)
        assert cycle.step_width_m == pytest.approx(0.2, abs=0.01)


def plate_with(load, rate=1000.0):
    force = np.column_stack([0 * load, load, 0 * load])
    point = np.where(load[:, None] > 20, [0.1, 0.0, 0.1], np.nan)
    moment = np.nan_to_num(np.cross(np.nan_to_num(point), force))
    return ForcePlate("plate 1", force, moment, point, rate, 2.0)


def test_a_plate_tells_to_a_fraction_of_its_samples(walk):
    """A ramp of 4 N a sample crosses 20 N five samples after it left zero."""
    times, corners, _, _ = walk
    load = np.interp(np.arange(3000), [0, 500, 700, 1000, 1200, 3000], [0, 0, 800, 800, 0, 0])
    (stance,) = stances_from_plates([plate_with(load)], corners, times, GAIT, CONDITIONING)
    assert stance.source == Source.FORCE
    assert stance.contact_s == pytest.approx(2.505, abs=1e-4)
    assert stance.off_s == pytest.approx(3.195, abs=1e-4)


@pytest.mark.parametrize(("first", "end"), [(0, 650), (850, 1000), (1150, 3000)])
def test_a_stance_that_was_not_recorded_whole_has_no_event_where_the_recording_stops(walk, first, end):
    times, corners, _, _ = walk
    load = np.interp(np.arange(3000), [0, 500, 700, 1000, 1200, 3000], [0, 0, 800, 800, 0, 0])
    load[first:end] = np.nan
    assert stances_from_plates([plate_with(load)], corners, times, GAIT, CONDITIONING) == ()


def test_a_foot_that_swings_past_at_mid_stance_does_not_take_the_plate(walk):
    """The left sole stands ahead of the pressure; the right one passes right over it, and is then far."""
    times, corners, _, _ = walk
    load = np.interp(np.arange(3000), [0, 500, 700, 1000, 1200, 3000], [0, 0, 800, 800, 0, 0])
    plate = plate_with(load)
    standing, passing = np.zeros_like(corners[0]), np.zeros_like(corners[1])
    standing[:] = [0.2, 0.0, 0.1]
    passing[:] = [0.1, 0.0, 0.1]
    passing[..., 0] += 2.0 * (times - 2.85)[:, None]
    (stance,) = stances_from_plates([plate], [standing, passing], times, GAIT, CONDITIONING)
    assert stance.foot == 0


def test_a_short_knock_and_a_touch_are_no_stances(walk):
    times, corners, _, _ = walk
    load = np.zeros(3000)
    load[500:540], load[1000:1300] = 900.0, 100.0
    assert stances_from_plates([plate_with(load)], corners, times, GAIT, CONDITIONING) == ()


def test_a_whole_stance_on_a_plate_goes_before_the_feet_and_a_part_of_one_does_not():
    feet = [
        Stance(0, 1.01, 1.72, Source.FEET),
        Stance(0, 2.1, 2.8, Source.FEET),
        Stance(1, 1.5, 2.2, Source.FEET),
    ]
    force = [
        Stance(0, 1.0, 1.7, Source.FORCE),
        Stance(0, 2.1, 2.4, Source.FORCE),
        Stance(1, 3.0, 3.6, Source.FORCE),
    ]
    assert stances_of_both(force, feet) == (force[0], feet[2], feet[1], force[2])
    first = events_of([force[0]])
    assert [(event.time_s, event.kind) for event in first] == [(1.0, Kind.CONTACT), (1.7, Kind.FOOT_OFF)]


def test_a_stance_begins_and_ends_when_the_file_says_so():
    feet = [
        Stance(0, None, 0.5, Source.FEET),
        Stance(0, 1.0, 1.7, Source.FEET),
        Stance(0, 2.0, 2.7, Source.FEET),
        Stance(1, 1.5, 2.2, Source.FEET),
    ]
    stated = [
        FootEvent(0.48, "Right", "Foot Off"),
        FootEvent(1.02, "Right", "Foot Strike"),
        FootEvent(1.69, "Right", "Foot Off"),
        FootEvent(2.01, "Right", "Foot Strike"),  # its foot-off is 0.2 s away
        FootEvent(2.5, "Right", "Foot Off"),
        FootEvent(1.51, "General", "Foot Strike"),
        FootEvent(2.19, "Right", "Foot Off"),
    ]
    assert stances_as_stated(feet, stated, ("calcn_r", "calcn_l")) == (
        Stance(0, None, 0.48, Source.FILE),
        Stance(0, 1.02, 1.69, Source.FILE),
        *feet[2:],
    )


def test_power_is_moment_times_velocity(small_fit):
    (trial, *_) = small_fit.trials
    power = joint_power(trial)
    if trial.dynamics is None:
        assert power is None
    else:
        np.testing.assert_array_equal(power, trial.dynamics.joint_torques * trial.dynamics.motion.velocity)
