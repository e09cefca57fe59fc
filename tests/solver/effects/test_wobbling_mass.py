import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solver.effects.effect import Estimate
from solver.effects.wobbling_mass import DRIVEN_BELOW_HZ, WobblingMass, candidates, swing
from solver.filters import low_pass
from solver.simulate.loads import BodyPoint
from solver.simulate.other_masses import WobblingMass as TrueMass

ETA = (4.0, 0.2)


@pytest.fixture(scope="module", params=["torso", "femur_r"])
def flesh(request, scene, walk):
    com = scene.skeleton.bodies[scene.skeleton.body_index(request.param)].com_body
    point = BodyPoint(scene.skeleton, request.param, com)
    return request.param, TrueMass(point, 4.0, *ETA)(walk.motion, scene.times)


def test_mass_is_recovered_and_little_is_left_below_the_band(scene, fitted, flesh):
    body, missing = flesh
    candidate = WobblingMass(body)
    x, covariance = fitted(candidate, scene, missing, ETA)
    left = missing - candidate.signature(scene, ETA).columns @ x
    slow_left, slow = (low_pass(w, scene.rate, DRIVEN_BELOW_HZ / 2) for w in (left, missing))
    inner = slice(30, -30)  # the swing before the recording dies down, and filters forget the ends
    assert np.sqrt((slow_left[inner] ** 2).mean(axis=0) / (slow[inner] ** 2).mean(axis=0)).max() < 0.05
    found = candidate.estimates([scene], ETA, (0.0, 0.0), x, covariance)
    assert found["mass_kg"].value == pytest.approx(4.0, rel=0.05)
    assert candidate.is_notable(found)


@pytest.mark.parametrize("damping", [0.05, 0.4, 1.0, 1.4])
def test_swing_solves_its_equation(damping):
    """Against an adaptive Runge-Kutta method."""
    rate, times = 100.0, np.arange(120) / 100.0
    omega = 2 * np.pi * 5.0

    def push(t):
        return 3 * np.sin(14 * t + 0.3) + np.cos(31 * t)

    begin = np.zeros((2, 3))
    begin[:, 0] = 0.01, -0.2
    r, r_dd = swing(np.stack([push(times)] * 3, axis=1), rate, (5.0, damping), begin)
    exact = solve_ivp(
        lambda t, y: [y[1], push(t) - 2 * damping * omega * y[1] - omega**2 * y[0]],
        (0, times[-1]),
        begin[:, 0],
        t_eval=times,
        rtol=1e-10,
        atol=1e-12,
    ).y
    size = np.abs(exact[0]).max()
    assert np.abs(r[:, 0] - exact[0]).max() < 2e-3 * size
    rest = push(times) - 2 * damping * omega * exact[1] - omega**2 * exact[0]
    assert np.abs(r_dd[:, 0] - rest).max() < 5e-3 * np.abs(rest).max()


def test_bounds():
    candidate = WobblingMass("torso")
    assert all(candidate.admissible(start) for start in candidate.starts([]))
    assert not candidate.admissible((4.0, 0.0))
    assert not candidate.admissible((50.0, 0.2))


@pytest.mark.parametrize(
    ("frequency", "damping", "possible"),
    [(4.0, 0.2, True), (4.0, 0.015, True), (4.0, -0.04, False), (1.3, 0.6, False), (1.45, 0.6, True)],
)
def test_flesh_neither_swings_on_by_itself_nor_outside_its_range(frequency, damping, possible):
    """Within a standard deviation of the bounds."""
    estimates = {
        "mass_kg": Estimate(5.0, 0.3),
        "frequency_Hz": Estimate(frequency, 0.1),
        "damping_ratio": Estimate(damping, 0.01),
    }
    candidate = WobblingMass("torso")
    assert candidate.is_possible(estimates) == possible
    assert candidate.is_notable(estimates) == possible


def test_bodies_with_flesh(scene):
    assert {c.target for c in candidates([scene])} >= {"pelvis", "torso", "femur_r", "femur_l"}
