"""A fit of the crane: a synthetic skeleton that stands on one foot for a while."""

from pathlib import Path

import numpy as np
import pytest

from solver.capture.capture import Capture, Markers, Subject
from solver.capture.formats.storage import read_storage
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.settings import DynamicsSettings
from solver.fitting.fit_result import Fit, TrialFit
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.skeleton.osim import load_skeleton
from solver.skeleton.skeleton import Skeleton
from tests.contacts import contacts_of

RATE = 50.0
LOADED = slice(20, 60)


@pytest.fixture
def contacts(crane_q) -> ContactWrenches:
    """A foot that stands on frames 20 to 59, with a filter's tail on five frames more."""
    frames = len(crane_q)
    t = np.arange(frames) / RATE
    cop = np.full((frames, 1, 3), np.nan)
    cop[LOADED, 0] = np.column_stack([0.1 + 0.2 * t, 0.01 + 0 * t, -0.1 + 0 * t])[LOADED]
    force = np.zeros((frames, 3))
    force[LOADED] = np.column_stack([20 * np.sin(9 * t), 300 + 50 * np.sin(5 * t), 10 * np.cos(4 * t)])[
        LOADED
    ]
    free = np.zeros((frames, 3))
    free[LOADED, 1] = 3.0
    moment = np.cross(np.nan_to_num(cop[:, 0]), force) + free
    force[60:65, 1], moment[60:65, 0] = [9, 5, 2, 1, 0.3], [1, 0.7, 0.3, 0.1, 0.0]
    wrench = np.hstack([force, moment])[:, None]
    loaded = np.isfinite(cop[..., 0])
    plate = np.zeros((frames, 1), dtype=int)
    return contacts_of(("foot_r",), wrench, cop_ground=cop, in_contact=loaded, plate=plate)


@pytest.fixture
def fit(crane, crane_q, contacts) -> Fit:
    motion = Motion(crane.dofs, crane_q, RATE, start_time=0.35)
    mask = FrameMask(np.ones((len(crane_q), 1), dtype=bool))
    markers = Markers(("M0",), np.zeros((len(crane_q), 1, 3)), RATE, 0.35)
    trial = TrialFit(
        capture=Capture("walk", markers),
        motion=motion,
        marker_errors=MarkerErrors(("M0",), np.zeros((len(crane_q), 1))),
        model_markers_ground=np.zeros((len(crane_q), 1, 3)),
        contacts=contacts,
        mask=mask,
        dynamics=inverse_dynamics(crane, motion, contacts, mask, DynamicsSettings()),
    )
    return Fit(Subject(Path("subject"), ()), crane, (trial,), mass_kg=crane.mass, height_m=1.7)


@pytest.fixture(scope="session")
def recorded_walk(real_data) -> tuple[Skeleton, Motion]:
    """A full-body model with moving knees, and a walk of 238 frames that others have fitted to it."""
    folder = real_data / "walk_rajagopal2015"
    skeleton = load_skeleton(folder / "unscaled_generic.osim")
    table = read_storage(folder / "reference" / "walk_ik_addbiomechanics.mot")
    q = np.column_stack([table.column(name) for name in skeleton.dofs])
    return skeleton, Motion(skeleton.dofs, q, 100.0)
