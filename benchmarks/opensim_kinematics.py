"""OpenSim's own inverse kinematics on the same markers, equal weights, as the yardstick."""

import re
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
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
