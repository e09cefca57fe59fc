"""What the page may do in the browser: run its own scripts, and talk to the server that it came from.

Viser's page is one file that unpacks its own script. Both its scripts are allowed by their hashes, and ours
come as files of this server: no other one in the page runs, no handler in an attribute, and no text that
comes by a message.
"""

import base64
import functools
import hashlib
import re
from urllib.parse import urlsplit

from addb_viewer.app.viser_bridge.private_parts import page_scripts

_ALWAYS = (
    ("X-Content-Type-Options", "nosniff"),
    ("X-Frame-Options", "DENY"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cache-Control", "no-store"),  # nothing of a recording, and no older page with another policy
)


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
def script_hashes() -> tuple[str, ...]:
    """Of viser's own scripts, as a policy writes them.

    Raises:
        PageError: its page is built in another way.
    """
    hashes = (hashlib.sha256(script).digest() for script in page_scripts())
    return tuple(f"'sha256-{base64.b64encode(each).decode()}'" for each in hashes)
