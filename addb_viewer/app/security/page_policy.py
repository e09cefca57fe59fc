"""What the page may do in the browser: run its own scripts, and talk to the server that it came from.

Written for the page of viser 1.1.1: one file that unpacks its own script. Both its scripts are allowed by
their hashes, and ours come as files of this server: no other one in the page runs, no handler in an
attribute, and no text that comes by a message.
"""

import base64
import functools
import hashlib
import re
from pathlib import Path
from urllib.parse import urlsplit

import viser
import zstandard

from solver.common.errors import SolverError

_PACKED = re.compile(
    r'<script data-p="(?P<packed>[^"]*)" data-ss="(?P<style>\d+)" data-cs="(?P<script>\d+)">'
    r"(?P<loader>.*?)</script>",
    re.DOTALL,
)
_DIGITS = [c for c in map(chr, range(0x21, 0x7F)) if c not in "\"&<>'`"]  # of the packed script, to base 88
_ALWAYS = (
    ("X-Content-Type-Options", "nosniff"),
    ("X-Frame-Options", "DENY"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cache-Control", "no-store"),  # nothing of a recording, and no older page with another policy
)


class PageError(SolverError):
    """Viser's page is not the one that this app knows."""


def headers(host: str, *, own: bool = False) -> tuple[tuple[str, str], ...]:
    """What every answer tells the browser.

    Args:
        host: as the request names this server, with its port.
        own: whether it is a page of our own, and not viser's.

    Raises:
        PageError: viser's page cannot be unpacked.
    """
    return (("Content-Security-Policy", _own_policy(host) if own else _policy(host)), *_ALWAYS)


def _policy(host: str) -> str:
    scripts = " ".join(script_hashes())
    return "; ".join(
        (
            "default-src 'none'",
            # Viser unpacks what comes by WebAssembly, which this allows and no text of a script beside it.
            f"script-src 'self' {scripts} 'wasm-unsafe-eval'",
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "media-src 'self'",
            "font-src data:",
            f"connect-src 'self' {_sockets(host)}data: blob:",  # data: and blob: stay in the browser
            "worker-src blob:",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    )


def _own_policy(host: str) -> str:
    """Of a page of our own: files of this server, nothing within the page, nothing evaluated."""
    return "; ".join(
        (
            "default-src 'none'",
            "script-src 'self'",
            "style-src 'self'",
            "img-src 'self' data:",
            f"connect-src 'self' {_sockets(host)}",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    )


def _sockets(host: str) -> str:
    """The server's own connections, for browsers whose 'self' does not mean them; '' for an IPv6 address.

    A policy has no way to write an IPv6 address; there 'self' has to do.
    """
    try:
        place = urlsplit(f"//{host}")
        name, port = place.hostname or "", place.port
    except ValueError:
        return ""
    if not re.fullmatch(r"[a-z0-9._-]+", name):
        return ""
    own = name if port is None else f"{name}:{port}"
    return f"ws://{own} wss://{own} "


@functools.cache
def script_hashes() -> tuple[str, str]:
    """Of the script in viser's page, and of the one that it unpacks, as a policy writes them.

    Raises:
        PageError: the page is built in another way.
    """
    page = Path(viser.__file__).parent / "client" / "build" / "index.html"
    found = _PACKED.search(page.read_text(encoding="utf-8"))
    if found is None:
        raise PageError(
            f"{page}: is not the page of viser 1.1.1. Install that version: pip install viser==1.1.1"
        )
    try:
        unpacked = zstandard.ZstdDecompressor().decompress(_from_base_88(found["packed"]))
    except (KeyError, OverflowError, zstandard.ZstdError) as error:
        raise PageError(
            f"{page}: its script cannot be unpacked ({error}). Install viser again: "
            "pip install --force-reinstall viser==1.1.1"
        ) from error
    start = int(found["style"])
    return _hash(found["loader"].encode()), _hash(unpacked[start : start + int(found["script"])])


def _from_base_88(text: str) -> bytes:
    """Five digits hold four bytes; a rest of k digits holds k - 1."""
    value = {digit: k for k, digit in enumerate(_DIGITS)}
    out = bytearray()
    for i in range(0, len(text), 5):
        digits = text[i : i + 5]
        number = 0
        for digit in digits:
            number = 88 * number + value[digit]
        out += number.to_bytes(len(digits) - 1, "big")
    return bytes(out)


def _hash(script: bytes) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'"
