"""OpenSim as yardstick and referee: inverse kinematics of the same markers, inverse dynamics of our files."""

import os
import re
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.capture.formats.storage import read_storage
from solver.capture.formats.trc import write_trc


@dataclass(frozen=True)
class OpenSimKinematics:
    """Marker errors of OpenSim's InverseKinematicsTool."""

    distance: Float[np.ndarray, "frames markers"]  # [m]
    markers: tuple[str, ...]
    cpu_seconds: float  # of the tool's run, without loading the model

    @property
    def rms(self) -> float:
        """Over all marker-frames [m]."""
        return float(np.sqrt(np.nanmean(self.distance**2)))

    @property
    def rms_frame_mean(self) -> float:
        """Mean of the frames' RMS [m]."""
        return float(np.nanmean(np.sqrt(np.nanmean(self.distance**2, axis=1))))

    @property
    def maximum(self) -> float:
        """Largest marker error [m]."""
        return float(np.nanmax(self.distance))


def opensim_inverse_kinematics(model_file: Path, markers: Markers) -> OpenSimKinematics:
    """Run OpenSim 4.6's InverseKinematicsTool.

    Args:
        model_file: scaled; muscles and other forces are taken out first, they only cost time.
        markers: as measured; those that the model knows are tracked, all with weight 1.
    """
    import opensim  # noqa: PLC0415  (a test-only wheel, absent on some platforms)

    opensim.Logger.setLevelString("Off")
    with tempfile.TemporaryDirectory() as scratch:
        bare = Path(scratch) / "model.osim"
        bare.write_text(without_forces(model_file.read_text(encoding="utf-8")), encoding="utf-8")
        trc = Path(scratch) / "markers.trc"
        write_trc(trc, markers)
        model = opensim.Model(str(bare))
        model.initSystem()
        known = {model.getMarkerSet().get(i).getName() for i in range(model.getMarkerSet().getSize())}
        tracked = [n for n in markers.names if n in known]
        tool = opensim.InverseKinematicsTool()
        tool.setModel(model)
        tool.setMarkerDataFileName(str(trc))
        tool.setStartTime(float(markers.times[0]))
        tool.setEndTime(float(markers.times[-1]))
        tool.setOutputMotionFileName(str(Path(scratch) / "ik.mot"))
        tool.setResultsDir(scratch)
        tool.set_report_errors(False)
        tool.set_report_marker_locations(True)
        for name in tracked:
            task = opensim.IKMarkerTask()
            task.setName(name)
            task.setApply(True)
            task.setWeight(1.0)
            tool.upd_IKTaskSet().cloneAndAppend(task)
        start = time.process_time()
        tool.run()
        seconds = time.process_time() - start
        located = next(Path(scratch).glob("*model_marker_locations.sto"))
        names, positions = _locations(located)
    column = [markers.names.index(n) for n in names]
    frames = min(len(positions), markers.frames)
    distance = np.linalg.norm(positions[:frames] - markers.positions_ground[:frames, column], axis=2)
    return OpenSimKinematics(distance, tuple(names), seconds)


def without_forces(osim: str) -> str:
    """The model text without its force and controller sets."""
    for tag in ("ForceSet", "ControllerSet"):
        osim = re.sub(rf"<{tag}( name=\"[^\"]*\")?>.*?</{tag}>", "", osim, flags=re.DOTALL)
    return osim


def _locations(path: Path) -> tuple[list[str], Float[np.ndarray, "frames markers 3"]]:
    lines = path.read_text(encoding="utf-8").splitlines()
    header = lines.index("endheader") + 1
    labels = lines[header].split("\t")[1:]
    names = [label.removesuffix("_tx") for label in labels[::3]]
    rows = np.array(
        [[float(x) for x in line.split("\t")[1:]] for line in lines[header + 1 :] if line.strip()]
    )
    return names, rows.reshape(len(rows), -1, 3)


@dataclass(frozen=True)
class Verdict:
    """What OpenSim's InverseDynamicsTool finds."""

    times: Float[np.ndarray, " rows"]  # [s]
    residual_root: Float[
        np.ndarray, "rows 6"
    ]  # force [N], moment about the root joint's centre [N·m], ground frame
    torques: dict[str, Float[np.ndarray, " rows"]]  # [N·m or N] by coordinate


def referee(folder: Path, trial: str) -> Verdict:
    """Run OpenSim on an exported trial.

    Args:
        folder: what `export_opensim` wrote.
        trial: its files' stem.
    """
    import opensim  # noqa: PLC0415 (a test dependency that not every machine has)

    opensim.Logger.setLevelString("error")
    with _inside(folder):
        if not opensim.InverseDynamicsTool(f"{trial}_id_setup.xml").run():
            raise RuntimeError(f"OpenSim's inverse dynamics of {folder / trial} failed")
    forces = read_storage(folder / f"{trial}_id_opensim.sto")
    motion = read_storage(folder / f"{trial}_ik.mot")
    model = opensim.Model(str(folder / "model.osim"))
    state = model.initSystem()
    coordinates = [model.getCoordinateSet().get(i) for i in range(model.getCoordinateSet().getSize())]
    torques = {}
    for coordinate in coordinates:
        name = coordinate.getName()
        label = next(x for x in (f"{name}_moment", f"{name}_force") if x in forces.labels)
        torques[name] = forces.column(label)
    root = _Root(model, opensim)
    rows = np.round((forces.times - motion.times[0]) * motion.rate).astype(int)
    residual = []
    for k, row in enumerate(rows):
        for coordinate in root.coordinates:
            coordinate.setValue(state, motion.column(coordinate.getName())[row], False)
        generalized = np.array([torques[c.getName()][k] for c in root.coordinates])
        residual.append(np.linalg.solve(root.jacobian(state).T, generalized))
    return Verdict(forces.times, np.array(residual), torques)


class _Root:
    """The joint between ground and pelvis, as OpenSim moves it."""

    def __init__(self, model, opensim) -> None:
        self.model = model
        joints = [model.getJointSet().get(i) for i in range(model.getJointSet().getSize())]
        joint = next(j for j in joints if j.getParentFrame().findBaseFrame().getName() == "ground")
        child = joint.getChildFrame()
        self.body = opensim.Body.safeDownCast(child.findBaseFrame())
        self.centre_body = child.findTransformInBaseFrame().p()
        self.coordinates = [joint.get_coordinates(i) for i in range(joint.numCoordinates())]

    def jacobian(self, state) -> Float[np.ndarray, "6 6"]:
        """Velocity of the joint's centre and angular velocity by each coordinate's speed; ground frame."""
        columns = []
        for moving in self.coordinates:
            for c in self.coordinates:
                c.setSpeedValue(state, 1.0 if c is moving else 0.0)
            self.model.realizeVelocity(state)
            linear = self.body.findStationVelocityInGround(state, self.centre_body)
            angular = self.body.getAngularVelocityInGround(state)
            columns.append([linear.get(i) for i in range(3)] + [angular.get(i) for i in range(3)])
        return np.array(columns).T


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    """OpenSim writes where it stands."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
