"""A short walk's balance whose errors are drawn from what the diagnosis says of them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.accepted_causes import extension_of
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.noise.balance_rows import WINDOW_S, TrialRows
from solver.diagnosis.noise.model_errors import (
    MODEL_ARM_M,
    MODEL_FORCE_SHARE,
    MODEL_MOTION_SHARE,
    MODEL_TIME_S,
    mass_change,
    model_error,
    nuisances,
    soft_tissue,
)
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.terms import Solved
from solver.dynamics.weighted_means import windows_over
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.simulate.demo_subject import MARKERS
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.laboratory import measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton
from tests.solver.diagnosis.causes.conftest import NOISELESS, RATE, scene_of_trial
from tests.solver.diagnosis.late_walk import LATE_S, Case, case_of

HOP_S = 0.06
SETTINGS = DiagnosisSettings()


@pytest.fixture(scope="session")
def short_walk() -> SyntheticTrial:
    """One and a half seconds of walking across the laboratory's axes."""
    body_rng, motion_rng = np.random.default_rng(4).spawn(2)
    scenario = Scenario("walk", "walk", duration=1.5, heading_deg=20.0)
    return simulate_trial(scenario, body_of(Person(68.0, 1.72), body_rng), motion_rng)


@pytest.fixture(scope="session")
def short_scene(short_walk) -> Scene:
    """With the exact motion, the true body and plates without noise."""
    plates = plates_under(short_walk.contacts, (0.0, short_walk.scenario.duration))
    return scene_of_trial(
        short_walk, measure(short_walk, plates, MARKERS, NOISELESS, np.random.default_rng(0))
    )


@pytest.fixture(scope="session")
def demands(short_walk) -> Callable[[Skeleton], np.ndarray]:
    """What the walk's motion demands of another body, from Pinocchio's algorithms."""
    times = short_walk.frames(RATE).times
    return lambda skeleton: GroundDemand(RigidBodyModel(skeleton)).wrench(*short_walk.motion.state(times))


@pytest.fixture(scope="session")
def rows_of() -> Callable[..., TrialRows]:
    """Rows of a scene whose markers err by nothing: plates' noise alone, beside inertias and model errors."""
    return trial_rows_of


@pytest.fixture(scope="session")
def short_rows(short_scene) -> TrialRows:
    """Rows of the short walk."""
    return trial_rows_of(short_scene)


@pytest.fixture(scope="session")
def drawn(short_scene) -> Callable[..., Scene]:
    """The walk with its demand off the plates by a draw of errors, and by any wrench given besides."""

    def draw(seed: int, missing_ground: np.ndarray | None = None, scale: float = 1.0) -> Scene:
        errors = errors_of(short_scene, np.random.default_rng(seed), scale)
        error = errors if missing_ground is None else errors + missing_ground
        return with_demand(short_scene, short_scene.measured_ground + error)

    return draw


@pytest.fixture(scope="session")
def balance_of_scenes() -> Callable[..., Balance]:
    """The balance of any scenes."""
    return lambda *scenes: Balance([trial_rows_of(s) for s in scenes], SETTINGS)


@pytest.fixture(scope="session")
def late(tmp_path_factory) -> Case:
    return case_of(tmp_path_factory.mktemp("late"), LATE_S)


@pytest.fixture(scope="session")
def on_time(tmp_path_factory) -> Case:
    return case_of(tmp_path_factory.mktemp("on_time"), 0.0)


@pytest.fixture(scope="session")
def late_clock(late) -> Solved:
    return late.solved(ClockOffset("all"), (0.0,))


@pytest.fixture(scope="session")
def late_extension(late, late_clock):
    return extension_of(late.balance.scenes, late_clock)


def trial_rows_of(scene: Scene, settings: DiagnosisSettings = SETTINGS) -> TrialRows:
    counts = np.ones(scene.frames, dtype=bool)
    counts[:5] = counts[-5:] = False
    windows = windows_over(counts, scene.rate, WINDOW_S, HOP_S)
    noise = np.tile(np.repeat([settings.force_noise_N, settings.moment_noise_Nm], 3), windows.count)
    nothing = np.zeros((0, 0))
    bare = TrialRows(scene, windows, np.diag(noise**2), nothing, nothing, nothing, np.zeros(0))
    return replace(
        bare,
        model_error=model_error(scene, windows),
        nuisance=nuisances(scene, bare.reduce, settings),
        tissue=soft_tissue(scene, bare.reduce, settings),
        mass=mass_change(scene, bare.reduce, settings),
    )


def with_demand(scene: Scene, required_ground: np.ndarray) -> Scene:
    """The same recording with another demand: residual = required − measured."""
    return replace(scene, required_ground=required_ground)


def errors_of(scene: Scene, rng: np.random.Generator, scale: float) -> np.ndarray:
    """Wrenches about the ground origin that last as long, and are as large, as model errors are."""
    t = scene.times
    time_history = np.exp(-0.5 * ((t[:, None] - t) / MODEL_TIME_S) ** 2) + 1e-8 * np.eye(len(t))
    inertial = scene.required_ground[:, :3] + scene.skeleton.mass * np.asarray(scene.skeleton.gravity)
    force = MODEL_FORCE_SHARE * scene.weight_N + MODEL_MOTION_SHARE * np.sqrt((inertial**2).mean(axis=0))
    std = scale * np.concatenate([force, np.full(3, MODEL_ARM_M * scene.weight_N)])
    wrench = std * (np.linalg.cholesky(time_history) @ rng.normal(size=(len(t), 6)))
    kept = 0.43  # of a frame's noise in a window's mean
    white = np.repeat([SETTINGS.force_noise_N, SETTINGS.moment_noise_Nm], 3) / kept
    wrench += white * rng.normal(size=wrench.shape)
    wrench[:, 3:] += np.cross(scene.com_ground, wrench[:, :3])
    return wrench
