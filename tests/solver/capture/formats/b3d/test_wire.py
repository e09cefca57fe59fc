"""Messages against the bytes that protobuf's own description of its encoding prints."""

from dataclasses import dataclass

import numpy as np
import pytest
from google.protobuf.message import DecodeError

from solver.capture.formats.b3d.wire import decoded, encoded, many, one


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
    assert encoded(value) == bytes.fromhex(hexadecimal)


def test_back_again():
    data = bytes.fromhex("08 96 01 12 01 61 1a 00 32 06 03 8e 02 9e a7 05")
    value = decoded(Outer, data)
    assert (value.a, value.text, [inner.a for inner in value.inner]) == (150, "a", [0])
    assert value.numbers.dtype == np.int32
    assert value.numbers.tolist() == [3, 270, 86942]
    assert encoded(value) == data


def test_fields_of_a_newer_version_come_through():
    newer = bytes.fromhex("08 01") + bytes.fromhex("1a 05 08 02 a2 06 00") + bytes.fromhex("98 06 07")
    value = decoded(Outer, newer)
    assert value.unknown == bytes.fromhex("98 06 07")
    assert value.inner[0].unknown == bytes.fromhex("a2 06 00")
    assert encoded(value) == newer


def test_what_is_no_message():
    with pytest.raises(DecodeError):
        decoded(Outer, b"\x12\xff")
