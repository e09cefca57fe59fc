"""A wrench divided among feet as a beam divides its load among supports: most goes to the nearest.

How legs lean together: the forces of both feet in walking meet near the centre of mass or above it (Maus et
al. 2010, 10.1038/ncomms1073).
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from solver.common.plate_figures import CONTACT_N
from solver.contact.sole import Sole, soles
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.skeleton.forward import body_poses, cross
from solver.skeleton.skeleton import Skeleton

TOUCHING_M = 0.001  # nearer to a sole than this is on it
LEAST_HEIGHT_M = 0.3  # of the centre of mass above a foot: lying people's legs do not carry them
LEVEL = [0, 2]  # axes, y is up


def divide_wrench(
    skeleton: Skeleton,
    foot_bodies: Sequence[str],
    q: Float[np.ndarray, "frames dofs"],
    wrench_ground: Float[np.ndarray, "frames 6"],
    takes_part: Bool[np.ndarray, "frames feet"],
) -> Float[np.ndarray, "frames feet 6"]:
    """A wrench for each foot that takes part; together they are the whole.

    The line that the force acts along meets the height of each sole in a point. A foot carries in inverse
    proportion to that point's distance from its sole: a foot that has the point beneath it carries all, and
    between two soles the lever rule holds. Each force acts on its sole's nearest point. Legs push towards
    the body: where feet stand apart, their forces lean together as lines to the centre of mass do. The moment
    that is left goes along in proportion.

    Args:
        skeleton: scaled.
        foot_bodies: a body for each foot.
        q: generalized coordinates [rad or m].
        wrench_ground: force [N] and moment about the ground origin [N·m].
        takes_part: at least one foot on every frame.

    Raises:
        ModelError: a foot's body has no sole.
    """
    points, share, forces = _shared(skeleton, soles(skeleton, foot_bodies), q, wrench_ground, takes_part)
    moments = cross(points, forces)
    moments += share * (wrench_ground[:, 3:] - moments.sum(axis=1))[:, None, :]
    return np.concatenate([forces, moments], axis=2)


def press_on_soles(
    skeleton: Skeleton,
    foot_bodies: Sequence[str],
    q: Float[np.ndarray, "frames dofs"],
    wrench_ground: Float[np.ndarray, "frames 6"],
    takes_part: Bool[np.ndarray, "frames feet"],
    *,
    reach: float = 1.0,
) -> Float[np.ndarray, "frames feet 6"]:
    """The same forces, with no more moment than they have at the soles' nearest points.

    A sole presses only where it is. Where the wrench is predicted from noisy motion, the moment that is left
    is noise rather than the ground's: nothing is said of it.

    Args:
        skeleton: scaled.
        foot_bodies: a body for each foot.
        q: generalized coordinates [rad or m].
        wrench_ground: force [N] and moment about the ground origin [N·m].
        takes_part: at least one foot on every frame.
        reach: of the soles' length and width, about their middle, that presses; 1: all.

    Raises:
        ModelError: a foot's body has no sole.
    """
    own = [sole.middle(reach) for sole in soles(skeleton, foot_bodies)]
    points, _, forces = _shared(skeleton, own, q, wrench_ground, takes_part)
    return np.concatenate([forces, cross(points, forces)], axis=2)


def feet_moving_with_ground(
    skeleton: Skeleton,
    foot_bodies: Sequence[str],
    q: Float[np.ndarray, "frames dofs"],
    wrench_ground: Float[np.ndarray, "frames 6"],
    *,
    rate: float,
    speed_m_s: float,
) -> Bool[np.ndarray, "frames feet"]:
    """Feet that may carry: the one nearest to the force's line, and others of which a corner moves with it.

    The nearest foot's lowest corner tells how the ground or belt moves. A swinging foot passes it; of one
    that rolls off or lands, some corner rests.

    Args:
        skeleton: scaled.
        foot_bodies: a body for each foot.
        q: generalized coordinates, two frames or more [rad or m].
        wrench_ground: force [N] and moment about the ground origin [N·m].
        rate: [Hz].
        speed_m_s: level speed against the ground from which a foot swings [m/s].

    Raises:
        ModelError: a foot's body has no sole.
    """
    R, p = body_poses(skeleton, q)
    own = soles(skeleton, foot_bodies)
    distances = np.stack([_nearest(sole, R, p, wrench_ground)[1] for sole in own], axis=1)
    frames, nearest = np.arange(len(q)), distances.argmin(axis=1)
    ground = np.zeros((len(q), len(LEVEL)))
    velocities = []
    for foot, sole in enumerate(own):
        corners = sole.corners_ground(R, p)
        velocity = np.gradient(corners[..., LEVEL], 1.0 / rate, axis=0)
        velocities.append(velocity)
        lowest = velocity[frames, corners[..., 1].argmin(axis=1)]
        ground = np.where((nearest == foot)[:, None], lowest, ground)
    slowest = [np.linalg.norm(v - ground[:, None], axis=2).min(axis=1) for v in velocities]
    goes_along = np.stack(slowest, axis=1) <= speed_m_s
    goes_along[frames, nearest] = True
    return goes_along


def distances_to_soles(
    skeleton: Skeleton,
    foot_bodies: Sequence[str],
    q: Float[np.ndarray, "frames dofs"],
    wrench_ground: Float[np.ndarray, "frames 6"],
) -> Float[np.ndarray, "frames feet"]:
    """How far from each sole, seen from above, the force's line meets the sole's height [m].

    Args:
        skeleton: scaled.
        foot_bodies: a body for each foot.
        q: generalized coordinates [rad or m].
        wrench_ground: force [N] and moment about the ground origin [N·m].

    Raises:
        ModelError: a foot's body has no sole.
    """
    R, p = body_poses(skeleton, q)
    return np.stack([_nearest(sole, R, p, wrench_ground)[1] for sole in soles(skeleton, foot_bodies)], axis=1)


def _shared(
    skeleton: Skeleton,
    own: Sequence[Sole],
    q: Float[np.ndarray, "frames dofs"],
    wrench_ground: Float[np.ndarray, "frames 6"],
    takes_part: Bool[np.ndarray, "frames feet"],
) -> tuple[
    Float[np.ndarray, "frames feet 3"], Float[np.ndarray, "frames feet 1"], Float[np.ndarray, "frames feet 3"]
]:
    """The soles' nearest points [m], the feet's shares, and their forces [N], which lean together."""
    R, p = body_poses(skeleton, q)
    nearest = [_nearest(sole, R, p, wrench_ground) for sole in own]
    points = np.stack([point for point, _ in nearest], axis=1)
    distances = np.stack([distance for _, distance in nearest], axis=1)
    weight = takes_part / (distances + TOUCHING_M)
    share = (weight / weight.sum(axis=1, keepdims=True))[:, :, None]
    forces = share * wrench_ground[:, None, :3]
    load = share * wrench_ground[:, None, 1:2]
    forces[..., LEVEL] += _leaning(load, points, centre_of_mass_of(skeleton, q))
    return points, share, forces


def _leaning(
    load: Float[np.ndarray, "frames feet 1"],
    points: Float[np.ndarray, "frames feet 3"],
    com_ground: Float[np.ndarray, "frames 3"],
) -> Float[np.ndarray, "frames feet 2"]:
    """Level forces [N] that cancel out in sum: each load leans towards the loads' common point."""
    total = load.sum(axis=1, keepdims=True)
    common = (load * points).sum(axis=1, keepdims=True) / np.where(total == 0, 1.0, total)
    height = np.maximum(com_ground[:, None, 1] - points[..., 1], LEAST_HEIGHT_M)[..., None]
    leaning = load * (common - points)[..., LEVEL] / height
    return leaning - load / np.where(total == 0, 1.0, total) * leaning.sum(axis=1, keepdims=True)


def _nearest(
    sole: Sole,
    R: Float[np.ndarray, "frames bodies 3 3"],
    p: Float[np.ndarray, "frames bodies 3"],
    wrench_ground: Float[np.ndarray, "frames 6"],
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, " frames"]]:
    """The point of a sole, seen from above, that is nearest to the force's line, and how near [m]."""
    height = sole.corners_ground(R, p)[..., 1].min(axis=1)
    pressure = _centre_of_pressure(wrench_ground, height)
    candidates, distances = [], []
    for part in sole.parts:
        corners = part.corners_body @ R[:, part.body].transpose(0, 2, 1) + p[:, None, part.body]
        nearest = _in_polygon(pressure, corners[..., [0, 2]])
        candidates.append(nearest)
        distances.append(np.linalg.norm(nearest - pressure, axis=1))
    best = np.argmin(distances, axis=0)
    chosen = np.stack(candidates)[best, np.arange(len(best))]
    return np.insert(chosen, 1, height, axis=1), np.min(distances, axis=0)


def _centre_of_pressure(
    wrench_ground: Float[np.ndarray, "frames 6"], height: Float[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 2"]:
    """Where the force acts at a height, x and z [m]: no moment about a level axis is left there."""
    force, moment = wrench_ground[:, :3], wrench_ground[:, 3:]
    vertical = np.maximum(force[:, 1], CONTACT_N)
    x = (moment[:, 2] + height * force[:, 0]) / vertical
    z = (height * force[:, 2] - moment[:, 0]) / vertical
    return np.stack([x, z], axis=1)


def _in_polygon(
    point: Float[np.ndarray, "frames 2"], corners: Float[np.ndarray, "frames corners 2"]
) -> Float[np.ndarray, "frames 2"]:
    """The point itself where a convex polygon holds it, else the nearest one of its edges."""
    edge = np.roll(corners, -1, axis=1) - corners
    offset = point[:, None] - corners
    length2 = np.maximum((edge**2).sum(axis=2), 1e-12)
    along = np.clip((edge * offset).sum(axis=2) / length2, 0.0, 1.0)
    on_edges = corners + along[..., None] * edge
    side = edge[..., 0] * offset[..., 1] - edge[..., 1] * offset[..., 0]
    inside = (side >= 0).all(axis=1) | (side <= 0).all(axis=1)
    nearest = np.argmin(np.linalg.norm(point[:, None] - on_edges, axis=2), axis=1)
    return np.where(inside[:, None], point, on_edges[np.arange(len(point)), nearest])
