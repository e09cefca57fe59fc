"""What ezc3d finds in a C3D file, as plain arrays: parameters, points, analog samples."""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
from jaxtyping import Float

from solver.capture.formats.c3d_header import BLOCK, EXPORT_AGAIN, C3dHeader, read_data, read_header
from solver.common.errors import CaptureError
from solver.common.file_names import readable
from solver.common.notes import Kind, Note, noted


@dataclass(frozen=True)
class C3dContents:
    """One C3D file, axes and units as stored."""

    path: Path
    parameters: Any  # ezc3d's mapping of groups of parameters
    points: Float[np.ndarray, "frames points 3"]  # [POINT:UNITS] NaN where not seen
    rate: float  # [Hz] of the points
    analogs: Float[np.ndarray, "samples channels"]  # [ANALOG:UNITS]
    notes: tuple[Note, ...] = ()
    first_frame: int = 0  # recorded before the first that is stored; EVENT counts from there

    @property
    def samples_per_frame(self) -> int:
        """Analog samples for each frame of points."""
        return len(self.analogs) // max(1, len(self.points))

    def array(self, group: str, name: str) -> np.ndarray:
        """A numeric parameter in its own shape, first dimension first; empty where the file lacks it."""
        if group not in self.parameters or name not in self.parameters[group]:
            return np.zeros(0)
        return np.asarray(self.parameters[group][name]["value"], dtype=float)

    def number(self, group: str, name: str, default: float) -> float:
        """First value of a numeric parameter."""
        values = self.array(group, name).ravel()
        return float(values[0]) if len(values) else default

    def words(self, group: str, name: str) -> tuple[str, ...]:
        """A parameter of texts, stripped, with its continuation in NAME2, NAME3 and so on."""
        if group not in self.parameters:
            return ()
        found: list[str] = []
        for key in (name, *(f"{name}{part}" for part in range(2, 20))):
            if key in self.parameters[group]:
                found += [readable(str(word)).strip() for word in self.parameters[group][key]["value"]]
        return tuple(found)


def open_c3d(path: Path) -> C3dContents:
    """Open a C3D file.

    Raises:
        CaptureError: it is missing, empty, cut off, damaged, in SGI/MIPS numbers, or without points or rate.
    """
    header = read_header(path)
    try:
        raw = _read(path)
    except Exception as error:  # ezc3d raises whatever its C++ threw
        reason = str(error).split(". If you")[0].removesuffix(": iostream error")
        raise CaptureError(f"{path}: the C3D file is damaged ({reason}). {EXPORT_AGAIN}") from error
    points, analogs, notes = _data(path, raw, header)
    contents = C3dContents(path, raw["parameters"], points, 0.0, analogs)
    rate = contents.number("POINT", "RATE", 0.0)
    if not (np.isfinite(rate) and rate > 0):
        rate = float(raw["header"]["points"]["frame_rate"])
        notes += noted(Kind.OTHER, f"{path.name}: POINT:RATE is missing; the header's {rate:g} Hz is used")
    if not (np.isfinite(rate) and rate > 0):
        raise CaptureError(f"{path}: neither the header nor POINT:RATE gives the frame rate.")
    if points.shape[0] == 0 or points.shape[1] == 0:
        raise CaptureError(f"{path}: the file holds no marker. Export it with its trajectories.")
    padding = BLOCK // max(1, header.frame_bytes)
    if header.frames is None and header.frames_held - padding > points.shape[0]:
        notes += noted(
            Kind.OTHER,
            f"{path.name}: holds about {header.frames_held} frames, more than its header counts; the first "
            f"{points.shape[0]} are read. Export it in parts to use them all.",
        )
    if header.frames is not None and header.frames > points.shape[0]:
        notes += noted(
            Kind.LEFT_OUT,
            f"{path.name}: the header says {header.frames} frames, the file holds {points.shape[0]}",
        )
    return C3dContents(path, raw["parameters"], points, rate, analogs, notes, header.first_frame - 1)


def _read(path: Path) -> Any:
    if readable(str(path)) == str(path):
        return ezc3d.c3d(str(path))
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder, "read.c3d")
        link.symlink_to(path.resolve())  # ezc3d takes no name that is not UTF-8
        return ezc3d.c3d(str(link))


def _data(
    path: Path, raw: Any, header: C3dHeader
) -> tuple[Float[np.ndarray, "frames points 3"], Float[np.ndarray, "samples channels"], tuple[Note, ...]]:
    positions = np.moveaxis(raw["data"]["points"][:3], 2, 0).transpose(0, 2, 1)
    analogs = raw["data"]["analogs"][0].T
    seen_per_frame = len(analogs) * analogs.shape[1] / max(1, len(positions))
    if seen_per_frame != header.analogs_per_frame:
        counts = f"{path.name}: the header counts {header.analogs_per_frame} analog values per frame, "
        if header.fills_file(seen_per_frame) and not header.fills_file(header.analogs_per_frame):
            why = (
                f"the parameters {seen_per_frame:g}, which the length of the file agrees with; these are used"
            )
            return positions, analogs, noted(Kind.OTHER, counts + why)
        stored = read_data(path, header)
        why = "ANALOG:USED and ANALOG:RATE others; the header is used, with scales of 1 and offsets of 0"
        return stored.points, stored.analogs, noted(Kind.OTHER, counts + why)
    return positions, analogs, ()
