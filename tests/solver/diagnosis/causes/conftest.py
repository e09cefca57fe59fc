"""A walk whose motion is known exactly, as effects see it; and the test that every signature must pass."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from solver.capture.capture import Capture, ForcePlate
from solver.capture.plates.conditioning import condition, plate_loads
from solver.contact.assignment import assign
from solver.contact.sole import soles
from solver.diagnosis.causes.observed_trial import MarkerScene, PlateScene, Scene
from solver.dynamics.inertia_parameters import pseudo_inertia, required_wrench
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.root_wrench import centre_of_mass
from solver.fitting.settings import Settings
from solver.simulate.demo_subject import MARKERS
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under, recorded_markers
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton
from tests.conftest import MARKERS_ALONE
from tests.solver.diagnosis.tracked_markers import record_markers, track

RATE = 100.0  # [Hz]
FEET = ("calcn_r", "calcn_l")
NOISELESS = MeasurementSettings(
    marker_noise_m=0.0, gaps_per_marker_minute=0.0, force_noise_N=(0, 0, 0), moment_noise_Nm=(0, 0, 0)
)


SOMEBODY = Person(75.0, 1.80)


@pytest.fixture(scope="session")
def walk() -> SyntheticTrial:
    """Two and a half seconds of walking across the laboratory's axes."""
    body_rng, motion_rng = np.random.default_rng(4).spawn(2)
    scenario = Scenario("walk", "walk", duration=2.5, heading_deg=20.0)
    return simulate_trial(scenario, body_of(Person(68.0, 1.72), body_rng), motion_rng)


@pytest.fixture(scope="session")
def walk_capture(walk) -> Capture:
    """Every step on a plate of its own, recorded without noise."""
    plates = plates_under(walk.contacts, (0.0, walk.scenario.duration))
    return measure(walk, plates, MARKERS, NOISELESS, np.random.default_rng(0))


@pytest.fixture(scope="session")
def scene(walk, walk_capture) -> Scene:
    """The walk with the exact motion and the true body."""
    return scene_of_trial(walk, walk_capture)


@pytest.fixture(scope="session")
def closed(scene) -> Scene:
    """The walk with plates that give exactly what the motion demands: no filter in between."""
    return recording(scene, scene.required_ground)


@pytest.fixture(scope="session")
def explains() -> Callable[..., float]:
    """How much of an effect its signature leaves over, as a share of the effect (root mean square)."""

    def left_over(candidate, scene, eta, x, missing) -> float:
        signature = candidate.signature(scene, eta)
        given = signature.columns @ np.asarray(x, dtype=float)
        given = given if signature.fixed is None else given + signature.fixed
        size = np.sqrt((missing**2).mean(axis=0)) + 1e-9
        return float(np.sqrt((((missing - given) / size) ** 2).mean()))

    return left_over


@pytest.fixture(scope="session")
def seen(walk) -> Callable[[Capture], Scene]:
    """What the diagnosis would see of another recording of the walk."""
    return lambda capture: scene_of_trial(walk, capture)


@pytest.fixture(scope="session")
def crisp(walk_capture) -> Capture:
    """The walk's recording with zeros below 40 N: no small effect moves a sample across the threshold."""

    def cut(plate: ForcePlate) -> ForcePlate:
        small = plate.force_ground[:, [1]] < 40.0
        return replace(
            plate,
            force_ground=np.where(small, 0.0, plate.force_ground),
            moment_ground=np.where(small, 0.0, plate.moment_ground),
            cop_ground=np.where(small, np.nan, plate.cop_ground),
        )

    return replace(walk_capture, plates=tuple(cut(plate) for plate in walk_capture.plates))


@pytest.fixture(scope="session")
def refiled() -> Callable[[ForcePlate, Callable], ForcePlate]:
    """A plate with the columns of its file changed: force, centre of pressure, moment about that."""

    def change(plate: ForcePlate, what: Callable) -> ForcePlate:
        force, unloaded = plate.force_ground, np.isnan(plate.cop_ground)
        point = np.nan_to_num(plate.cop_ground)
        force, point, free = what(force, point, plate.moment_ground - np.cross(point, force))
        moment = free + np.cross(point, force)
        cop = np.where(unloaded, np.nan, point)
        return replace(plate, force_ground=force, moment_ground=moment, cop_ground=cop, point_ground=cop)

    return change


@pytest.fixture(scope="session")
def on_one_plate(walk) -> Callable[[Callable], Capture]:
    """The walk on one large plate whose samples are of the times that a clock tells, without noise."""

    def record(clock: Callable) -> Capture:
        times = np.arange(round(walk.scenario.duration * 1000) + 1) / 1000
        wrench = walk.reactions(clock(times)).wrench_ground.sum(axis=1)
        force, moment = wrench[:, :3], wrench[:, 3:]
        cop = np.stack([moment[:, 2], 0 * times, -moment[:, 0]], axis=1) / force[:, [1]]
        corners = np.array([(3.0, 0, 2), (3, 0, -2), (-3, 0, -2), (-3, 0, 2)])
        plate = ForcePlate("ground_force_1", force, moment, cop, 1000.0, corners_ground=corners)
        return Capture("walk", recorded_markers(walk, MARKERS, NOISELESS, np.random.default_rng(0)), (plate,))

    return record


def scene_of_trial(trial: SyntheticTrial, capture: Capture, settings: Settings | None = None) -> Scene:
    """What the diagnosis would see if the markers told the motion exactly."""
    settings = settings or Settings()
    motion = trial.frames(RATE)
    times = motion.times
    skeleton = trial.body.skeleton
    kinematics = ForwardKinematics(skeleton)
    poses = kinematics.poses(motion.q)
    v, a = trial.motion.derivative(times, 1), trial.motion.derivative(times, 2)
    material, T = material_accelerations(kinematics, poses, motion.q, v, a)
    J = np.stack([pseudo_inertia(body) for body in skeleton.bodies])
    R, p = poses.R_ground_body, poses.p_ground_body
    conditioned = [condition(plate, times, settings.conditioning) for plate in capture.plates]
    observed = np.full((motion.frames, len(skeleton.markers), 3), np.nan)
    for m, name in enumerate(capture.markers.names):
        observed[:, skeleton.marker_names.index(name)] = capture.markers.positions_ground[:, m]
    return Scene(
        name=trial.scenario.name,
        skeleton=skeleton,
        motion=motion,
        velocity=v,
        acceleration=a,
        R_ground_body=R,
        p_ground_body=p,
        material=material,
        com_ground=centre_of_mass(skeleton, poses),
        required_ground=required_wrench(material, T, J).sum(axis=1),
        plates=tuple(_plate(k, plate, times, settings) for k, plate in enumerate(capture.plates)),
        markers=MarkerScene(
            skeleton.marker_names, kinematics.marker_bodies, observed, kinematics.markers(poses)
        ),
        soles=tuple(soles(skeleton, FEET)),
        contacts=assign(
            conditioned, R, p, skeleton=skeleton, foot_bodies=FEET, times=times, settings=settings.contact
        ),
        proposals=(),
        counts=np.ones(motion.frames, dtype=bool),
        contact_settings=settings.contact,
        trajectory_settings=settings.trajectory,
    )


def recording(scene: Scene, wrench_ground: np.ndarray) -> Scene:
    """The same trial with these wrenches recorded: by its first plate, the others at rest."""
    first, *others = scene.plates
    loaded = wrench_ground[:, 1] > 20.0
    silent = [
        replace(p, wrench_ground=np.zeros_like(p.wrench_ground), loaded=~loaded & False) for p in others
    ]
    plates = (replace(first, wrench_ground=np.array(wrench_ground), loaded=loaded), *silent)
    return replace(scene, plates=plates)


def _plate(k: int, plate, times: np.ndarray, settings: Settings) -> PlateScene:
    made = PlateScene(
        target=f"plate_{k + 1}",
        plate=plate,
        loads=plate_loads(plate, settings.conditioning),
        wrench_ground=np.zeros((len(times), 6)),
        loaded=np.zeros(len(times), dtype=bool),
        centre_ground=plate.corners_ground.mean(axis=0),
        times=times,
        conditioning=settings.conditioning,
    )
    wrench = np.nan_to_num(made.at_frames(made.loads.wrench_ground))
    return replace(made, wrench_ground=wrench, loaded=wrench[:, 1] >= settings.conditioning.threshold_N)


@pytest.fixture(scope="session")
def fitted() -> Callable[..., tuple]:
    """x and its covariance from what is missing in the balance of one trial, by least squares with the prior.

    Errors of 1 N and 1 N·m on every frame.
    """

    def fit(candidate, scene: Scene, missing: np.ndarray, eta: tuple = ()) -> tuple[np.ndarray, np.ndarray]:
        signature = candidate.signature(scene, eta)
        columns = signature.columns.copy()
        fixed = 0.0 if signature.fixed is None else signature.fixed
        A, y = columns.reshape(-1, columns.shape[2]), (missing - fixed).reshape(-1)
        covariance = np.linalg.inv(A.T @ A + np.diag(signature.prior_std**-2.0))
        return covariance @ (A.T @ y), covariance

    return fit


@pytest.fixture(scope="session")
def demand_of(walk) -> Callable[[Skeleton], np.ndarray]:
    """What the walk's motion demands of another body, from Pinocchio's algorithms."""
    times = walk.frames(RATE).times
    return lambda skeleton: GroundDemand(RigidBodyModel(skeleton)).wrench(*walk.motion.state(times))


@pytest.fixture(scope="session")
def seen_of() -> Callable[[SyntheticTrial, Capture], Scene]:
    """What the diagnosis would see of any trial."""
    return scene_of_trial


@pytest.fixture(scope="session")
def recorded(scene) -> Callable[[np.ndarray], Scene]:
    """The walk with these wrenches recorded instead."""
    return lambda wrench_ground: recording(scene, wrench_ground)


@pytest.fixture(scope="session")
def tracked(scene) -> Callable[..., Scene]:
    """A scene of these markers, with the motion that inverse kinematics finds for them."""

    return partial(track, scene)


@pytest.fixture(scope="session")
def long_walk() -> tuple:
    """Four seconds of somebody's markers with noise, gaps and skin, and the skeleton that orders them."""
    return record_markers(SOMEBODY, Scenario("walk", "walk", duration=4.0, heading_deg=-35.0), 8)


@pytest.fixture(scope="session")
def long_squat() -> tuple:
    """The same person's, who squats."""
    return record_markers(SOMEBODY, Scenario("squat", "squat", duration=4.0), 8)


@pytest.fixture(scope="session")
def real_walk(recorded_fit) -> tuple:
    """Markers of a recorded walk, the skeleton scaled to them, and their rate."""
    fit = recorded_fit("walk_rajagopal2015", MARKERS_ALONE)
    recorded, skeleton = fit.trials[0].capture.markers, fit.skeleton
    columns = [recorded.names.index(marker.name) for marker in skeleton.markers]
    return recorded.positions_ground[:, columns], skeleton, recorded.rate


@pytest.fixture(scope="module")
def sound(long_walk, tracked):
    """A walk in which nothing is wrong."""
    return tracked(*long_walk)
