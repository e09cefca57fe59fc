"""C3D files made up to order, written with ezc3d."""

from dataclasses import dataclass, field

import ezc3d
import numpy as np
import pytest

# Corner numbers follow the quadrants of the plate's x-y plane; with these, x_plate = y_lab, y_plate = x_lab
# and z_plate points down.
FLAT_CORNERS = np.array([[0.9, 0.6, 0.0], [0.9, 0.2, 0.0], [0.3, 0.2, 0.0], [0.3, 0.6, 0.0]])


@dataclass
class Plate:
    """One force platform as its file describes it, in the file's units."""

    kind: int
    channels: np.ndarray  # samples × channels
    corners: np.ndarray = field(default_factory=lambda: FLAT_CORNERS * 1000)  # 4 × 3
    origin: tuple = (0.0, 0.0, 0.0)
    units: tuple = ()
    calibration: np.ndarray = field(default_factory=lambda: np.eye(6))
    scale: float = 1.0


@pytest.fixture
def flat_corners():
    return FLAT_CORNERS.copy()


@pytest.fixture
def plate_of():
    return Plate


@pytest.fixture
def write_c3d():
    """write(path, points, labels, plates=…): points are frames × markers × 3 in `units`."""

    def write(path, points, labels, *, rate=100.0, units="mm", plates=(), samples_per_frame=1, **parameters):
        c3d = ezc3d.c3d()
        frames, count, _ = points.shape
        c3d["parameters"]["POINT"]["RATE"]["value"] = [rate]
        c3d["parameters"]["POINT"]["LABELS"]["value"] = list(labels)
        c3d["parameters"]["POINT"]["UNITS"]["value"] = [units] if units else []
        stored = np.ones((4, count, frames))
        stored[:3] = points.transpose(2, 1, 0)
        c3d["data"]["points"] = stored
        signals = [plate.channels for plate in plates]
        analogs = np.concatenate(signals, axis=1) if signals else np.zeros((frames * samples_per_frame, 0))
        c3d["parameters"]["ANALOG"]["RATE"]["value"] = [rate * samples_per_frame]
        c3d["parameters"]["ANALOG"]["LABELS"]["value"] = [f"channel{k}" for k in range(analogs.shape[1])]
        c3d["parameters"]["ANALOG"]["UNITS"]["value"] = [unit for plate in plates for unit in plate.units]
        c3d["parameters"]["ANALOG"]["SCALE"]["value"] = [1.0] * analogs.shape[1]
        c3d["parameters"]["ANALOG"]["OFFSET"]["value"] = [0] * analogs.shape[1]
        c3d["data"]["analogs"] = analogs.T[None]
        if plates:
            widest = max(plate.channels.shape[1] for plate in plates)
            channel = np.zeros((widest, len(plates)), int)
            first = 1
            for k, plate in enumerate(plates):
                width = plate.channels.shape[1]
                channel[:width, k] = np.arange(first, first + width)
                first += width
            c3d.add_parameter("FORCE_PLATFORM", "USED", [len(plates)])
            c3d.add_parameter("FORCE_PLATFORM", "TYPE", [plate.kind for plate in plates])
            c3d.add_parameter("FORCE_PLATFORM", "ZERO", [0, 0])
            c3d.add_parameter(
                "FORCE_PLATFORM", "CORNERS", np.stack([plate.corners.T for plate in plates], axis=2)
            )
            c3d.add_parameter(
                "FORCE_PLATFORM", "ORIGIN", np.array([plate.origin for plate in plates], float).T
            )
            c3d.add_parameter("FORCE_PLATFORM", "CHANNEL", channel.astype(float))
            c3d.add_parameter(
                "FORCE_PLATFORM", "CAL_MATRIX", np.stack([plate.calibration for plate in plates], axis=2)
            )
        for name, value in parameters.items():
            group, key = name.split("__")
            c3d.add_parameter(group, key, value)
        c3d.write(str(path))
        return path

    return write
