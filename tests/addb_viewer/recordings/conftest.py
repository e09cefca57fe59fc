"""A small fit whose every number is known, and recordings of it."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from addb_viewer.trial_view.recorded_subject import recording_of
from annotations.events import ClearRange, Edit, FlagRange, Undo
from solver.capture.capture import Capture, ForcePlate, Markers, Subject, TrialFiles
from solver.capture.formats.analog_channels import AnalogChannels
from solver.common.notes import Kind, noted
from solver.contact.detected_ranges import Proposal
from solver.contact.wrenches import FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.export.c3d_file import C3dRecording, write_c3d
from solver.fitting.fit_result import Fit, KinematicsOnly, TrialFit
from solver.fitting.settings import Settings, as_dict
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.skeleton.forward import marker_positions
from solver.skeleton.functions import Linear
from solver.skeleton.skeleton import Axis, Body, Coordinate, Joint, Marker, Skeleton
from tests.contacts import contacts_of

FRAMES, RATE, START = 40, 50.0, 0.35
FORCE_RATE = 5 * RATE
MISSING = (30, 36)  # frames whose force does not count
COORDINATES = ("tx", "ty", "tz", "turn", "tilt", "list", "knee")


@pytest.fixture(scope="session")
def skeleton() -> Skeleton:
    """A pelvis that moves freely, and one leg with a knee; six markers."""
    x, y, z = np.eye(3)
    free = [("translation", x, "tx"), ("translation", y, "ty"), ("translation", z, "tz")]
    free += [("rotation", y, "turn"), ("rotation", z, "tilt"), ("rotation", x, "list")]
    root = tuple(Axis(kind, axis, Linear(1.0, 0.0), name) for kind, axis, name in free)
    knee = (Axis("rotation", z, Linear(1.0, 0.0), "knee"),)
    bodies = ("pelvis", "calcn_r")
    return Skeleton(
        name="leg",
        bodies=tuple(Body(b, 20.0, np.array([0.0, -0.1, 0.0]), np.diag([1.0, 0.5, 1.0])) for b in bodies),
        joints=(
            Joint("root", -1, np.eye(3), np.zeros(3), np.eye(3), np.zeros(3), root),
            Joint("knee", 0, np.eye(3), np.array([0.0, -0.5, 0.1]), np.eye(3), np.zeros(3), knee),
        ),
        coordinates=tuple(
            Coordinate(
                n, "translation" if n.startswith("t") and len(n) == 2 else "rotation", 0.0, (-9.0, 9.0)
            )
            for n in COORDINATES
        ),
        markers=tuple(
            Marker(f"M{i}", i // 3, 0.1 * np.array([np.cos(i), np.sin(i), 0.3 * i])) for i in range(6)
        ),
    )


@pytest.fixture(scope="session")
def q(skeleton) -> np.ndarray:
    """A smooth motion in the order of the skeleton's coordinates."""
    t = np.arange(FRAMES) / RATE
    by_name = {name: 0.2 * np.sin(3 * t + i) for i, name in enumerate(COORDINATES)}
    by_name |= {"tx": 1.1 * t, "ty": 0.9 + 0.02 * np.sin(7 * t)}
    return np.stack([by_name[name] for name in skeleton.dofs], axis=1)


def _plates():
    samples = int(FRAMES * FORCE_RATE / RATE)
    t = START + np.arange(samples) / FORCE_RATE
    plates = []
    for k, loaded in enumerate((t < START + 0.4, t > START + 0.5)):
        force = np.stack([20 * np.sin(t), 400 + 50 * np.cos(3 * t), 5 * t], axis=1) * loaded[:, None]
        cop = np.where(loaded[:, None], np.stack([0.3 + t, 0 * t, 0.1 + 0 * t], axis=1), np.nan)
        corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0.5], [0, 0, 0.5]])
        corners[:, 0] += 1.1 * k
        moment = np.cross(np.nan_to_num(cop), force)
        plates.append(ForcePlate(f"plate {k + 1}", force, moment, cop, FORCE_RATE, START, corners))
    return tuple(plates)


@pytest.fixture
def make_fit(skeleton, q, tmp_path):
    """Makes the fit with trials of these names."""

    def made(*names):
        folder = tmp_path / "Zoë"
        folder.mkdir(exist_ok=True)
        files = tuple(TrialFiles(name, folder / f"{i}.trc") for i, name in enumerate(names))
        trials = tuple(_trial(name, skeleton, q + 0.1 * i) for i, name in enumerate(names))
        return Fit(
            subject=Subject(folder, files, mass_kg=40.0, foot_bodies=("calcn_r",)),
            skeleton=skeleton,
            trials=trials,
            mass_kg=40.0,
            height_m=1.6,
            settings=as_dict(Settings()),
            provenance={"addb-viewer": "0.1.0"},
            notes=noted(Kind.PERSON, "height not given"),
        )

    return made


def _trial(name, skeleton, q):
    model = marker_positions(skeleton, q)
    rng = np.random.default_rng(5)
    measured = model + rng.normal(0, 0.01, model.shape)
    measured[3:9, 2] = np.nan
    distance = np.linalg.norm(measured - model, axis=2)
    names = tuple(marker.name for marker in skeleton.markers)
    motion = Motion(skeleton.dofs, q, RATE, START)
    alone = replace(motion, q=q + 0.01)
    shifted = np.linalg.norm(measured - marker_positions(skeleton, q + 0.01), axis=2)
    counts = np.ones((FRAMES, 1), dtype=bool)
    counts[slice(*MISSING)] = False
    plate = np.zeros((FRAMES, 2), dtype=int)
    plate[:, 1] = -1
    wrench = np.zeros((FRAMES, 1, 6))
    wrench[..., 1] = 400.0
    return TrialFit(
        capture=Capture(
            name, Markers(names, measured, RATE, START), _plates(), notes=noted(Kind.PLATES, "y is up")
        ),
        motion=motion,
        marker_errors=MarkerErrors(names, distance),
        model_markers_ground=model,
        contacts=contacts_of(
            ("calcn_r",),
            wrench,
            cop_ground=np.zeros((FRAMES, 1, 3)),
            in_contact=np.ones((FRAMES, 1), dtype=bool),
            plate=plate,
        ),
        mask=FrameMask(counts, ((*MISSING, "calcn_r", "notOverForcePlate"),), source="review"),
        proposals=(Proposal((5, 9), "calcn_r", "forceDiscrepancy", 0.4, {}),),
        dynamics=Dynamics(
            joint_torques=np.zeros_like(q),
            residual_root=rng.normal(0, 30, (FRAMES, 6)),
            residual_raw_root=np.zeros((FRAMES, 6)),
            com_ground=model.mean(axis=1),
            root_ground=model[:, 0],
            used=counts[:, 0],
            motion=motion,
        ),
        kinematics_only=KinematicsOnly(alone, MarkerErrors(names, shifted)),
        costs=(90.0, 12.5),
        seconds={"load": 0.1, "kinematics": 0.5, "dynamics": 1.5},
    )


@pytest.fixture
def diagnosis(effect, figures):
    """One cause, acting twice."""
    return figures(effect("clock_offset", "all", ((2, 12), (20, 40)), offset_s=0.012))


@pytest.fixture
def edits():
    """A flag, another one and its undo, by two people."""
    when = datetime(2026, 3, 4, 5, 6, 7, tzinfo=UTC)
    return (
        Edit(3, "walk", "anna", when, FlagRange(30, 36, "notOverForcePlate", "calcn_r", "off the plate")),
        Edit(4, "walk", "ben", when, ClearRange(33, 34, None)),
        Edit(7, "walk", "ben", when, Undo(4)),
    )


@pytest.fixture
def analog() -> AnalogChannels:
    """A muscle that whispers, in volts, and a sensor without a unit."""
    t = np.arange(round(FRAMES / RATE * 2000)) / 2000
    values = np.stack([3e-5 * np.sin(400 * t), 2.5 + np.cos(9 * t)], axis=1).astype(np.float32)
    return AnalogChannels(("VL", "trigger 1"), ("V", ""), values.astype(float), 2000.0)


@pytest.fixture
def recording(make_fit, diagnosis, edits, analog, tmp_path):
    """Of the trial `walk`, with everything that there may be."""
    file = tmp_path / "walk.c3d"
    write_c3d(file, C3dRecording(Markers(("A",), np.ones((FRAMES, 1, 3)), RATE), analog=analog))
    found = recording_of(make_fit("walk"), diagnosis=diagnosis, edits=edits)
    return replace(found, trials=tuple(replace(record, files=(file,)) for record in found.trials))
