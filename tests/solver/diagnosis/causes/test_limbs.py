"""Segments between others, in the default body."""

from solver.diagnosis.causes.body_masses import CarriedMass
from solver.diagnosis.causes.on_segments import inner_arm_segments, inner_segments


def named(skeleton, bodies):
    return {skeleton.body_names[b] for b in bodies}


def test_arms_and_shanks_lie_between_others(scene):
    arms = {f"{bone}_{side}" for bone in ("humerus", "ulna", "radius") for side in "rl"}
    inner = named(scene.skeleton, inner_segments(scene.skeleton))
    assert arms | {"tibia_r", "tibia_l"} <= inner
    assert not inner & {"pelvis", "torso", "femur_r", "femur_l", "hand_r", "hand_l", "toes_r", "patella_l"}
    assert named(scene.skeleton, inner_arm_segments(scene.skeleton)) == arms


def test_loads_are_rarely_carried_on_the_arm_itself(scene):
    rare = {c.target for c in CarriedMass.candidates([scene]) if c.place_odds}
    usual = {c.target for c in CarriedMass.candidates([scene]) if not c.place_odds}
    assert {"humerus_r", "ulna_l", "radius_r"} <= rare
    assert {"pelvis", "torso", "hand_l", "femur_r", "tibia_r", "calcn_l"} <= usual
    assert not rare & usual
