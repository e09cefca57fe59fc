"""Masses that are not those of the model: the whole body's, a segment's, a load's."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.body_masses import CarriedMass, SegmentMass, SubjectMass
from solver.diagnosis.causes.effect import Estimate, Fitted
from solver.diagnosis.causes.external_contact import ExternalContact
from solver.diagnosis.causes.observed_trial import force_at
from solver.diagnosis.causes.wobbling_mass import WobblingMass
from solver.diagnosis.unmodelled.remainder import unknown_forces
from solver.simulate.other_masses import with_carried_mass, with_segment_masses


def test_is_the_force_that_a_heavier_person_demands_more(scene, demand_of):
    heavier = with_segment_masses(scene.skeleton, dict.fromkeys(scene.skeleton.body_names, 1.07))
    missing = demand_of(scene.skeleton) - demand_of(heavier)
    said = 0.07 * SubjectMass("all").signature(scene, ()).columns[:, :, 0]
    np.testing.assert_allclose(said[:, :3], missing[:, :3], atol=1e-5 * np.abs(missing[:, :3]).max())


def test_claims_nothing_of_the_body_s_spin(scene):
    said = SubjectMass("all").signature(scene, ()).columns[:, :, 0]
    np.testing.assert_allclose(said[:, 3:], np.cross(scene.com_ground, said[:, :3]), atol=1e-9)


def test_the_factor_is_true_over_entered():
    candidate = SubjectMass("all")
    found = candidate.estimates([], Fitted((), (), np.array([-0.03]), np.array([[0.004**2]])))
    assert found["mass_factor"].value == pytest.approx(0.97)
    assert found["mass_factor"].std == pytest.approx(0.004)
    assert candidate.is_notable(found)
    assert not candidate.is_notable({"mass_factor": replace(found["mass_factor"], value=1.01)})


@pytest.mark.parametrize(
    ("true_kg", "entered_kg", "can_be"), [(62.6, 78.2, True), (70, 55, True), (80, 50, False)]
)
def test_the_mass_of_another_adult_may_have_been_entered(true_kg, entered_kg, can_be):
    """Half as much again is no wrong entry, but forces that are missing or in other units."""
    candidate = SubjectMass("all")
    found = candidate.estimates(
        [], Fitted((), (), np.array([true_kg / entered_kg - 1]), np.array([[0.01**2]]))
    )
    assert candidate.is_notable(found) == candidate.is_possible(found) == can_be


def test_there_is_one_person_whose_mass_is_not_wrong_where_nobody_entered_it(scene):
    assert [c.target for c in SubjectMass.candidates([scene, scene])] == ["all"]
    assert SubjectMass.candidates([replace(scene, mass_was_entered=False)]) == []


LEGS = ("femur_r", "tibia_r", "femur_l", "tibia_l")


def test_is_what_heavier_segments_demand_more(scene, explains, demand_of):
    missing = demand_of(scene.skeleton) - demand_of(
        with_segment_masses(scene.skeleton, dict.fromkeys(LEGS, 1.15))
    )
    assert explains(SegmentMass("+".join(LEGS)), scene, (0.0,), [0.15], missing) < 1e-5


def test_a_wrong_division_of_a_right_total(scene, fitted, demand_of):
    """The model handed out has legs of 1/1.15 of the truth; its total is then what the scale said."""
    true = scene.skeleton
    handed_out = with_segment_masses(true, dict.fromkeys(LEGS, 1 / 1.15))
    scale = true.mass / handed_out.mass
    model = with_segment_masses(handed_out, dict.fromkeys(true.body_names, scale))
    in_model = type(scene)(**{**vars_of(scene), "skeleton": model, "required_ground": demand_of(model)})
    candidate = SegmentMass("+".join(LEGS))
    missing = demand_of(model) - demand_of(true)
    x, covariance = fitted(candidate, in_model, missing, (1.0,))
    left = missing - candidate.signature(in_model, (1.0,)).columns @ x
    assert np.abs(left).max() < 0.01 * np.abs(missing).max()
    found = candidate.estimates([in_model], Fitted((1.0,), (0.0,), x, covariance))
    assert found["mass_factor"].value == pytest.approx(1.15, abs=3e-3)


@pytest.mark.parametrize("eta", [0.0, 0.6, 1.0])
def test_standard_deviation_is_the_slope_s(scene, eta):
    candidate = SegmentMass("femur_r+femur_l")

    def factor(x):
        return candidate.estimates([scene], Fitted((eta,), (0.0,), np.array([x]), np.eye(1)))["mass_factor"]

    assert factor(0.1).std == pytest.approx(
        (factor(0.1 + 1e-6).value - factor(0.1 - 1e-6).value) / 2e-6, rel=1e-6
    )


def test_segments_pairs_and_legs_are_candidates(scene):
    targets = [c.target for c in SegmentMass.candidates([scene])]
    assert {"torso", "femur_r", "femur_r+femur_l", "tibia_r+tibia_l", "+".join(LEGS)} <= set(targets)
    assert len(set(targets)) == len(targets)
    assert not any("toes" in t for t in targets)


def vars_of(scene):
    return {name: getattr(scene, name) for name in type(scene).__dataclass_fields__}


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
    one, other = replace(scene, mass_was_entered=False), replace(scene, name="again", mass_was_entered=False)
    assert CarriedMass.candidates([one]) == []
    assert {c.trial for c in CarriedMass.candidates([one, other])} == {scene.name, "again"}


CHILD = 0.4  # of an adult's mass


@pytest.fixture(scope="module")
def child(scene, recorded):
    """The same motion of the same shape, each segment lighter by one factor."""
    skeleton = scene.skeleton
    bodies = tuple(
        replace(b, mass=CHILD * b.mass, inertia_body=CHILD * b.inertia_body) for b in skeleton.bodies
    )
    light = replace(recorded(CHILD * scene.required_ground), required_ground=CHILD * scene.required_ground)
    return replace(light, skeleton=replace(skeleton, bodies=bodies))


@pytest.mark.parametrize(
    "candidates",
    [CarriedMass.candidates, SegmentMass.candidates, WobblingMass.candidates, unknown_forces],
    ids=["carried", "segment", "wobbling", "unknown"],
)
def test_a_childs_segments_are_those_of_an_adult(scene, child, candidates):
    named = [{c.target for c in candidates([s])} for s in (scene, child)]
    assert named[0]
    assert named[0] == named[1]


def test_a_childs_hand_may_be_touched(child):
    body = child.skeleton.body_index("hand_r")
    assert child.skeleton.bodies[body].mass < 0.3
    push = np.zeros((child.frames, 6))
    place = child.point_ground(body, child.skeleton.bodies[body].com_body)
    push[80:170] = force_at(np.array([-20.0, 25.0, 20.0]), place)[80:170]
    pushed = replace(child, required_ground=child.required_ground + push)
    assert "hand_r" in {c.target for c in ExternalContact.candidates([pushed])}
