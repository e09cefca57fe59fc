"""What all tests share: where the real recordings lie, and saying so when they are missing."""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from solver.capture.capture import Capture, Markers, Subject, TrialFiles
from solver.capture.subject.opened_subject import open_subject
from solver.common.notes import Kind, noted
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.skeleton.functions import CubicSpline, Linear
from solver.skeleton.skeleton import Axis, Body, Coordinate, Joint, Marker, Skeleton

PROJECT = Path(__file__).resolve().parent.parent
DEFAULTS = Settings()
NO_HELD_OUT = replace(DEFAULTS, trajectory=replace(DEFAULTS.trajectory, held_out=False))
MARKERS_ALONE = replace(DEFAULTS, trajectory=replace(DEFAULTS.trajectory, enabled=False))


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real recordings: $ADDB_DATA, else ../shared/data beside the project."""
    folder = Path(os.environ.get("ADDB_DATA", PROJECT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real recordings not found in {folder}; set ADDB_DATA to their folder")
    return folder


@pytest.fixture(scope="session")
def recorded_fit(real_data: Path) -> Callable[..., Fit]:
    """The fit of a real recording, of all its trials or of some, made once: nobody changes it."""

    @cache
    def made(folder: str, settings: Settings = DEFAULTS, trials: tuple[str, ...] | None = None) -> Fit:
        if not (real_data / folder).is_dir():
            pytest.skip(f"{folder} is not among the recordings")
        return solve(open_subject(real_data / folder), settings, trials=trials)

    return made


@dataclass(frozen=True)
class SmallDisk:
    """A file system of four megabytes, so that it can be filled."""

    folder: Path

    def fill(self, but: int = 0) -> None:
        """Write until no more than `but` bytes are free, to a page."""
        with (self.folder / "filler").open("ab", buffering=0) as file, suppress(OSError):
            while (room := shutil.disk_usage(self.folder).free - but) > 0:
                file.write(bytes(min(65536, room)))

    def empty(self) -> None:
        """Free what `fill` took."""
        (self.folder / "filler").unlink()


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[SmallDisk]:
    """A disk that can be filled; skipped where this account may not mount one."""
    place = tmp_path / "small disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", str(place)]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no disk of its own can be mounted here ({getattr(error, 'stderr', error)})")
    yield SmallDisk(place)
    subprocess.run(["umount", "--lazy", str(place)], check=True)


@pytest.fixture
def read_only(tmp_path: Path) -> Iterator[Callable[[Path], Path]]:
    """Shows a folder at another place, where nobody may write; skipped where this account may not mount."""
    places: list[Path] = []

    def shown(folder: Path) -> Path:
        place = tmp_path / f"read-only {len(places)}" / folder.name
        place.mkdir(parents=True)
        for command in (["--bind", str(folder)], ["-o", "remount,bind,ro"]):
            try:
                subprocess.run(["mount", *command, str(place)], check=True, capture_output=True, text=True)
            except (OSError, subprocess.CalledProcessError) as error:
                pytest.skip(f"nothing can be mounted here ({getattr(error, 'stderr', error)})")
            places.append(place)
        return place

    yield shown
    for place in dict.fromkeys(places):
        subprocess.run(["umount", "--lazy", str(place)], check=True)


@pytest.fixture
def small_fit(tmp_path: Path) -> Fit:
    """A fit made by hand: one trial of four frames with forces on three of them, one without any forces.

    100 kg and 2 m, so that one body weight is 980.665 N. Residual forces of 3, 4 and 12 N along x, y and z on
    the used frames, 1000 N on the unused one; moments likewise ten times smaller; raw ones twice as large.
    """
    folder = tmp_path / "Zoë Ørsted"
    trials = tuple(
        TrialFiles(name=name, markers=folder / "trials" / name / "markers.trc")
        for name in ("walk", "no/forces")
    )
    subject = Subject(
        folder=folder, trials=trials, mass_kg=98.5, notes=noted(Kind.OTHER, "height read from the model")
    )
    with_forces, without = (
        Capture(name=trial.name, markers=_markers(), files=(trial.markers,)) for trial in trials
    )
    return Fit(
        subject=subject,
        skeleton=_one_segment(),
        trials=(
            replace(
                _moved(with_forces), **_forces(), seconds={"load": 0.5, "kinematics": 2.0, "dynamics": 0.25}
            ),
            replace(_moved(without), notes=noted(Kind.OTHER, "no forces found")),
        ),
        mass_kg=100.0,
        height_m=2.0,
        settings={"kinematics": {"iterations": 60}},
        provenance={"numpy": np.__version__},
    )


def _markers() -> Markers:
    positions = np.arange(24, dtype=float).reshape(4, 2, 3)
    positions[3, 1] = np.nan
    return Markers(names=("ASIS", "PSIS"), positions_ground=positions, rate=100.0, start_time=0.25)


def _one_segment() -> Skeleton:
    knots = CubicSpline(x=(0.0, 1.0, 2.0, 3.0), y=(0.0, 0.1, 0.4, 0.9))
    return Skeleton(
        name="one segment",
        bodies=(
            Body("thigh", mass=100.0, com_body=np.array([0, -0.2, 0]), inertia_body=np.diag([3.0, 1.0, 3.0])),
        ),
        joints=(
            Joint(
                name="hip",
                parent=-1,
                R_parent_frame=np.eye(3),
                p_parent_frame=np.array([0.1, 0.9, 1 / 3]),
                R_child_frame=np.eye(3),
                p_child_frame=np.zeros(3),
                axes=(
                    Axis("translation", np.array([1.0, 0, 0]), knots, "hip_flexion"),
                    Axis("rotation", np.array([0, 0, 1.0]), Linear(1.0, 0.0), "hip_flexion"),
                ),
            ),
        ),
        coordinates=(Coordinate("hip_flexion", "rotation", default=0.0, range=(-np.inf, np.inf)),),
        markers=(Marker("ASIS", 0, np.array([0.1, 0.0, 0.1]), fixed=True),),
    )


def _motion() -> Motion:
    return Motion(("hip_flexion",), q=np.array([[0.0], [0.1], [0.2], [0.3]]), rate=100.0, start_time=0.25)


def _moved(capture: Capture) -> TrialFit:
    distance = np.array([[0.003], [0.003], [0.021], [0.021]])  # [m] RMS 0.015, mean 0.012
    return TrialFit(
        capture=capture,
        motion=_motion(),
        marker_errors=MarkerErrors(("ASIS",), distance),
        model_markers_ground=np.ones((4, 1, 3)),
    )


def _forces() -> dict[str, object]:
    used = np.array([True, False, True, True])
    force = np.array([[3.0, 0, 0], [1000, 0, 0], [0, 4, 0], [0, 0, 12]])
    residual = np.hstack([force, force / 10])
    return {
        "contacts": ContactWrenches(
            foot_bodies=("thigh",),
            wrench_ground=np.zeros((4, 1, 6)),
            cop_ground=np.full((4, 1, 3), np.nan),
            observed=used,
            in_contact=np.zeros((4, 1), dtype=bool),
            plate=np.full((4, 1), -1),
            wrench_raw_ground=np.zeros((4, 1, 6)),
            notes=noted(Kind.PLATES, "plate 1 was not tared"),
        ),
        "mask": FrameMask(
            counts=used[:, None], reasons=((1, 2, "thigh", "manualReview"),), source="review.json"
        ),
        "dynamics": Dynamics(
            joint_torques=np.zeros((4, 1)),
            residual_root=residual,
            residual_raw_root=2 * residual,
            com_ground=np.zeros((4, 3)),
            root_ground=np.zeros((4, 3)),
            used=used,
            motion=_motion(),
        ),
    }
