"""Parts of a file as HTTP asks for them (RFC 9110, 14): a video is played without being read whole."""

import asyncio
import http
import re
from dataclasses import dataclass
from pathlib import Path

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

MOST_BYTES = 4 * 2**20  # of one answer; a browser asks again for what follows


@dataclass(frozen=True)
class ServedFile:
    """A file that this server answers with."""

    file: Path
    kind: str  # as HTTP names it


def part(asked: str | None, size: int) -> tuple[int, int] | None:
    """The bytes that a request is answered with, the last one exclusive; None where there are none.

    Args:
        asked: the header `Range`.
        size: of the file [bytes].
    """
    if asked is None:
        return (0, size) if size <= MOST_BYTES else None
    match = re.fullmatch(r"bytes=(\d{0,18})-(\d{0,18})", asked.strip())
    if match is None or match[1] == match[2] == "":
        return None
    if match[1] == "":
        start, end = max(size - int(match[2]), 0), size
    else:
        start, end = int(match[1]), min(int(match[2]) + 1, size) if match[2] else size
    return (start, min(end, start + MOST_BYTES)) if start < end else None


async def answer_part(connection: ServerConnection, request: Request, served: ServedFile) -> Response:
    """The part that is asked for, read in a thread of its own."""
    asked = request.headers.get("Range")
    try:
        size, found, content = await asyncio.to_thread(_read, served.file, asked)
    except OSError:
        return connection.respond(http.HTTPStatus.NOT_FOUND, "The file is not there any more.\n")
    if found is None:
        response = connection.respond(
            http.HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, "Ask for a part of it.\n"
        )
        response.headers["Content-Range"] = f"bytes */{size}"
        return response
    status = http.HTTPStatus.OK if asked is None else http.HTTPStatus.PARTIAL_CONTENT
    response = connection.respond(status, "")
    response.body = content
    for name, value in (("Content-Length", str(len(content))), ("Content-Type", served.kind)):
        del response.headers[name]
        response.headers[name] = value
    response.headers["Accept-Ranges"] = "bytes"
    if asked is not None:
        response.headers["Content-Range"] = f"bytes {found[0]}-{found[0] + len(content) - 1}/{size}"
    return response


def _read(file: Path, asked: str | None) -> tuple[int, tuple[int, int] | None, bytes]:
    with file.open("rb") as opened:
        size = opened.seek(0, 2)
        found = part(asked, size)
        if found is None:
            return size, None, b""
        opened.seek(found[0])
        return size, found, opened.read(found[1] - found[0])
