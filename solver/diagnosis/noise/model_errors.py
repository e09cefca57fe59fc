"""What a sound recording's balance may be off by: inertias, soft tissue, and brief errors of the model."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.observed_trial import Scene
from solver.dynamics.inertia_parameters import pseudo_inertia, required_wrench
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.weighted_means import Windows
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.kinematics.unseen_bodies import undetermined_dofs
from solver.skeleton.chain import Moving, chain_of
from solver.skeleton.forward import cross
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Body

# relative, where no mass was entered: what forces carry, of which some may be missing. With more, a foot
# beside the plates all along would only seem to make the person lighter
UNWEIGHED_MASS_STD = 0.012
SCALE_STD = 0.002  # relative, of a scale that stands level, read with all that is worn in the trials
SEGMENT_INERTIA_STD = 0.10  # relative scatter of their moments of inertia
BOUNCE_STD = 0.10  # skin and a stiff trunk exaggerate the motion of the centre of mass by 10 to 20 %
SWAY_STD = 0.05  # likewise along the ground, where nearly all of such motion is real
SPIN_STD = 0.10  # likewise of the spin, which a person's build changes as well
TISSUE_LEAST_SHARE = 0.02  # of body mass; lighter segments hardly matter
# off neutral, RMS of the back over thirteen recordings whose markers show it; of arms, which weigh less, 0.7
UNSEEN_POSTURE_STD_RAD = 0.25
MODEL_FORCE_SHARE = 0.008  # [BW] what the model gets wrong for a tenth of a second at a time
MODEL_MOTION_SHARE = 0.06  # likewise, of the force that accelerations demand
MODEL_ARM_M = 0.008  # lever of such errors about the centre of mass, times body weight
MODEL_TIME_S = 0.06  # how long they last


Reduce = Callable[[np.ndarray], np.ndarray]  # wrenches about the ground origin, frame by frame, to rows


def nuisances(
    scene: Scene, reduce: Reduce, settings: DiagnosisSettings
) -> Float[np.ndarray, "rows nuisances"]:
    """Inertias and what skin exaggerates, shared by trials, each column at one standard deviation."""
    return np.concatenate([_inertias(scene, reduce, settings), _bounce(scene, reduce)], axis=1)


def mass_change(scene: Scene, reduce: Reduce, settings: DiagnosisSettings) -> Float[np.ndarray, " rows"]:
    """What the whole body's mass changes, one standard deviation of all that may be wrong with it."""
    columns = np.column_stack(
        [
            reduce(_required_by(scene, b, body_inertia[None])[:, :, 0])
            for b, body_inertia in _unit_masses(scene)
        ]
    )
    covariance = _mass_covariance(scene, settings)
    return np.asarray(columns @ covariance.sum(axis=1) / np.sqrt(covariance.sum()))


def _inertias(
    scene: Scene, reduce: Reduce, settings: DiagnosisSettings
) -> Float[np.ndarray, "rows nuisances"]:
    """What segments' masses, centres of mass and inertias change, each by a standard deviation."""
    columns, masses = [], []
    for b, per_kg in _unit_masses(scene):
        body = scene.skeleton.bodies[b]
        changes = [per_kg]
        for axis in np.eye(3):
            change = np.zeros((4, 4))
            change[:3, 3] = change[3, :3] = body.mass * axis
            change[:3, :3] = body.mass * (np.outer(axis, body.com_body) + np.outer(body.com_body, axis))
            changes.append(change * settings.segment_com_std_m)
        second = body.mass * (per_kg[:3, :3] - np.outer(body.com_body, body.com_body))
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            change = np.zeros((4, 4))
            size = np.sqrt(abs(second[i, i] * second[j, j])) * SEGMENT_INERTIA_STD
            change[i, j] = change[j, i] = size if i == j else 0.5 * size
            changes.append(change)
        own = reduce(_required_by(scene, b, np.array(changes)))
        masses.append(own[:, 0])
        columns.append(own[:, 1:])
    H = np.column_stack(masses)
    columns.append(H @ np.linalg.cholesky(_mass_covariance(scene, settings)))
    return np.concatenate(columns, axis=1)


def _unit_masses(scene: Scene) -> list[tuple[int, Float[np.ndarray, "4 4"]]]:
    """Pseudo-inertias for a kilogram of every body that has a mass."""
    return [(b, pseudo_inertia(body) / body.mass) for b, body in _heavy(scene)]


def _heavy(scene: Scene) -> list[tuple[int, Body]]:
    return [(b, body) for b, body in enumerate(scene.skeleton.bodies) if body.mass > 0]


def _mass_covariance(scene: Scene, settings: DiagnosisSettings) -> Float[np.ndarray, "bodies bodies"]:
    """Of segments' masses, their sum held to the entered one [kg²].

    Of somebody whom nobody weighed, all may be heavier together.
    """
    masses = np.array([body.mass for _, body in _heavy(scene)])
    std = settings.segment_mass_std * masses
    whole = (settings.body_mass_std * scene.skeleton.mass) ** -2.0
    covariance = np.linalg.inv(np.diag(std**-2.0) + whole)
    if not scene.mass_was_entered:
        covariance = covariance + UNWEIGHED_MASS_STD**2 * np.outer(masses, masses)
    return np.asarray(covariance)


def _required_by(
    scene: Scene, body: int, changes: Float[np.ndarray, "changes 4 4"]
) -> Float[np.ndarray, "frames 6 changes"]:
    """What changes of a body's pseudo-inertia demand, about the ground origin."""
    required = required_wrench(
        scene.material[:, body : body + 1], scene.T_ground_body[:, body : body + 1], changes[None]
    )
    return required[:, 0].transpose(0, 2, 1)


def _bounce(scene: Scene, reduce: Reduce) -> Float[np.ndarray, "rows 6"]:
    """Accelerations of the whole body along each axis, and changes of its spin about each, exaggerated."""
    inertial = scene.required_ground.copy()
    inertial[:, :3] += scene.skeleton.mass * np.asarray(scene.skeleton.gravity)
    about_com = scene.required_ground[:, 3:] - cross(scene.com_ground, scene.required_ground[:, :3])
    columns = []
    sizes = (SWAY_STD, BOUNCE_STD, SWAY_STD, *[SPIN_STD] * 3)
    for axis, size in enumerate(sizes):
        bounce = np.zeros_like(inertial)
        if axis < 3:
            bounce[:, axis] = inertial[:, axis]
            bounce[:, 3:] = cross(scene.com_ground, bounce[:, :3])
        else:
            bounce[:, axis] = about_com[:, axis - 3]
        columns.append(size * reduce(bounce))
    return np.stack(columns, axis=1)


def soft_tissue(
    scene: Scene, reduce: Reduce, settings: DiagnosisSettings
) -> Float[np.ndarray, "rows columns"]:
    """Segments whose markers slide together over the bone with the angles of the joints beside them.

    Shared by trials, each column at one standard deviation. A segment displaced by u, mass m at x:
    force m ü, moment about the ground origin u × m (ẍ − g) + x × m ü.
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
    for b in skeleton.bodies_from_share(TISSUE_LEAST_SHARE):
        body = skeleton.bodies[b]
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
                columns.append(reduce(np.concatenate([force, moment], axis=1)))
    return np.stack(columns, axis=1) if columns else np.zeros((len(reduce(scene.required_ground)), 0))


def unseen_posture(scene: Scene, windows: Windows) -> Float[np.ndarray, "rows rows"]:
    """Of the angles about which joints move that move no marker: the model has them neutral."""
    rows = 6 * windows.count
    unseen = undetermined_dofs(scene.skeleton, scene.markers.observed_ground)
    if not unseen.any():
        return np.zeros((rows, rows))
    model, state = RigidBodyModel(scene.skeleton), (scene.motion.q, scene.velocity, scene.acceleration)
    by_q = momentum_terms(model, *state, scene.measured_ground).by_q[:, :, unseen]
    columns = UNSEEN_POSTURE_STD_RAD * windows.means(by_q).reshape(rows, -1)
    return np.asarray(columns @ columns.T)


def model_error(scene: Scene, windows: Windows) -> Float[np.ndarray, "rows rows"]:
    """Errors that last `MODEL_TIME_S`, larger where the body accelerates."""
    time_s = windows.centre / scene.rate
    together = np.exp(-0.5 * ((time_s[:, None] - time_s) / MODEL_TIME_S) ** 2)
    weight = scene.weight_N
    demand = scene.required_ground[:, :3] - scene.skeleton.mass * -np.asarray(scene.skeleton.gravity)
    level = np.sqrt((windows.means(demand**2)).mean(axis=0))
    force = MODEL_FORCE_SHARE * weight + MODEL_MOTION_SHARE * level
    moment = np.full(3, MODEL_ARM_M * weight)
    return np.kron(together, np.diag(np.concatenate([force, moment]) ** 2))
