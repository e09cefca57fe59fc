"""The skeleton moves, weighs and resists as the same model does in OpenSim."""

from collections import Counter

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.chain import Moving, chain_of
from solver.skeleton.forward import body_poses, marker_positions
from solver.skeleton.osim import load_skeleton
from solver.skeleton.pinocchio_model import RigidBodyModel
from tests.solver.skeleton.test_pinocchio_model import mass_matrix

pytestmark = [pytest.mark.opensim, pytest.mark.real]

STATES = 20
MOTION_TYPES = {1: "rotation", 2: "translation", 3: "coupled"}


def test_coordinates_are_named_ordered_and_described_as_in_opensim(referees, subtests):
    for path, referee in referees.items():
        with subtests.test(path.name):
            theirs = [
                (
                    c.getName(),
                    MOTION_TYPES[c.getMotionType()],
                    c.getDefaultValue(),
                    (c.getRangeMin(), c.getRangeMax()),
                    c.get_clamped(),
                    c.get_locked(),
                )
                for c in referee.coordinates
            ]
            ours = [
                (c.name, c.motion, c.default, c.range, c.clamped, c.locked)
                for c in referee.skeleton.coordinates
            ]
            assert ours == theirs


def test_bodies_and_markers_stand_where_opensim_puts_them(referees, random_q, subtests):
    for path, referee in referees.items():
        skeleton, rng = referee.skeleton, np.random.default_rng(1)
        q = np.stack([random_q(skeleton, rng) for _ in range(STATES)])
        markers = marker_positions(skeleton, q)
        rotations, origins = body_poses(skeleton, q)
        pin_rotations, pin_origins = RigidBodyModel(skeleton).body_placements(q)
        with subtests.test(path.name):
            for t in range(STATES):
                referee.pose(q[t])
                bodies = [referee.body(name) for name in skeleton.body_names]
                theirs_R, theirs_p = (np.stack(parts) for parts in zip(*bodies, strict=True))
                for R, p in ((rotations, origins), (pin_rotations, pin_origins)):
                    np.testing.assert_allclose(R[t], theirs_R, rtol=0, atol=1e-9)
                    np.testing.assert_allclose(p[t], theirs_p, rtol=0, atol=1e-9)
                if skeleton.markers:
                    np.testing.assert_allclose(markers[t], referee.markers(), rtol=0, atol=1e-9)


def test_marker_sets_are_complete(referees, subtests):
    for path, referee in referees.items():
        with subtests.test(path.name):
            markers = referee.model.getMarkerSet()
            theirs = [
                (markers.get(i).getName(), markers.get(i).get_fixed()) for i in range(markers.getSize())
            ]
            assert [(m.name, m.fixed) for m in referee.skeleton.markers] == theirs


def test_mass_matrix_and_centre_of_mass(referees, random_q, subtests):
    for path, referee in referees.items():
        skeleton, rng = referee.skeleton, np.random.default_rng(2)
        model = RigidBodyModel(skeleton)
        q = np.stack([random_q(skeleton, rng) for _ in range(STATES)])
        ours, centres = mass_matrix(model, q), model.centre_of_mass(q)
        with subtests.test(path.name):
            for t in range(STATES):
                theirs = referee.mass_matrix(q[t])
                np.testing.assert_allclose(ours[t], theirs, rtol=0, atol=1e-6 * np.abs(theirs).max())
                centre = referee.model.calcMassCenterPosition(referee.state).to_numpy()
                np.testing.assert_allclose(centres[t], centre, rtol=0, atol=1e-9)


def test_joint_torques_with_an_external_wrench(referees, random_q, subtests):
    """Velocities everywhere but in the knees where Simbody's velocity terms are wrong, see below."""
    for path, referee in referees.items():
        skeleton, rng = referee.skeleton, np.random.default_rng(3)
        model, foot = RigidBodyModel(skeleton), "calcn_r"
        still = _drive_several_turns_of_a_joint(skeleton)
        with subtests.test(path.name):
            for _ in range(STATES):
                q = random_q(skeleton, rng)
                v, a = rng.normal(size=len(q)), 5 * rng.normal(size=len(q))
                v[still] = 0.0
                stations, forces = 0.3 * rng.normal(size=(3, 3)), 300 * rng.normal(size=(3, 3))
                theirs, wrench = referee.torques(q, v, a, body=foot, stations=stations, forces=forces)
                ours = model.inverse_dynamics(
                    q[None], v[None], a[None], wrench[None, None], [skeleton.body_index(foot)]
                )[0]
                np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6 * np.abs(theirs).max())


def test_velocity_terms_follow_from_opensims_mass_matrix(referees, random_q, subtests):
    """Lagrange: C = Ṁ q̇ − ½ ∂(q̇ᵀ M q̇)/∂q.

    Simbody's mobilizer behind CustomJoint takes coordinate k for the one that turns about axis k when it
    differentiates its Jacobian. A knee whose three turns depend on one coordinate so gets wrong Coriolis
    accelerations; they contradict OpenSim's own positions. Its mass matrix is right, and settles the matter.
    """
    for path, referee in referees.items():
        skeleton, rng = referee.skeleton, np.random.default_rng(4)
        model = RigidBodyModel(skeleton)
        if not _drive_several_turns_of_a_joint(skeleton):
            continue
        with subtests.test(path.name):
            q = random_q(skeleton, rng)
            v = rng.normal(size=len(q))
            rest = np.zeros_like(q)
            ours = model.inverse_dynamics(np.stack([q, q]), np.stack([v, rest]), np.stack([rest, rest]))
            mass_rate = _slope(lambda h: referee.mass_matrix(q + h * v))  # noqa: B023
            energy_slope = np.array(
                [_slope(lambda h: v @ referee.mass_matrix(q + h * unit) @ v / 2) for unit in np.eye(len(q))]  # noqa: B023
            )
            theirs = mass_rate @ v - energy_slope
            np.testing.assert_allclose(ours[0] - ours[1], theirs, rtol=0, atol=1e-6 * np.abs(theirs).max())


def test_the_scapulothoracic_joint_is_named_in_an_error(real_data):
    path = real_data / "models" / "ScapulothoracicJoint_Shoulder.osim"
    with pytest.raises(
        ModelError, match=r"\.osim:\d+: ScapulothoracicJoint 'scapulothoracic'.*not supported"
    ):
        load_skeleton(path)


def _drive_several_turns_of_a_joint(skeleton) -> list[int]:
    """Dofs that turn one body about more than one axis."""
    chain = chain_of(skeleton)
    turns = Counter(
        (body, int(chain.dof[step.index]))
        for body, steps in enumerate(chain.steps)
        for step in steps
        if isinstance(step, Moving) and step.kind == "rotation"
    )
    return sorted({dof for (_, dof), count in turns.items() if count > 1})


def _slope(f, h=1e-3):
    """Derivative at zero, to fourth order."""
    return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)
