import numpy as np
import pytest

from solver.diagnosis.causes.body_masses import SegmentMass
from solver.diagnosis.causes.effect import Fitted
from solver.simulate.other_masses import with_segment_masses

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
