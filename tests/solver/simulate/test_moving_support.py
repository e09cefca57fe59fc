import numpy as np

from solver.simulate.ground_demand import GroundDemand
from solver.simulate.spline_motion import MovingSupport
from solver.skeleton.pinocchio_model import RigidBodyModel

TIMES = np.arange(0.0, 2.0, 0.01)
DIRECTION = np.array([0.8, 0.0, 0.6])
WAVES = ((0.4, 1.3, 0.2), (0.2, 2.9, 1.0))


def test_the_ground_carries_what_the_motion_in_the_room_demands(walk):
    """The same motion seen from a room that does not accelerate: the support's own path is added to it."""
    skeleton = walk.body.skeleton
    support = MovingSupport(skeleton, DIRECTION, WAVES)
    q, v, a = (x.copy() for x in walk.motion.state(TIMES))
    places = [walk.motion.dofs.index(f"pelvis_t{axis}") for axis in "xyz"]
    path, speed, acceleration = np.zeros(len(TIMES)), np.zeros(len(TIMES)), np.zeros(len(TIMES))
    for amplitude, frequency, phase in WAVES:
        omega = 2 * np.pi * frequency
        path -= amplitude / omega**2 * np.sin(omega * TIMES + phase)
        speed -= amplitude / omega * np.cos(omega * TIMES + phase)
        acceleration += amplitude * np.sin(omega * TIMES + phase)
    np.testing.assert_allclose(support.acceleration(TIMES), acceleration[:, None] * DIRECTION)
    demand = GroundDemand(RigidBodyModel(skeleton))
    on_support = demand.wrench(q, v, a) - support(walk.motion, TIMES)
    for state, time_history in ((q, path), (v, speed), (a, acceleration)):
        state[:, places] += time_history[:, None] * DIRECTION
    in_room = demand.wrench(q, v, a)
    shift = path[:, None] * DIRECTION
    in_room[:, 3:] -= np.cross(shift, in_room[:, :3])
    np.testing.assert_allclose(on_support, in_room, atol=1e-6)
