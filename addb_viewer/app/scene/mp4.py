"""Coded pictures as an MP4 file (ISO/IEC 14496-12), each shown for exactly the same time."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

TICKS = 1000  # of the file's clock, for one picture
SHARPNESS = 0x480000  # 72 dots an inch, as everybody writes
UPRIGHT = struct.pack(">9I", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)
VPC = bytes([0, 31, 0x82, 1, 1, 1, 0, 0])  # VP9, profile 0, level 3.1, 8 bits, 4:2:0, BT.709


@dataclass(frozen=True)
class Coded:
    """One picture."""

    data: bytes
    alone: bool  # whether it is shown without those before it


@dataclass(frozen=True)
class Coding:
    """How pictures are coded."""

    code: str  # avc1: H.264; vp09: VP9
    size: tuple[int, int]  # width and height [px]
    rate: float  # pictures a second
    description: bytes = b""  # of H.264: its AVCDecoderConfigurationRecord

    @property
    def config(self) -> bytes:
        """What a player has to know beforehand, as a box."""
        return _box("avcC", self.description) if self.code == "avc1" else _full("vpcC", VPC, version=1)


def mp4(pictures: Sequence[Coded], coding: Coding) -> bytes:
    """The file: first what it holds, then the pictures in one piece.

    Args:
        pictures: in order; the first one stands alone.
        coding: of all.
    """
    head = _box("ftyp", b"isom", struct.pack(">I", 512), b"isommp41")
    start = len(head) + len(_movie(pictures, coding, 0)) + 8
    return head + _movie(pictures, coding, start) + _box("mdat", *(picture.data for picture in pictures))


def _movie(pictures: Sequence[Coded], coding: Coding, start: int) -> bytes:
    """All about them; they begin at a place of the file."""
    count, clock = len(pictures), round(TICKS * coding.rate)
    length, (width, height) = TICKS * count, coding.size
    entry = struct.pack(">6xH16xHHIIIH32xHh", 1, width, height, SHARPNESS, SHARPNESS, 0, 1, 24, -1)
    alone = [k + 1 for k, picture in enumerate(pictures) if picture.alone]
    table = _box(
        "stbl",
        _full("stsd", _numbers(1), _box(coding.code, entry, coding.config)),
        _full("stts", _numbers(1, count, TICKS)),
        _full("stsc", _numbers(1, 1, count, 1)),
        _full("stsz", _numbers(0, count, *(len(picture.data) for picture in pictures))),
        _full("stco", _numbers(1, start)),
        _full("stss", _numbers(len(alone), *alone)),
    )
    inside = _box("dinf", _full("dref", _numbers(1), _full("url ", flags=1)))
    media = _box(
        "mdia",
        _full("mdhd", _numbers(0, 0, clock, length), struct.pack(">HH", 0x55C4, 0)),  # no language
        _full("hdlr", struct.pack(">I4s12x", 0, b"vide"), b"\0"),
        _box("minf", _full("vmhd", bytes(8), flags=1), inside, table),
    )
    place = UPRIGHT + _numbers(width << 16, height << 16)
    track = _full("tkhd", _numbers(0, 0, 1, 0, length, 0, 0), bytes(8), place, flags=3)
    header = struct.pack(">IIIIIH10x", 0, 0, clock, length, 0x10000, 0x100) + UPRIGHT + bytes(24)
    return _box("moov", _full("mvhd", header, _numbers(2)), _box("trak", track, media))


def _box(kind: str, *parts: bytes) -> bytes:
    body = b"".join(parts)
    return struct.pack(">I4s", 8 + len(body), kind.encode()) + body


def _full(kind: str, *parts: bytes, version: int = 0, flags: int = 0) -> bytes:
    return _box(kind, struct.pack(">I", version << 24 | flags), *parts)


def _numbers(*values: int) -> bytes:
    return struct.pack(f">{len(values)}I", *values)
