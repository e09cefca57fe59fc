"""Forces on a segment whose point of attack is known to a hand's breadth only."""

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.scene import Scene, force_at
from solver.kinematics.scale_prior import scale_groups
from solver.skeleton.forward import cross
from solver.skeleton.skeleton import Skeleton

REACH_M = 0.10  # from the segment's centre of mass to where a belt or a strap holds


def columns_at_centre(
    scene: Scene, body: int, force_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 6 4"]:
    """A force of a given time history at a segment's centre of mass, and what shifts of its point add.

    A force x f at the centre of mass p plus R r is x (f, p × f) + Σ (x rᵢ) (0, R eᵢ × f): the last three
    parameters are first moments along the body's axes [m × unit of x].
    """
    point_body = scene.skeleton.bodies[body].com_body
    return columns_at_point(scene, body, point_body, force_ground)


def columns_at_point(
    scene: Scene,
    body: int,
    point_body: Float[np.ndarray, "3"],
    force_ground: Float[np.ndarray, "frames 3"],
) -> Float[np.ndarray, "frames 6 4"]:
    """Likewise at any point of the body [m]."""
    columns = np.zeros((len(force_ground), 6, 4))
    columns[:, :, 0] = force_at(force_ground, scene.point_ground(body, point_body))
    for i in range(3):
        columns[:, 3:, 1 + i] = cross(scene.R_ground_body[:, body, :, i], force_ground)
    return columns


def prior_with_reach(std: float, reach_m: float = REACH_M) -> Float[np.ndarray, "4"]:
    """Prior standard deviations of such columns."""
    return np.array([std, *(3 * [std * reach_m])])


def trunk_bodies(skeleton: Skeleton) -> tuple[str, ...]:
    """Where belts and harnesses hold: the root segment, and the heaviest other one without a counterpart."""
    counterparts = scale_groups(skeleton).group.tolist()
    single = [b for b in range(len(skeleton.bodies)) if counterparts.count(counterparts[b]) == 1]
    roots = [b for b, joint in enumerate(skeleton.joints) if joint.parent < 0]
    others = sorted(set(single) - set(roots), key=lambda b: skeleton.bodies[b].mass)
    return tuple(skeleton.body_names[b] for b in (*roots, *others[-1:]))
