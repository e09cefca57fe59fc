"""What forces on segments and changes of their inertia add to the balance, and which segments are touched."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.observed_trial import Scene, force_at
from solver.dynamics.inertia_parameters import pseudo_inertia, required_wrench
from solver.kinematics.scale_prior import scale_groups
from solver.skeleton.forward import cross
from solver.skeleton.skeleton import Skeleton

REACH_M = 0.10  # from the segment's centre of mass to where a belt or a strap holds
BETWEEN_OTHERS_ODDS = 2.0  # [nats] against a touch or a load there rather than at hands, seat, thighs or back


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
    scene: Scene, body: int, point_body: Float[np.ndarray, "3"], force_ground: Float[np.ndarray, "frames 3"]
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


def inner_segments(skeleton: Skeleton) -> frozenset[int]:
    """Segments between two others, but for trunk and thighs: upper arms, forearms, shanks, ankle bones."""
    parents = [joint.parent for joint in skeleton.joints]
    roots = {b for b, parent in enumerate(parents) if parent < 0}
    trunk = roots | {skeleton.body_index(name) for name in trunk_bodies(skeleton)}
    between = {b for b, parent in enumerate(parents) if b in parents and parent not in roots}
    return frozenset(between - trunk)


def inner_arm_segments(skeleton: Skeleton) -> frozenset[int]:
    """Those of limbs that hang from the trunk's upper end: upper arms and forearms."""
    parents = [joint.parent for joint in skeleton.joints]
    upper = {skeleton.body_index(name) for name in trunk_bodies(skeleton)}
    upper = {b for b in upper if parents[b] >= 0}

    def hangs_from_it(body: int) -> bool:
        return parents[body] in upper or (parents[body] >= 0 and hangs_from_it(parents[body]))

    return frozenset(b for b in inner_segments(skeleton) if hangs_from_it(b))


def required_by_changes(
    scene: Scene, body: int, changes: Float[np.ndarray, "changes 4 4"]
) -> Float[np.ndarray, "frames 6 changes"]:
    """Wrench about the ground origin that each change of a body's pseudo-inertia demands [N, N·m]."""
    one = slice(body, body + 1)
    required = required_wrench(scene.material[:, one], scene.T_ground_body[:, one], changes[None])
    return required[:, 0].transpose(0, 2, 1)


def required_by_bodies(scene: Scene, bodies: Sequence[int]) -> Float[np.ndarray, "frames 6"]:
    """Wrench about the ground origin that these bodies as they are in the model demand [N, N·m]."""
    chosen = list(bodies)
    J = np.stack([pseudo_inertia(scene.skeleton.bodies[b]) for b in chosen])
    return required_wrench(scene.material[:, chosen], scene.T_ground_body[:, chosen], J).sum(axis=1)
