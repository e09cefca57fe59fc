import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solver.common.filters import low_pass
from solver.diagnosis.causes.effect import Estimate, Fitted
from solver.diagnosis.causes.wobbling_mass import (
    CRITICAL,
    DRIVEN_BELOW_HZ,
    TRANSIENT_M_PER_S2,
    WobblingMass,
    decay,
    swing,
)
from solver.simulate.loads import BodyPoint
from solver.simulate.other_masses import WobblingMass as TrueMass

ETA = (4.0, 0.2)


@pytest.fixture(scope="module", params=["torso", "femur_r"])
def soft_tissue(request, scene, walk):
    com = scene.skeleton.bodies[scene.skeleton.body_index(request.param)].com_body
    point = BodyPoint(scene.skeleton, request.param, com)
    return request.param, TrueMass(point, 4.0, *ETA)(walk.motion, scene.times)


def test_mass_is_recovered_and_little_is_left_below_the_band(scene, fitted, soft_tissue):
    body, missing = soft_tissue
    candidate = WobblingMass(body)
    x, covariance = fitted(candidate, scene, missing, ETA)
    left = missing - candidate.signature(scene, ETA).columns @ x
    slow_left, slow = (low_pass(w, scene.rate, DRIVEN_BELOW_HZ / 2) for w in (left, missing))
    inner = slice(30, -30)  # the swing before the recording dies down, and filters forget the ends
    assert np.sqrt((slow_left[inner] ** 2).mean(axis=0) / (slow[inner] ** 2).mean(axis=0)).max() < 0.05
    found = candidate.estimates([scene], Fitted(ETA, (0.0, 0.0), x, covariance))
    assert found["mass_kg"].value == pytest.approx(4.0, rel=0.05)
    assert candidate.is_notable(found)


@pytest.mark.parametrize("damping", [0.05, 0.4, 1.0, 1.4])
def test_swing_solves_its_equation(damping):
    """Against an adaptive Runge-Kutta method, from rest where the first push holds it."""
    rate, times = 100.0, np.arange(120) / 100.0
    omega = 2 * np.pi * 5.0

    def push(t):
        return 3 * np.sin(14 * t + 0.3) + np.cos(31 * t)

    r, r_dd = swing(np.stack([push(times)] * 3, axis=1), rate, (5.0, damping))
    exact = solve_ivp(
        lambda t, y: [y[1], push(t) - 2 * damping * omega * y[1] - omega**2 * y[0]],
        (0, times[-1]),
        [push(0.0) / omega**2, 0.0],
        t_eval=times,
        rtol=1e-10,
        atol=1e-12,
    ).y
    size = np.abs(exact[0]).max()
    assert np.abs(r[:, 0] - exact[0]).max() < 2e-3 * size
    rest = push(times) - 2 * damping * omega * exact[1] - omega**2 * exact[0]
    assert np.abs(r_dd[:, 0] - rest).max() < 5e-3 * np.abs(rest).max()


@pytest.mark.parametrize("damping", [0.02, 0.4, 1.0, 1.4])
@pytest.mark.parametrize("begin", [(0.01, 0.0), (0.0, -0.2)])
def test_what_swings_out_from_a_place_or_a_speed_has_a_closed_form(damping, begin):
    """Against an adaptive Runge-Kutta method; within what keeps the two roots apart at critical damping."""
    times, omega = np.arange(120) / 100.0, 2 * np.pi * 5.0
    r, r_dd = decay(times, (5.0, damping), np.array(begin))
    exact = solve_ivp(
        lambda t, y: [y[1], -2 * damping * omega * y[1] - omega**2 * y[0]],
        (0, times[-1]),
        begin,
        t_eval=times,
        rtol=1e-11,
        atol=1e-13,
    ).y
    kept_apart = CRITICAL * omega * times[-1]  # by so much of a period the roots are off at the end
    np.testing.assert_allclose(r, exact[0], atol=kept_apart * np.abs(exact[0]).max())
    rest = -2 * damping * omega * exact[1] - omega**2 * exact[0]
    np.testing.assert_allclose(r_dd, rest, atol=kept_apart * np.abs(rest).max())


def test_columns_of_what_swings_out_are_those_of_a_kilogramme_that_does(scene):
    """Force and moment of a kilogramme fixed at the place less those of one that is r away."""
    columns = WobblingMass("torso").signature(scene, ETA).columns
    body = scene.skeleton.body_index("torso")
    com = scene.skeleton.bodies[body].com_body
    place, felt = scene.point_ground(body, com), scene.material[:, body] @ np.append(com, 1.0)
    omega = 2 * np.pi * ETA[0]
    for k, begin in enumerate(([TRANSIENT_M_PER_S2 / omega**2, 0.0], [0.0, TRANSIENT_M_PER_S2 / omega])):
        r, r_dd = decay(np.arange(scene.frames) / scene.rate, ETA, np.array(begin))
        for axis, e in enumerate(np.eye(3)):
            away, faster = r[:, None] * e, r_dd[:, None] * e
            moment = np.cross(place, felt) - np.cross(place + away, felt + faster) + np.cross(away, faster)
            own = columns[:, :, 1 + 3 * k + axis]
            np.testing.assert_allclose(own[:, :3], -faster, atol=1e-12)
            np.testing.assert_allclose(own[:, 3:], moment, atol=1e-9)


def test_bounds():
    candidate = WobblingMass("torso")
    assert all(candidate.admissible(start) for start in candidate.starts([]))
    assert not candidate.admissible((4.0, 0.0))
    assert not candidate.admissible((50.0, 0.2))


@pytest.mark.parametrize(
    ("frequency", "damping", "possible"),
    [(4.0, 0.2, True), (4.0, 0.015, True), (4.0, -0.04, False), (1.3, 0.6, False), (1.45, 0.6, True)],
)
def test_soft_tissue_neither_swings_on_by_itself_nor_outside_its_range(frequency, damping, possible):
    """Within a standard deviation of the bounds."""
    estimates = {
        "mass_kg": Estimate(5.0, 0.3),
        "frequency_Hz": Estimate(frequency, 0.1),
        "damping_ratio": Estimate(damping, 0.01),
    }
    candidate = WobblingMass("torso")
    assert candidate.is_possible(estimates) == possible
    assert candidate.is_notable(estimates) == possible


def test_bodies_with_soft_tissue(scene):
    assert {c.target for c in WobblingMass.candidates([scene])} >= {"pelvis", "torso", "femur_r", "femur_l"}
