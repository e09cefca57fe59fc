"""What a sound recording's balance may be off by: inertias, soft tissue, and brief errors of the model."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from solver.diagnosis.settings import DiagnosisSettings
from solver.dynamics.inertia_parameters import demanded_wrench, pseudo_inertia
from solver.dynamics.windows import Windows
from solver.effects.scene import Scene
from solver.skeleton.chain import Moving, chain_of
from solver.skeleton.forward import cross

Reduce = Callable[[np.ndarray], np.ndarray]  # wrenches about the ground origin, frame by frame, to rows


def nuisances(
    scene: Scene, reduced: Reduce, settings: DiagnosisSettings
) -> Float[np.ndarray, "rows nuisances"]:
    """All that trials of one subject share, each column at one standard deviation."""
    return np.concatenate(
        [
            _inertias(scene, reduced, settings),
            _bounce(scene, reduced, settings),
            _soft_tissue(scene, reduced, settings),
        ],
        axis=1,
    )


def _inertias(
    scene: Scene, reduced: Reduce, settings: DiagnosisSettings
) -> Float[np.ndarray, "rows nuisances"]:
    """What segments' masses, centres of mass and inertias change, each by a standard deviation."""
    skeleton = scene.skeleton
    columns, masses, mass_std = [], [], []
    for b, body in enumerate(skeleton.bodies):
        if body.mass <= 0:
            continue
        J = pseudo_inertia(body)
        changes = [J / body.mass]
        for axis in np.eye(3):
            change = np.zeros((4, 4))
            change[:3, 3] = change[3, :3] = body.mass * axis
            change[:3, :3] = body.mass * (np.outer(axis, body.com_body) + np.outer(body.com_body, axis))
            changes.append(change * settings.segment_com_std_m)
        second = J[:3, :3] - body.mass * np.outer(body.com_body, body.com_body)
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            change = np.zeros((4, 4))
            size = np.sqrt(abs(second[i, i] * second[j, j])) * settings.segment_inertia_std
            change[i, j] = change[j, i] = size if i == j else 0.5 * size
            changes.append(change)
        demanded = demanded_wrench(
            scene.material[:, b : b + 1], scene.T_ground_body[:, b : b + 1], np.array(changes)[None]
        )[:, 0]
        own = reduced(demanded.transpose(0, 2, 1))
        masses.append(own[:, 0])
        mass_std.append(settings.segment_mass_std * body.mass)
        columns.append(own[:, 1:])
    H = np.column_stack(masses)
    precision = np.diag(np.array(mass_std) ** -2.0) + (settings.body_mass_std * skeleton.mass) ** -2.0
    columns.append(H @ np.linalg.cholesky(np.linalg.inv(precision)))
    return np.concatenate(columns, axis=1)


def _bounce(scene: Scene, reduced: Reduce, settings: DiagnosisSettings) -> Float[np.ndarray, "rows 3"]:
    """Accelerations of the whole body along each axis, exaggerated."""
    columns = []
    inertial = scene.demanded_ground[:, :3] + scene.skeleton.mass * np.asarray(scene.skeleton.gravity)
    for axis in range(3):
        bounce = np.zeros_like(scene.demanded_ground)
        bounce[:, axis] = inertial[:, axis]
        bounce[:, 3:] = cross(scene.com_ground, bounce[:, :3])
        columns.append(settings.bounce_std * reduced(bounce))
    return np.stack(columns, axis=1)


def _soft_tissue(
    scene: Scene, reduced: Reduce, settings: DiagnosisSettings
) -> Float[np.ndarray, "rows columns"]:
    """Segments whose markers slide together over the bone with the angles of the joints beside them.

    A segment displaced by u, mass m at x: force m ü, moment about the ground origin u × m (ẍ − g) + x × m ü.
    """
    skeleton = scene.skeleton
    chain = chain_of(skeleton)
    moving = sorted(
        (m for steps in chain.steps for m in steps if isinstance(m, Moving)), key=lambda m: m.index
    )
    rotational = np.array([m.kind == "rotation" for m in moving], dtype=bool)
    angles = scene.motion.q - scene.motion.q.mean(axis=0)
    dt = 1 / scene.rate
    columns = []
    for b, body in enumerate(skeleton.bodies):
        if body.mass < settings.tissue_least_share * skeleton.mass:
            continue
        beside = [b, *(c for c, joint in enumerate(skeleton.joints) if joint.parent == b)]
        turning = rotational & np.isin(chain.body, [j for j in beside if skeleton.joints[j].parent >= 0])
        com = np.append(body.com_body, 1.0)
        x = scene.point_ground(b, body.com_body)
        weight_and_inertia = body.mass * (scene.material[:, b] @ com)
        for dof in np.unique(chain.dof[turning]):
            for axis in np.eye(3):
                u = settings.tissue_std_m_per_rad * angles[:, dof, None] * (scene.R_ground_body[:, b] @ axis)
                force = body.mass * np.gradient(np.gradient(u, dt, axis=0), dt, axis=0)
                moment = cross(u, weight_and_inertia) + cross(x, force)
                columns.append(reduced(np.concatenate([force, moment], axis=1)))
    return np.stack(columns, axis=1) if columns else np.zeros((len(reduced(scene.demanded_ground)), 0))


def model_error(
    scene: Scene, windows: Windows, settings: DiagnosisSettings
) -> Float[np.ndarray, "rows rows"]:
    """Errors that last `model_time_s`, larger where the body accelerates."""
    time_s = windows.centre / scene.rate
    together = np.exp(-0.5 * ((time_s[:, None] - time_s) / settings.model_time_s) ** 2)
    weight = scene.weight_N
    demand = scene.demanded_ground[:, :3] - scene.skeleton.mass * -np.asarray(scene.skeleton.gravity)
    level = np.sqrt((windows.means(demand**2)).mean(axis=0))
    force = settings.model_force_share * weight + settings.model_motion_share * level
    moment = np.full(3, settings.model_arm_m * weight)
    return np.kron(together, np.diag(np.concatenate([force, moment]) ** 2))
