"""Frames of fixed size as arrays: where each series lies in a frame, found once for all frames.

A frame is a protobuf message whose fields are all packed doubles: tag, length, numbers. As tags and lengths
are the same in every frame, a series is a strided view of the file and needs no parsing frame by frame.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool, Float, UInt8

from solver.capture.formats.b3d.b3d_fields import B3dTrial, Header, PassFrames, SensorFrames

DOUBLE = np.dtype("<f8")
_LENGTH_DELIMITED, _FIXED64, _FIXED32 = 2, 1, 5
_FIXED_SIZES = {_FIXED64: 8, _FIXED32: 4}

FramesType = TypeVar("FramesType", SensorFrames, PassFrames)
_BY_DOF = ("pos", "vel", "acc", "tau")
_BY_BODY_6 = ("ground_contact_wrench", "root_frame_ground_contact_wrench")
_BY_BODY_3 = (
    "ground_contact_center_of_pressure",
    "ground_contact_torque",
    "ground_contact_force",
    "root_frame_ground_contact_center_of_pressure",
    "root_frame_ground_contact_torques",
    "root_frame_ground_contact_force",
)
_POINTS = ("com_pos", "com_vel", "com_acc", "root_frame_com_acc")
_TWISTS = ("root_frame_residual", "root_frame_spatial_velocity", "root_frame_spatial_acceleration")
_BY_JOINT = ("root_frame_joint_centers", "world_frame_joint_centers")
_ALL = ("missing_GRF_reason", "has_manual_GRF_annotation")  # a value a frame, in a trial's header
_OF_PASS = ("marker_rms", "marker_max", "linear_residual", "angular_residual", "joints_max_velocity")
Frames = TypeVar("Frames", SensorFrames, PassFrames)


class LayoutError(ValueError):
    """Bytes that are not laid out as frames are; the message names the frame."""


@dataclass(frozen=True)
class Layout:
    """One frame's bytes: everything that is the same in all frames, and where each field's own bytes lie."""

    template: bytes  # a frame with zeros for all numbers
    payload: Mapping[int, slice]  # by tag, in the order of the tags

    @cached_property
    def fixed(self) -> Bool[np.ndarray, " bytes"]:
        """The bytes that every frame has alike: tags and lengths."""
        fixed = np.ones(len(self.template), dtype=bool)
        for place in self.payload.values():
            fixed[place] = False
        return fixed


def tag_of(number: int) -> int:
    """The tag of a field of packed numbers."""
    return number << 3 | _LENGTH_DELIMITED


def layout_of(frame: bytes) -> Layout:
    """Where the fields of a frame lie.

    Raises:
        LayoutError: it is no sequence of fields of fixed size.
    """
    template, payload = bytearray(frame), {}
    place = 0
    while place < len(frame):
        tag, place = _varint(frame, place)
        size = _FIXED_SIZES.get(tag & 7)
        if tag & 7 == _LENGTH_DELIMITED:
            size, place = _varint(frame, place)
        if size is None or tag < 8:
            raise LayoutError(f"its byte {place - 1} starts no field of fixed size")
        if tag in payload:
            raise LayoutError(f"field {tag >> 3} occurs twice in it")
        if place + size > len(frame):
            raise LayoutError(f"field {tag >> 3} reaches beyond its end")
        payload[tag] = slice(place, place + size)
        template[place : place + size] = bytes(size)
        place += size
    return Layout(bytes(template), dict(sorted(payload.items())))


def layout_for(sizes: Mapping[int, int]) -> Layout:
    """The layout of frames whose fields have these sizes, in bytes by tag."""
    template, payload = bytearray(), {}
    for tag, size in sorted(sizes.items()):
        template += _as_varint(tag)
        if tag & 7 == _LENGTH_DELIMITED:
            template += _as_varint(size)
        payload[tag] = slice(len(template), len(template) + size)
        template += bytes(size)
    return Layout(bytes(template), payload)


def unpack_frames(kind: type[FramesType], raw: UInt8[np.ndarray, "frames bytes"]) -> FramesType:
    """A trial's frames as series that are views of their bytes.

    Args:
        kind: SensorFrames or PassFrames.
        raw: one row a frame.

    Raises:
        LayoutError: a frame is laid out otherwise than the first, or a field holds no doubles.
    """
    frames = len(raw)
    layout = layout_of(raw[0].tobytes()) if frames else layout_for({})
    alike = np.frombuffer(layout.template, np.uint8)[layout.fixed]
    odd = np.flatnonzero((raw[:, layout.fixed] != alike).any(axis=1)) if frames else np.zeros(0, int)
    if len(odd):
        raise LayoutError(f"frame {odd[0]} is not laid out as frame 0 is")
    series: dict[str, Any] = {}
    known = _tags(kind)
    for name, tag in known.items():
        place = layout.payload.get(tag, slice(0, 0))
        if (place.stop - place.start) % DOUBLE.itemsize:
            raise LayoutError(f"field {tag >> 3} ({name}) has {place.stop - place.start} bytes: no doubles")
        series[name] = raw[:, place].view(DOUBLE) if place.stop > place.start else np.zeros((frames, 0))
    others = {tag: raw[:, place] for tag, place in layout.payload.items() if tag not in known.values()}
    return kind(**series, unknown=others)


def pack_frames(
    series: SensorFrames | PassFrames, layout: Layout, start: int, end: int
) -> UInt8[np.ndarray, "frames bytes"]:
    """The bytes of the frames from `start` to `end`, one row a frame."""
    raw = np.tile(np.frombuffer(layout.template, np.uint8), (end - start, 1))
    for tag, place in layout.payload.items():
        raw[:, place] = _content(series, tag)[start:end]
    return raw


def layout_to_write(series: SensorFrames | PassFrames) -> Layout:
    """The layout that a trial's series ask for; those without columns are left out."""
    sizes = {
        tag: getattr(series, name).shape[1] * DOUBLE.itemsize for name, tag in _tags(type(series)).items()
    }
    sizes |= {tag: content.shape[1] for tag, content in series.unknown.items()}
    return layout_for({tag: size for tag, size in sizes.items() if size})


def present(series: SensorFrames | PassFrames) -> dict[str, Float[np.ndarray, "frames n"]]:
    """The series that have columns, by name."""
    named = {name: getattr(series, name) for name in _tags(type(series))}
    return {name: array for name, array in named.items() if array.shape[1]}


def _content(series: SensorFrames | PassFrames, tag: int) -> UInt8[np.ndarray, "frames bytes"]:
    if tag in series.unknown:
        return series.unknown[tag]
    name = next(name for name, own in _tags(type(series)).items() if own == tag)
    return np.ascontiguousarray(getattr(series, name), DOUBLE).view(np.uint8)


def _tags(kind: type) -> dict[str, int]:
    return {f.name: tag_of(f.metadata["number"]) for f in fields(kind) if "number" in f.metadata}


def _varint(data: bytes, place: int) -> tuple[int, int]:
    """A protobuf integer, and the place after it."""
    value = shift = 0
    while place < len(data) and shift < 35:
        byte = data[place]
        value |= (byte & 0x7F) << shift
        shift, place = shift + 7, place + 1
        if byte < 0x80:
            return value, place
    raise LayoutError(f"its byte {place} belongs to no field")


def _as_varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def faults(header: Header, trial: B3dTrial) -> Iterator[str]:
    """What does not fit together, in words, one thing at a time."""
    about = trial.header
    for name in ("missing_GRF_reason", "has_manual_GRF_annotation"):
        stated = len(getattr(about, name))
        if stated not in (0, about.trial_length):
            yield f"{name} has {stated} values for {about.trial_length} frames"
    if len(trial.passes) != len(about.processing_pass_header):
        yield f"{len(trial.passes)} passes, but headers for {len(about.processing_pass_header)}"
    yield from _faults_of_series(trial.sensors, about.trial_length, _sensor_widths(header))
    for frames in trial.passes:
        yield from _faults_of_series(frames, about.trial_length, _pass_widths(header))


def _faults_of_series(
    series: SensorFrames | PassFrames, frames: int, widths: dict[str, tuple[int, str]]
) -> Iterator[str]:
    for name, array in present(series).items():
        if len(array) != frames:
            yield f"{name} has {len(array)} frames instead of {frames}"
        width, reason = widths.get(name, (array.shape[1], ""))
        if array.shape[1] != width:
            yield f"{name} has {array.shape[1]} numbers a frame, but {reason} ask for {width}"


def _sensor_widths(header: Header) -> dict[str, tuple[int, str]]:
    return {
        "marker_obs": (3 * len(header.marker_name), f"{len(header.marker_name)} marker names"),
        "acc_obs": (3 * len(header.acc_name), f"{len(header.acc_name)} accelerometers"),
        "gyro_obs": (3 * len(header.gyro_name), f"{len(header.gyro_name)} gyroscopes"),
    }


def _pass_widths(header: Header) -> dict[str, tuple[int, str]]:
    bodies, dofs, joints = len(header.ground_contact_body), header.num_dofs, header.num_joints
    widths = dict.fromkeys(_BY_DOF, (dofs, f"{dofs} degrees of freedom"))
    widths |= dict.fromkeys(_BY_BODY_6, (6 * bodies, f"{bodies} contact bodies"))
    widths |= dict.fromkeys(_BY_BODY_3, (3 * bodies, f"{bodies} contact bodies"))
    widths |= dict.fromkeys(_POINTS, (3, "points"))
    widths |= dict.fromkeys(_TWISTS, (6, "wrenches and twists"))
    if joints:
        widths |= dict.fromkeys(_BY_JOINT, (3 * joints, f"{joints} joints"))
    return widths


def cut(trial: B3dTrial, start: int, end: int, index: int, **about: Any) -> B3dTrial:
    """Frames start to end − 1 of a whole trial; it says of itself where it comes from.

    Args:
        trial: whole.
        start: first frame.
        end: the first that no longer belongs.
        index: number of the piece, from 0.
        about: what else its header says.
    """
    whole, step = trial.header, trial.header.trial_timestep
    rows = slice(start, end)
    passes = tuple(
        replace(header, **{name: getattr(header, name)[rows] for name in _OF_PASS})
        for header in whole.processing_pass_header
    )
    begin = whole.original_start_time
    own: dict[str, Any] = {
        "name": f"{whole.name}_split{index}",
        "trial_length": end - start,
        "processing_pass_header": passes,
        "split_index": index,
        "original_start_frame": start,
        "original_end_frame": end,
        "original_start_time": begin + start * step,
        "original_end_time": begin + end * step,
        **{name: getattr(whole, name)[rows] for name in _ALL},
        **about,
    }
    return B3dTrial(
        replace(whole, **own),
        _rows(trial.sensors, rows),
        tuple(_rows(frames, rows) for frames in trial.passes),
    )


def _rows(frames: Frames, rows: slice) -> Frames:
    """Those rows of every series that there is."""
    own: dict[str, Any] = {
        field.name: np.asarray(getattr(frames, field.name)[rows])
        for field in fields(frames)
        if field.name != "unknown" and all(getattr(frames, field.name).shape)
    }
    return replace(frames, **own)
