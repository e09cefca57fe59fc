"""What ezc3d finds in a C3D file, as plain arrays: parameters, points, analog samples, rotations."""

import math
import struct
import tempfile
from collections.abc import Collection, Set
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
from jaxtyping import Float

from solver.capture.capture import FootEvent, FootEventLabel, Side
from solver.common.errors import CaptureError
from solver.common.file_names import decoded, readable
from solver.common.notes import Kind, Note, noted

BLOCK = 512  # bytes; all addresses in a C3D file count blocks from 1
SIGNATURE = 0x50
INTEL, DEC, MIPS = 84, 85, 86
LARGEST_PARAMETERS = 2**18  # bytes; 255 blocks are the most that a header counts
LARGEST_COUNT = 65535  # the header's frame numbers are 16 bits; longer files keep theirs elsewhere
TEXT = 255
SIZES = {1: 1, 2: 2, 4: 4, TEXT: 1}  # of a parameter's values [bytes], by the number of their type
SINGLE = {  # parameters whose first number ezc3d takes without a look whether there is one
    *(f"POINT:{name}" for name in ("USED", "RATE", "SCALE", "FRAMES", "DATA_START")),
    *("ANALOG:USED", "ANALOG:RATE", "ANALOG:GEN_SCALE"),
    *(f"ROTATION:{name}" for name in ("USED", "RATE", "RATIO", "DATA_START")),
    *("TRIAL:ACTUAL_START_FIELD", "TRIAL:ACTUAL_END_FIELD"),
}
MOST_VALUES = 65535  # of a parameter, whose place is told in 16 bits; ezc3d makes room for empty texts, too
POSE = 17  # numbers of a rotation on a frame: a matrix of 4x4 by columns, and how reliable it is
LONGEST_DESCRIPTION = 127  # letters; of more, ezc3d takes the length for a negative number
EXPORT_AGAIN = "Export the trial again, or copy the file again."
SIDES: dict[str, Side] = {"left": "Left", "right": "Right"}
LABELS: dict[str, FootEventLabel] = {"foot strike": "Foot Strike", "foot off": "Foot Off"}


@dataclass(frozen=True)
class C3dHeader:
    """What the header block says about the data section."""

    processor: int
    points: int
    analogs_per_frame: int  # all samples of all channels between two frames
    samples_per_frame: int
    first_frame: int
    last_frame: int
    scale: float  # of the stored integers [POINT:UNITS]; negative where numbers are stored as floats
    data_block: int
    file_bytes: int
    rotations: int = 0
    poses_per_frame: int = 1  # of each rotation
    rotation_block: int = 1

    @property
    def frames(self) -> int | None:
        """Number of frames that it claims; None where 16 bits don't hold it."""
        return None if self.last_frame == LARGEST_COUNT else self.last_frame - self.first_frame + 1

    @property
    def frames_held(self) -> int:
        """Number of whole frames in the file, if nothing follows them."""
        if not self.frame_bytes:
            return self.frames or 0
        return max(0, self.file_bytes - self.data_start) // self.frame_bytes

    @property
    def data_start(self) -> int:
        """Address of the first frame [bytes]."""
        return (self.data_block - 1) * BLOCK

    @property
    def rotation_start(self) -> int:
        """Address of the first frame's rotations [bytes]."""
        return (self.rotation_block - 1) * BLOCK

    @property
    def words_per_frame(self) -> int:
        """Numbers stored for each frame."""
        return 4 * self.points + self.analogs_per_frame

    @property
    def frame_bytes(self) -> int:
        """Size of a frame: floats of four bytes or integers of two."""
        return self.words_per_frame * (4 if self.scale < 0 else 2)

    def fills_file(self, analogs_per_frame: float) -> bool:
        """Whether its frames end where the file does, to a block, with so many analog samples in each."""
        other = replace(self, analogs_per_frame=round(analogs_per_frame))
        return (
            self.frames is not None
            and 0 <= self.file_bytes - self.data_start - self.frames * other.frame_bytes < BLOCK
        )


@dataclass(frozen=True)
class C3dData:
    """The data section as stored, without analog scales and offsets."""

    points: Float[np.ndarray, "frames points 3"]  # [POINT:UNITS] NaN where a camera saw nothing
    analogs: Float[np.ndarray, "samples channels"]


def read_header(path: Path) -> C3dHeader:
    """Read the header and check the parameters, so that ezc3d can be trusted with the rest.

    Raises:
        CaptureError: not a C3D file; or an empty, cut-off or damaged one; or one in SGI/MIPS numbers.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read ({error.strerror}).") from error
    if not data:
        raise CaptureError(f"{path}: the file is empty. {EXPORT_AGAIN}")
    if len(data) > 1 and data[1] != SIGNATURE:
        raise CaptureError(
            f"{path}: not a C3D file (its second byte is not 50 hex). Give the .c3d of the trial."
        )
    parameters = (data[0] - 1) * BLOCK if data else 0
    if parameters < BLOCK or len(data) < parameters + BLOCK:
        raise CaptureError(
            f"{path}: the file ends after {len(data)} bytes, before its parameters. {EXPORT_AGAIN}"
        )
    processor = data[parameters + 3]
    if processor == MIPS:
        raise CaptureError(
            f"{path}: written in SGI/MIPS numbers, which cannot be read. Save it as Intel (PC) C3D, as every "
            "current capture program and C3D editor does."
        )
    if processor not in (INTEL, DEC):
        raise CaptureError(
            f"{path}: unknown number format {processor} in the parameter section. {EXPORT_AGAIN}"
        )
    numbers = _check_parameters(path, data, parameters)
    words = struct.unpack_from("<24H", data)
    rotations, poses_per_frame, rotation_block = (
        int(float(_texts(numbers[name], processor)[0])) if (name := f"ROTATION:{key}") in numbers else default
        for key, default in (("USED", 0), ("RATIO", 1), ("DATA_START", 0))
    )
    header = C3dHeader(
        processor=processor,
        points=words[1],
        analogs_per_frame=words[2],
        samples_per_frame=max(1, words[9]),
        first_frame=words[3],
        last_frame=words[4],
        scale=_number(data, 12, processor),
        data_block=words[8],
        file_bytes=len(data),
        rotations=rotations,
        poses_per_frame=poses_per_frame,
        rotation_block=rotation_block,
    )
    _check_length(path, header)
    _check_analog(path, header, numbers.keys())
    _check_rotations(path, header)
    return header


def read_data(path: Path, header: C3dHeader) -> C3dData:
    """Decode the data section by the header alone.

    For files whose ANALOG parameters are missing: ezc3d then takes the analog samples for points.

    Raises:
        CaptureError: the numbers are not Intel's.
    """
    odd = header.analogs_per_frame % header.samples_per_frame
    if header.processor != INTEL or header.frames is None or odd:
        raise CaptureError(
            f"{path}: ANALOG:USED and ANALOG:RATE disagree with the header's count of analog samples. "
            "Export the trial again."
        )
    kind, frames = ("<f4" if header.scale < 0 else "<i2"), min(header.frames, header.frames_held)
    words = np.fromfile(path, kind, frames * header.words_per_frame, offset=header.data_start)
    table = words.reshape(frames, header.words_per_frame).astype(float)
    points = table[:, : 4 * header.points].reshape(frames, header.points, 4)
    scale = 1.0 if header.scale < 0 else header.scale
    positions = np.where(points[:, :, 3:] < 0, np.nan, points[:, :, :3] * scale)
    samples = frames * header.samples_per_frame
    return C3dData(positions, table[:, 4 * header.points :].reshape(samples, -1))


def _number(data: bytes, address: int, processor: int) -> float:
    """A float of the header; DEC's has its halves swapped and counts the exponent two higher."""
    raw = data[address : address + 4]
    if processor == DEC:
        return float(struct.unpack("<f", raw[2:] + raw[:2])[0]) / 4
    return float(struct.unpack("<f", raw)[0])


def _check_length(path: Path, header: C3dHeader) -> None:
    """A file that breaks off within a frame is cut; one that ends with a frame was trimmed by somebody."""
    held = header.frames_held
    if header.frames is not None and header.frames < 1:
        frames = f"frames {header.first_frame} to {header.last_frame}"
        raise CaptureError(f"{path}: the header is damaged: {frames}. {EXPORT_AGAIN}")
    if header.frames is None or held >= header.frames:
        return
    if held == 0 or header.data_start + held * header.frame_bytes != header.file_bytes:
        raise CaptureError(
            f"{path}: the file is cut off in frame {held + 1} of {header.frames}. {EXPORT_AGAIN}"
        )


def parameters_in(path: Path, groups: Collection[str]) -> dict[str, tuple[str, ...]]:
    """Parameters of some groups as texts, by "GROUP:NAME" in capitals; no sample is read.

    Empty where the file is none that `read_header` would read.
    """
    with path.open("rb") as file:
        data = file.read(LARGEST_PARAMETERS)
    start = (data[0] - 1) * BLOCK if len(data) > BLOCK and data[1] == SIGNATURE else len(data)
    processor = data[start + 3] if start + 3 < len(data) else 0
    if processor not in (INTEL, DEC):
        return {}
    try:
        records = _parameters(path, data, start)
    except CaptureError:
        return {}
    return {
        name: _texts(record, processor) for name, _, record in records if name.partition(":")[0] in groups
    }


def _texts(record: bytes, processor: int) -> tuple[str, ...]:
    """The values of a parameter, from its type on."""
    extents = record[2 : 2 + record[1]]
    values, size = record[2 + record[1] :], SIZES[record[0]]
    count = math.prod(extents)
    if record[0] == TEXT:
        length = extents[0]
        pieces = [values[k : k + length] for k in range(0, count, max(1, length))]
        return tuple(decoded(piece).strip(" \0") for piece in pieces)
    if size == 4:
        return tuple(f"{_number(values, 4 * k, processor):.7g}" for k in range(count))
    return tuple(str(x) for x in struct.unpack_from(f"<{count}{'b' if size == 1 else 'h'}", values))


def _check_parameters(path: Path, data: bytes, start: int) -> dict[str, bytes]:
    """Walk the chain of groups and parameters to its end; those that hold numbers, as in "ANALOG:SCALE"."""
    numbers = {}
    for name, at, record in _parameters(path, data, start):
        if record[0] != TEXT and math.prod(record[2 : 2 + record[1]]) > 0:
            numbers[name] = record
        elif name in SINGLE:
            raise _damaged(path, at)
    return numbers


def _parameters(path: Path, data: bytes, start: int) -> list[tuple[str, int, bytes]]:
    """The parameters by name, as in "ANALOG:SCALE", where each begins, and what follows its name.

    Raises:
        CaptureError: the chain of groups and parameters is broken.
    """
    groups: dict[int, str] = {}
    found: list[tuple[int, str, int, bytes]] = []
    at = start + 4
    while at + 2 < len(data) and data[at]:
        length, group = abs(struct.unpack_from("<b", data, at)[0]), struct.unpack_from("<b", data, at + 1)[0]
        pointer = at + 2 + length
        if pointer + 4 > len(data):
            raise _damaged(path, at)
        step = struct.unpack_from("<H", data, pointer)[0]
        record = data[pointer + 2 : pointer + step] if step else data[pointer + 2 :]
        described = _description(record, has_values=group > 0)
        if described is None or group == 0 or -group in groups:
            raise _damaged(path, at)
        name = data[at + 2 : pointer].decode("latin-1").upper()
        if record[described] > LONGEST_DESCRIPTION:
            shown = readable(name)[:40]
            raise CaptureError(
                f"{path}: byte {pointer + 2 + described}: the description of {shown} has {record[described]} "
                f"letters, of which {LONGEST_DESCRIPTION} can be read. Shorten it in a C3D editor; if it is "
                "not so long there, the file is damaged: copy it again."
            )
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, at, record))
        if step == 0:
            break
        at = pointer + step
    if at + 2 >= len(data):
        raise _damaged(path, len(data))
    return [(f"{groups.get(group)}:{name}", at, record) for group, name, at, record in found]


def _check_rotations(path: Path, header: C3dHeader) -> None:
    """All of them lie in the file: ezc3d ends the program where they don't."""
    if not header.rotations or (header.frames is None and header.points):
        return
    if header.frames is None:
        raise CaptureError(f"{path}: more poses of segments than a header counts. Export it in parts.")
    start = header.rotation_start
    size = 4 * POSE * header.rotations * header.poses_per_frame * header.frames
    if header.processor != INTEL or min(header.rotations, header.poses_per_frame, start) < 1:
        raise CaptureError(f"{path}: ROTATION:USED, RATIO or DATA_START is damaged. {EXPORT_AGAIN}")
    if start + size > header.file_bytes:
        raise CaptureError(
            f"{path}: the file is cut off: {header.file_bytes} bytes, of which its rotations alone take "
            f"{start + size}. {EXPORT_AGAIN}"
        )


def _check_analog(path: Path, header: C3dHeader, parameters: Set[str]) -> None:
    """Without scale or offset nothing tells what the samples mean, and ezc3d ends the program."""
    if header.analogs_per_frame and {"ANALOG:USED", "ANALOG:RATE"} <= parameters:
        missing = sorted({"ANALOG:SCALE", "ANALOG:OFFSET"} - parameters)
        if missing:
            raise CaptureError(
                f"{path}: {' and '.join(missing)} missing: analog samples without unit. {EXPORT_AGAIN}"
            )


def _description(record: bytes, *, has_values: bool) -> int | None:
    """Where in a record, behind values of a known type, its description begins; None where they reach out."""
    at = 0
    if has_values:
        if len(record) < 2 or record[0] not in SIZES or record[1] > 7:
            return None
        extents = record[2 : 2 + record[1]]
        if math.prod(extent or 1 for extent in extents) > MOST_VALUES or (record[0] == TEXT and not extents):
            return None
        at = 2 + record[1] + SIZES[record[0]] * math.prod(extents)
    return at if at < len(record) and at + 1 + record[at] <= len(record) else None


def _damaged(path: Path, at: int) -> CaptureError:
    return CaptureError(f"{path}: the parameter section is damaged at byte {at}. {EXPORT_AGAIN}")


@dataclass(frozen=True)
class C3dContents:
    """One C3D file, axes and units as stored."""

    path: Path
    parameters: Any  # ezc3d's mapping of groups of parameters
    points: Float[np.ndarray, "frames points 3"]  # [POINT:UNITS] NaN where not seen
    rate: float  # [Hz] of the points
    analogs: Float[np.ndarray, "samples channels"]  # [ANALOG:UNITS]
    notes: tuple[Note, ...] = ()
    rotations: Float[np.ndarray, "poses segments 17"] = field(default_factory=lambda: np.zeros((0, 0, POSE)))
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
    if points.shape[0] == 0 or (points.shape[1] == 0 and not header.rotations):
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
    poses, before = _rotations(path, header), header.first_frame - 1
    return C3dContents(path, raw["parameters"], points, rate, analogs, notes, poses, before)


def _rotations(path: Path, header: C3dHeader) -> Float[np.ndarray, "poses segments 17"]:
    """Of a file without points, as stored; ezc3d leaves out how reliable they are."""
    poses = 0 if header.points else header.poses_per_frame * (header.frames or 0)
    count, start = poses * header.rotations * POSE, max(0, header.rotation_start)
    return np.fromfile(path, "<f4", count, offset=start).reshape(poses, header.rotations, POSE).astype(float)


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


def foot_events(contents: C3dContents) -> tuple[tuple[FootEvent, ...], list[str]]:
    """Foot strikes and foot-offs in order of time, and names of other events; the first frame is at 0 s."""
    labels, contexts = contents.words("EVENT", "LABELS"), contents.words("EVENT", "CONTEXTS")
    times = _minutes_and_seconds(contents)
    begin_s = contents.first_frame / contents.rate
    found: list[FootEvent] = []
    others: list[str] = []
    for k in range(min(len(labels), times.shape[1])):
        side = SIDES.get(contexts[k].lower() if k < len(contexts) else "", "General")
        label = LABELS.get(labels[k].lower())
        if label is None:
            others.append(labels[k])
        else:
            found.append(FootEvent(float(60 * times[0, k] + times[1, k] - begin_s), side, label))
    return tuple(sorted(found, key=lambda event: event.time_s)), others


def _minutes_and_seconds(contents: C3dContents) -> Float[np.ndarray, "2 events"]:
    """Of all events, those of TIMES2 and so on behind the first 255."""
    found = [contents.array("EVENT", "TIMES")]
    while len(more := contents.array("EVENT", f"TIMES{len(found) + 1}")):
        found.append(more)
    return np.hstack([times for times in found if times.ndim == 2] or [np.zeros((2, 0))])
