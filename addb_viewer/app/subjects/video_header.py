"""What a video file holds, read from its header: how it is packed, how coded, how many pictures a second.

MP4 and MOV: ISO/IEC 14496-12; codes of pictures in 14496-15. WebM: RFC 8794 (EBML) and RFC 9559 (Matroska).
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from solver.common.errors import CaptureError

PACKINGS = {".mp4": "video/mp4", ".m4v": "video/mp4", ".mov": "video/mp4", ".webm": "video/webm"}
OTHERS = (
    ".avi",
    ".mkv",
    ".wmv",
    ".mpg",
    ".mpeg",
    ".mts",
    ".flv",
    ".3gp",
)  # cameras write them, browsers play none
PLAYED = {"avc1": "H.264", "avc3": "H.264", "vp09": "VP9", "V_VP9": "VP9"}
NAMES = {"hvc1": "H.265", "hev1": "H.265", "av01": "AV1", "mp4v": "MPEG-4 part 2", "jpeg": "Motion JPEG"} | {
    "apcn": "ProRes",
    "apch": "ProRes",
    "V_VP8": "VP8",
    "V_AV1": "AV1",
    "V_MPEG4/ISO/AVC": "H.264",
    "V_MPEGH/ISO/HEVC": "H.265",
}
MOST_ELEMENTS = 10_000  # of a file that are looked through for its header
MOST_BYTES = 2**24  # of a table of times


class VideoError(CaptureError):
    """A video cannot be shown; says what to do."""


@dataclass(frozen=True)
class Video:
    """A file that browsers play."""

    file: Path
    kind: str  # as HTTP names it
    codec: str
    rate: float | None  # [Hz] pictures a second; None: the file does not say


def read_header(file: Path) -> Video:
    """What the file is.

    Raises:
        VideoError: browsers do not play it, or it is no video.
    """
    kind = PACKINGS.get(file.suffix.lower())
    if kind is None:
        raise VideoError(f"{file.name}: browsers play MP4, MOV and WebM. {advice(file)}")
    try:
        with file.open("rb") as opened:
            code, rate = _matroska(opened) if kind == "video/webm" else _boxes(opened)
    except OSError as error:
        raise VideoError(f"{file.name}: cannot be read ({error.strerror or error}).") from error
    except (struct.error, ValueError, LookupError) as error:
        raise VideoError(f"{file.name}: its header cannot be read. {advice(file)}") from error
    if code not in PLAYED:
        coded = f"{file.name}: is coded as {NAMES.get(code, code)}; H.264 and VP9 are played."
        raise VideoError(f"{coded} {advice(file)}")
    return Video(file, kind, PLAYED[code], rate)


def advice(file: Path) -> str:
    """How to make a file that is played; the pictures and their times stay."""
    made = f"{file.stem}.h264.mp4"
    return f'To convert it: ffmpeg -i "{file.name}" -c:v libx264 -crf 18 -pix_fmt yuv420p -an "{made}"'


def _boxes(file: BinaryIO) -> tuple[str, float | None]:
    """Code and rate of the first track of pictures in an MP4 or MOV."""
    size = file.seek(0, 2)
    for kind, start, end in _children(file, 0, size):
        if kind == "moov":
            for track, at, until in _children(file, start, end):
                if track == "trak" and (found := _track(file, at, until)):
                    return found
    raise ValueError("no pictures")


def _track(file: BinaryIO, start: int, end: int) -> tuple[str, float | None] | None:
    media = _inside(file, start, end, "mdia")
    handler = media and _inside(file, *media, "hdlr")
    if not (media and handler) or _read(file, handler[0] + 8, 4) != b"vide":
        return None
    header = _inside(file, *media, "mdhd")
    table = _inside(file, *media, "minf", "stbl")
    described = table and _inside(file, *table, "stsd")
    if not (header and table and described):
        raise ValueError("no description")
    code = _read(file, described[0] + 12, 4).decode("latin-1")
    long = _read(file, header[0], 1)[0] == 1
    (clock,) = struct.unpack(">I", _read(file, header[0] + (20 if long else 12), 4))
    return code, _rate(file, _inside(file, *table, "stts"), clock)


def _rate(file: BinaryIO, times: tuple[int, int] | None, clock: int) -> float | None:
    """Mean over all pictures [Hz]."""
    if times is None or times[1] - times[0] > MOST_BYTES:
        return None
    body = _read(file, times[0] + 8, times[1] - times[0] - 8)
    pairs = list(struct.iter_unpack(">II", body[: len(body) // 8 * 8]))
    count, ticks = sum(n for n, _ in pairs), sum(n * delta for n, delta in pairs)
    return count * clock / ticks if ticks else None


def _inside(file: BinaryIO, start: int, end: int, *names: str) -> tuple[int, int] | None:
    """The place of a box within boxes; None where there is none."""
    for name in names:
        found = next((place for kind, *place in _children(file, start, end) if kind == name), None)
        if found is None:
            return None
        start, end = found
    return start, end


def _children(file: BinaryIO, start: int, end: int) -> Iterator[tuple[str, int, int]]:
    """Kind, start and end of each box within these bytes."""
    for _ in range(MOST_ELEMENTS):
        if start + 8 > end:
            return
        size, kind = struct.unpack(">I4s", _read(file, start, 8))
        head = 8
        if size == 1:
            (size,), head = struct.unpack(">Q", _read(file, start + 8, 8)), 16
        after = end if size == 0 else start + size
        if after < start + head or after > end:
            raise ValueError("a box is longer than its file")
        yield kind.decode("latin-1"), start + head, after
        start = after


def _matroska(file: BinaryIO) -> tuple[str, float | None]:
    """Code and rate of the first track of pictures in a WebM."""
    size = file.seek(0, 2)
    if _read(file, 0, 4) != b"\x1a\x45\xdf\xa3":
        raise ValueError("not EBML")
    for kind, start, end in _elements(file, 0, size):
        if kind != 0x18538067:  # Segment
            continue
        for part, at, until in _elements(file, start, end):
            if part != 0x1654AE6B:  # Tracks
                continue
            for entry, here, there in _elements(file, at, until):
                fields = {k: _read(file, a, b - a) for k, a, b in _elements(file, here, there) if b - a < 256}
                if entry == 0xAE and fields.get(0x83) == b"\x01":  # TrackEntry, of pictures
                    nanoseconds = int.from_bytes(fields.get(0x23E383, b""), "big")
                    return fields[0x86].decode("latin-1").rstrip(
                        "\0"
                    ), 1e9 / nanoseconds if nanoseconds else None
    raise ValueError("no pictures")


def _elements(file: BinaryIO, start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Number, start and end of each element within these bytes; one of unknown size reaches to their end."""
    for _ in range(MOST_ELEMENTS):
        if start >= end:
            return
        head = _read(file, start, min(12, end - start))
        width = 9 - head[0].bit_length()
        number = int.from_bytes(head[:width], "big")
        length = 9 - head[width].bit_length()
        if width > 4 or length > 8:
            raise ValueError("no element")
        coded = int.from_bytes(head[width : width + length], "big")
        size, unknown = coded & ((1 << 7 * length) - 1), (1 << 7 * length) - 1
        at = start + width + length
        after = end if size == unknown else at + size
        if after > end:
            raise ValueError("an element is longer than its file")
        yield number, at, after
        start = after


def _read(file: BinaryIO, at: int, count: int) -> bytes:
    file.seek(at)
    found = file.read(count)
    if len(found) < count:
        raise ValueError("cut off")
    return found
