from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.body_masses import CarriedMass
from solver.diagnosis.causes.effect import Estimate, Fitted
from solver.simulate.other_masses import with_carried_mass

LOADS = [
    ("torso", 3.0, (-0.15, 0.1, 0.05)),
    ("tibia_r", 1.5, (0.02, -0.35, 0.0)),
    ("hand_l", 5.0, (0, -0.1, 0)),
]


@pytest.fixture(params=LOADS, ids=[load[0] for load in LOADS])
def load(request, scene, demand_of):
    body, mass, place = request.param
    heavier = with_carried_mass(scene.skeleton, body, mass, np.array(place))
    return body, mass, np.array(place), demand_of(scene.skeleton) - demand_of(heavier)


def test_is_what_the_loaded_body_demands_more(scene, explains, load):
    body, mass, place, missing = load
    com = scene.skeleton.bodies[scene.skeleton.body_index(body)].com_body
    d = place - com
    second = [d[i] * d[j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    x = mass * np.array([1.0, *d, *second])
    assert explains(CarriedMass(body), scene, (), x, missing) < 1e-5


def test_mass_and_place_are_recovered(scene, fitted, load):
    body, mass, place, missing = load
    candidate = CarriedMass(body)
    x, covariance = fitted(candidate, scene, missing)
    found = candidate.estimates([scene], Fitted((), (), x, covariance))
    assert candidate.is_notable(found)
    for name, true in zip(("mass_kg", "offset_x_m", "offset_y_m", "offset_z_m"), (mass, *place), strict=True):
        assert abs(found[name].value - true) < 3 * found[name].std + 1e-3, name


def test_spread_of_the_place_is_that_of_draws(scene):
    candidate = CarriedMass("torso")
    x = np.array([3.0, -0.4, 0.2, 0.1, *np.zeros(6)])
    L = 0.02 * np.tril(np.ones((10, 10)))
    draws = x + np.random.default_rng(0).standard_normal((20000, 10)) @ L.T
    com = scene.skeleton.bodies[scene.skeleton.body_index("torso")].com_body
    found = candidate.estimates([scene], Fitted((), (), x, L @ L.T))
    for i, name in enumerate(("offset_x_m", "offset_y_m", "offset_z_m")):
        places = com[i] + draws[:, 1 + i] / draws[:, 0]
        assert found[name].value == pytest.approx(places.mean(), abs=1e-3)
        assert found[name].std == pytest.approx(places.std(), rel=0.03)


@pytest.mark.parametrize(
    ("mass", "std", "away", "notable"),
    [(3.0, 0.3, 0.2, True), (-3.0, 0.1, 0.2, False), (1.5, 0.9, 0.2, False), (2.0, 0.2, 3.0, False)],
    ids=["a load", "negative", "a moment only", "off the body"],
)
def test_what_can_be_carried(mass, std, away, notable):
    offsets = {
        f"offset_{axis}_m": Estimate(value, 0.1) for axis, value in zip("xyz", (0, away, 0), strict=True)
    }
    assert CarriedMass("torso").is_notable({"mass_kg": Estimate(mass, std), **offsets}) is notable


def test_bodies_of_some_weight_are_candidates(scene):
    targets = {c.target for c in CarriedMass.candidates([scene])}
    assert {"pelvis", "torso", "femur_r", "tibia_l", "calcn_r", "hand_r"} <= targets
    assert not targets & {"patella_r", "talus_l", "toes_r"}


def test_of_somebody_unweighed_only_a_load_of_one_trial_among_several_is_told(scene):
    one, other = replace(scene, weighed=False), replace(scene, name="again", weighed=False)
    assert CarriedMass.candidates([one]) == []
    assert {c.trial for c in CarriedMass.candidates([one, other])} == {scene.name, "again"}
