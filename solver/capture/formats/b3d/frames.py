"""Frames of fixed size as arrays: where each series lies in a frame, found once for all frames.

A frame is a protobuf message whose fields are all packed doubles: tag, length, numbers. As tags and lengths
are the same in every frame, a series is a strided view of the file and needs no parsing frame by frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool, Float, UInt8

from solver.capture.formats.b3d.schema import PassFrames, SensorFrames

DOUBLE = np.dtype("<f8")
_LENGTH_DELIMITED, _FIXED64, _FIXED32 = 2, 1, 5
_FIXED_SIZES = {_FIXED64: 8, _FIXED32: 4}

FramesType = TypeVar("FramesType", SensorFrames, PassFrames)


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


def unpacked(kind: type[FramesType], raw: UInt8[np.ndarray, "frames bytes"]) -> FramesType:
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


def packed(
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
