import numpy as np
import pytest

from solver.contact.detection_balance import BALANCE_NOISE, UP, BodyMotion, WholeBody, jumps
from solver.contact.detection_settings import DetectionSettings

RATE, FRAMES, MASS, GRAVITY = 100.0, 300, 70.0, 9.80665
SETTINGS = DetectionSettings()
TIME = np.arange(FRAMES) / RATE


def body_of(com, angular=None, cutoff=SETTINGS.balance_cutoff_Hz):
    angular = np.zeros_like(com) if angular is None else angular
    motion = BodyMotion(com, angular, np.ones(len(com), dtype=bool), RATE, MASS, GRAVITY)
    return WholeBody(motion, cutoff)


@pytest.fixture
def bouncing():
    """A point mass that bounces at 2 Hz while it drifts, and the force that does it: F = m (z̈ + g)."""
    wave = 2 * np.pi * 2.0
    com = np.column_stack([1.2 * TIME, 0.9 + 0.03 * np.sin(wave * TIME), 0.01 * np.cos(wave * TIME)])
    force = np.zeros((FRAMES, 6))
    force[:, 1] = MASS * (GRAVITY - 0.03 * wave**2 * np.sin(wave * TIME))
    force[:, 2] = -MASS * 0.01 * wave**2 * np.cos(wave * TIME)
    force[:, 3:] = np.cross(com, force[:, :3])  # through the centre of mass
    return com, force


def test_nothing_is_missing_where_all_was_measured_up_to_the_ends(bouncing):
    com, force = bouncing
    body = body_of(com)
    missing = body.required - body.passed(force)
    assert np.abs(missing[:, :3]).max() < 2.0  # N
    assert np.abs(missing[:, 3:]).max() < 0.5  # N·m


def test_what_was_not_measured_is_missing(bouncing):
    com, force = bouncing
    hidden = force.copy()
    hidden[100:180] = 0.0
    body = body_of(com)
    missing = (body.required - body.passed(hidden))[:, UP]
    np.testing.assert_allclose(missing[110:170], force[110:170, UP], atol=15.0)
    assert np.abs(np.delete(missing, np.s_[85:195])).max() < 15.0


def test_an_impact_that_was_measured_is_not_missing():
    """However hard: a force of 3000 N for 30 ms, and the motion that it makes."""
    force = np.zeros((FRAMES, 6))
    force[:, UP] = MASS * GRAVITY
    force[150:153, UP] += 3000.0
    push = force[:, UP] / MASS - GRAVITY
    height = np.zeros(FRAMES)
    velocity = 0.0
    for t in range(1, FRAMES):
        mean = (push[t - 1] + push[t]) / 2
        height[t] = height[t - 1] + velocity / RATE + mean / (2 * RATE**2)
        velocity += mean / RATE
    body = body_of(np.column_stack([np.zeros(FRAMES), height, np.zeros(FRAMES)]))
    force[:, 3:] = np.cross(body.motion.com_ground, force[:, :3])
    assert np.abs((body.required - body.passed(force))[:, UP]).max() < 0.02 * 3000.0


def test_a_missing_force_presses_where_it_acts(bouncing):
    com, force = bouncing
    place = np.array([0.3, 0.05, -0.2])
    extra = np.zeros((FRAMES, 6))
    extra[:, :3] = (20.0, 200.0, -10.0)
    extra[:, 3:] = np.cross(place, extra[:, :3])
    body = body_of(com)
    missing = body.passed(force + extra) - body.passed(force)
    point = body.pressed_point(missing, np.full(FRAMES, place[1]))
    np.testing.assert_allclose(point[20:-20], np.tile(place[[0, 2]], (FRAMES - 40, 1)), atol=2e-3)


def test_angular_momentum_asks_for_a_moment():
    angular = np.column_stack([3.0 * TIME, np.zeros(FRAMES), -2.0 * TIME])
    body = body_of(np.tile([0.0, 0.9, 0.0], (FRAMES, 1)), angular)
    np.testing.assert_allclose(body.required[:, 3:], np.tile([3.0, 0.0, -2.0], (FRAMES, 1)), atol=1e-6)


def test_the_stated_noise_is_the_noise():
    """Quiet standing with 0.2 mm of white noise, many times over: standard deviation as stated."""
    rng = np.random.default_rng(3)
    errors, stated = [], []
    for _ in range(60):
        com = np.tile([0.0, 0.9, 0.0], (FRAMES, 1)) + 2e-4 * rng.standard_normal((FRAMES, 3))
        body = body_of(com)
        errors.append(body.required[:, UP] - MASS * GRAVITY)
        stated.append(np.sqrt(body.noise**2 - (BALANCE_NOISE * MASS * GRAVITY) ** 2))
    spread = np.std(errors, axis=0)
    for frames in (slice(0, 1), slice(100, 200)):
        assert np.mean(stated, axis=0)[frames].mean() == pytest.approx(spread[frames].mean(), rel=0.3)


def test_untracked_frames_are_bridged(bouncing):
    com, force = bouncing
    tracked = np.ones(FRAMES, dtype=bool)
    tracked[140:150] = False
    com = com.copy()
    com[140:150, UP] = 40.0  # whatever the pose there
    motion = BodyMotion(com, np.zeros_like(com), tracked, RATE, MASS, GRAVITY)
    body = WholeBody(motion, SETTINGS.balance_cutoff_Hz)
    missing = (body.required - body.passed(force))[:, UP]
    assert np.abs(missing[tracked]).max() < 60.0


def blinking(com, offset_m, frames):
    """As where the pelvis' markers come and go: on every other of these frames it sits elsewhere."""
    moved = com.copy()
    moved[list(frames)[::2], UP] += offset_m
    return moved


def test_a_centre_of_mass_that_markers_throw_about_is_bridged(bouncing):
    com, force = bouncing
    body = body_of(blinking(com, 0.03, range(140, 150)))
    assert body.jumping[140:149].all()
    assert not np.delete(body.jumping, np.s_[136:153]).any()
    assert np.abs((body.required - body.passed(force))[:, UP]).max() < 60.0


def test_what_no_marker_threw_is_no_jump(bouncing):
    """Neither noise, nor a small offset, nor a landing that changes the acceleration by 3 g in a frame."""
    com, _ = bouncing
    noise = 2e-4 * np.random.default_rng(7).standard_normal(com.shape)
    fall = com.copy()
    fall[150:, UP] += 0.5 * 30.0 * (np.arange(FRAMES - 150) / RATE) ** 2
    for moved in (com + noise, blinking(com, 0.002, range(140, 150)), fall):
        assert not jumps(moved, RATE).any()


def test_a_jump_that_lasts_makes_no_force_beyond_the_stated_noise():
    """Standing; after a jump the body's centre is where other markers put it, 2 cm away."""
    force = np.zeros((FRAMES, 6))
    force[:, UP] = MASS * GRAVITY
    com = np.tile([0.0, 0.9, 0.0], (FRAMES, 1))
    plain = body_of(com).noise
    com[150:, UP] += 0.02
    body = body_of(com)
    assert body.jumping[[149, 150]].all()
    missing = np.abs((body.required - body.passed(force))[:, UP])
    beside = ~body.jumping
    assert (missing <= 4.5 * body.noise)[beside].all()
    assert (missing > 4.5 * plain)[beside].any()
    np.testing.assert_allclose(body.noise[:60], plain[:60], rtol=0.02)


@pytest.mark.parametrize("cutoff", [SETTINGS.balance_cutoff_Hz, SETTINGS.place_cutoff_Hz])
@pytest.mark.parametrize(("start", "end"), [(1000, 1060), (0, 40), (2960, 3000), (700, 1300)])
def test_a_force_of_some_frames_passes_as_in_the_whole_trial(cutoff, start, end):
    rng = np.random.default_rng(start)
    time = np.arange(3000) / RATE
    com = np.column_stack([np.sin(time), 0.9 + 0.03 * np.sin(9 * time), 0.05 * np.cos(5 * time)])
    tracked = np.ones(len(com), dtype=bool)
    tracked[1080:1200] = tracked[900:905] = False  # unseen for longer than a force is felt
    body = WholeBody(BodyMotion(com, np.zeros_like(com), tracked, RATE, MASS, GRAVITY), cutoff)
    force = np.zeros((len(com), 6))
    force[start:end] = rng.normal(size=(end - start, 6)) * [100, 700, 100, 300, 50, 300]
    whole = body.passed(force)
    near, felt = body.passed_stretch(start, force[start:end])
    unnoticed = 0.01  # N, N·m; no plate tells so little
    inner = slice(max(near.start, 1), min(near.stop, len(com) - 1))  # a trial's own ends have coarse slopes
    np.testing.assert_allclose(
        felt[inner.start - near.start : inner.stop - near.start], whole[inner], rtol=0, atol=unnoticed
    )
    beyond = np.delete(whole, np.r_[near], axis=0)
    assert len(beyond) > 0
    assert np.abs(beyond).max() < unnoticed
