"""Frames laid out by us against the same messages serialized by the protobuf library."""

from dataclasses import dataclass, fields, make_dataclass

import numpy as np
import pytest
from google.protobuf.message import DecodeError

from solver.capture.formats.b3d.b3d_fields import (
    PassFrames,
    SensorFrames,
    decode_message,
    encode_message,
    many,
    one,
)
from solver.capture.formats.b3d.frames import (
    LayoutError,
    layout_of,
    layout_to_write,
    pack_frames,
    tag_of,
    unpack_frames,
)


def by_protobuf(series, frame):
    """One frame as a message of the library, whatever we think about tags and lengths."""
    numbers = {f.name: f.metadata["number"] for f in fields(series) if "number" in f.metadata}
    members = [(name, np.ndarray, many(number, "double")) for name, number in numbers.items()]
    message = make_dataclass("Frame", [*members, ("unknown", bytes, b"")], frozen=True, eq=False)
    values = {name: getattr(series, name) for name in numbers}
    return encode_message(message(**{name: v[frame] for name, v in values.items() if v.shape[1]}))


@pytest.fixture
def series():
    rng = np.random.default_rng(1)
    return PassFrames(
        pos=rng.normal(size=(4, 33)),
        com_pos=np.array([[0.0, -0.0, np.nan]] * 4),
        root_frame_com_acc=rng.normal(size=(4, 3)),  # field 17: its tag takes two bytes
        root_frame_root_euler_history=rng.normal(size=(4, 30)),  # its length takes two
    )


def test_bytes_are_those_of_the_library(series):
    raw = pack_frames(series, layout_to_write(series), 0, 4)
    assert [row.tobytes() for row in raw] == [by_protobuf(series, t) for t in range(4)]


def test_a_part_of_the_frames(series):
    layout = layout_to_write(series)
    np.testing.assert_array_equal(pack_frames(series, layout, 1, 3), pack_frames(series, layout, 0, 4)[1:3])


def test_series_are_views_of_the_bytes(series):
    raw = np.frombuffer(b"".join(by_protobuf(series, t) for t in range(4)), np.uint8).reshape(4, -1)
    found = unpack_frames(PassFrames, raw)
    assert np.shares_memory(found.pos, raw)
    for f in fields(PassFrames):
        if f.name != "unknown":
            expected = getattr(series, f.name)
            np.testing.assert_array_equal(
                getattr(found, f.name), expected if expected.size else np.zeros((4, 0))
            )


def test_fields_in_another_order_are_found():
    first, second = SensorFrames(marker_obs=np.ones((1, 3))), SensorFrames(custom_values=np.full((1, 2), 2.0))
    raw = np.frombuffer(by_protobuf(first, 0) + by_protobuf(second, 0), np.uint8)[None]
    found = unpack_frames(SensorFrames, raw)
    assert found.marker_obs.tolist() == [[1, 1, 1]]
    assert found.custom_values.tolist() == [[2, 2]]


def test_unknown_fields_are_kept():
    @dataclass(frozen=True, eq=False)
    class Newer:
        pos: np.ndarray = many(1, "double")  # noqa: RUF009 (makes a field)
        text: tuple[str, ...] = many(90, "string")
        unknown: bytes = b""

    frames = [encode_message(Newer(np.array([1.0 + t]), (f"note {t}",))) for t in range(2)]
    raw = np.frombuffer(b"".join(frames), np.uint8).reshape(2, -1)
    found = unpack_frames(PassFrames, raw)
    assert [row.tobytes() for row in found.unknown[tag_of(90)]] == [b"note 0", b"note 1"]
    np.testing.assert_array_equal(pack_frames(found, layout_to_write(found), 0, 2), raw)


def test_a_frame_unlike_the_first_is_named(series):
    raw = pack_frames(series, layout_to_write(series), 0, 4)
    raw[2, 0] ^= 8
    with pytest.raises(LayoutError, match="frame 2"):
        unpack_frames(PassFrames, raw)


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (b"\x0a\x10" + bytes(8), "beyond its end"),
        (b"\x0a\x08" + bytes(8) + b"\x0a\x00", "occurs twice"),
        (b"\x08\x01", "no field of fixed size"),
        (b"\x00\x01", "no field of fixed size"),
        (b"\xff\xff\xff\xff\xff\xff\x01", "belongs to no field"),
        (b"\x0a", "belongs to no field"),
    ],
)
def test_what_is_no_frame(frame, message):
    with pytest.raises(LayoutError, match=message):
        layout_of(frame)


def test_bytes_that_are_no_doubles():
    with pytest.raises(LayoutError, match=r"\(pos\) has 7 bytes"):
        unpack_frames(PassFrames, np.frombuffer(b"\x0a\x07" + bytes(7), np.uint8)[None])


def test_no_frames_at_all():
    assert unpack_frames(PassFrames, np.zeros((0, 5), np.uint8)).pos.shape == (0, 0)


@dataclass(frozen=True, eq=False)
class Inner:
    a: int = one(1, "int32")
    unknown: bytes = b""


@dataclass(frozen=True, eq=False)
class Outer:
    a: int = one(1, "int32")
    text: str = one(2, "string")
    inner: tuple[Inner, ...] = many(3, Inner)
    numbers: np.ndarray = many(6, "int32")  # noqa: RUF009 (makes a field)
    unknown: bytes = b""


@pytest.mark.parametrize(
    ("value", "hexadecimal"),
    [
        (Outer(a=150), "08 96 01"),
        (Outer(text="testing"), "12 07 74 65 73 74 69 6e 67"),
        (Outer(inner=(Inner(a=150),)), "1a 03 08 96 01"),
        (Outer(numbers=np.array([3, 270, 86942], np.int32)), "32 06 03 8e 02 9e a7 05"),
        (Outer(), ""),
    ],
)
def test_the_examples_of_the_encoding(value, hexadecimal):
    assert encode_message(value) == bytes.fromhex(hexadecimal)


def test_back_again():
    data = bytes.fromhex("08 96 01 12 01 61 1a 00 32 06 03 8e 02 9e a7 05")
    value = decode_message(Outer, data)
    assert (value.a, value.text, [inner.a for inner in value.inner]) == (150, "a", [0])
    assert value.numbers.dtype == np.int32
    assert value.numbers.tolist() == [3, 270, 86942]
    assert encode_message(value) == data


def test_fields_of_a_newer_version_come_through():
    newer = bytes.fromhex("08 01") + bytes.fromhex("1a 05 08 02 a2 06 00") + bytes.fromhex("98 06 07")
    value = decode_message(Outer, newer)
    assert value.unknown == bytes.fromhex("98 06 07")
    assert value.inner[0].unknown == bytes.fromhex("a2 06 00")
    assert encode_message(value) == newer


def test_what_is_no_message():
    with pytest.raises(DecodeError):
        decode_message(Outer, b"\x12\xff")
