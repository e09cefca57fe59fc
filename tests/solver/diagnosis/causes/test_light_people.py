"""Who is tried does not depend on how heavy the person is: a child's hands are hands."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.body_masses import CarriedMass, SegmentMass
from solver.diagnosis.causes.external_contact import ExternalContact
from solver.diagnosis.causes.scene import force_at
from solver.diagnosis.causes.wobbling_mass import WobblingMass
from solver.diagnosis.unmodelled.remainder import unknown_forces

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
