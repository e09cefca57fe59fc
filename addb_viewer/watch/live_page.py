"""The page for a screen in the laboratory: a small server that answers GET alone and takes no commands."""

import contextlib
import json
import socket
import threading
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from websockets.datastructures import Headers

from addb_viewer.app.security.access import WILDCARDS, Access
from addb_viewer.watch.verdict_log import Stage, VerdictLine, present
from addb_viewer.watch.watching import Session, name_of
from addb_viewer.watch.what_to_do import SIGNS
from solver.common.errors import SolverError
from solver.common.file_names import readable
from solver.common.typed_json import plain

WEB = Path(__file__).parent / "web"
FILES = {
    "/live": ("live.html", "text/html; charset=utf-8"),
    "/live.css": ("live.css", "text/css; charset=utf-8"),
    "/live.js": ("live.js", "text/javascript; charset=utf-8"),
}
STATE = "/live.json"
MOST_LISTED = 40  # trials of a session
PATIENCE_S = 10.0  # for a browser that says nothing
HEADERS = (
    (
        "Content-Security-Policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'",
    ),
    ("X-Content-Type-Options", "nosniff"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cache-Control", "no-store"),
)


def state_of(session: Session) -> Mapping[str, Any]:
    """What the page shows: the last line, the plan's counts, the trials. Texts are no markup."""
    said = [(s, one) for s, lines in session.lines.items() for one in present(lines).values()]
    said.sort(key=lambda one: one[1].when)
    judged = [(s, one) for s, one in said if one.stage is not Stage.STATIC]
    last = judged[-1] if judged else None
    plan = session.plan_of(name_of(last[0])) if last else []
    rows = [_shown(name_of(s), one) for s, one in reversed(said[-MOST_LISTED:])]
    return {
        "folder": readable(session.folder.resolve().name),
        "last": _shown(name_of(last[0]), last[1]) if last else None,
        "busy": not session.is_idle,
        "plan": [{"words": words, "done": done} for words, done in plan],
        "trials": rows,
        "unlisted": [SIGNS[one.colour] for _, one in reversed(said[:-MOST_LISTED])],
        "troubles": [readable(trouble) for trouble in session.troubles],
    }


def _shown(subject: str, line: VerdictLine) -> Mapping[str, Any]:
    values = {**plain(line), "subject": subject, "sign": SIGNS[line.colour]}
    return {name: readable(value) if isinstance(value, str) else value for name, value in values.items()}


class LivePage:
    """The server, in a thread of its own."""

    def __init__(self, host: str, port: int) -> None:
        """It listens from now on.

        Args:
            host: address to listen on.
            port: 0 lets the system choose.

        Raises:
            SolverError: the address is not this machine's, or the port is taken.
        """
        self._state = b"{}"
        self._access = Access(host)
        files = {path: ((WEB / name).read_bytes(), kind) for path, (name, kind) in FILES.items()}
        page = self

        class Handler(BaseHTTPRequestHandler):
            timeout = PATIENCE_S

            def do_GET(self) -> None:
                page.answer(self, files)

            def log_message(self, format: str, *args: Any) -> None:
                """Requests are nobody's business."""

        class Server(ThreadingHTTPServer):
            address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
            daemon_threads = True

            def handle_error(self, request: Any, client_address: Any) -> None:
                """A browser went away."""

        try:
            self._server = Server((host, port), Handler)
        except OSError as error:
            raise SolverError(
                f"{host}, port {port}: cannot be listened on ({error.strerror or error}); choose another "
                "with --port or --host."
            ) from error
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    @property
    def address(self) -> str:
        """As a person types it."""
        host, port = self._access.host, self._server.server_address[1]
        shown = socket.gethostname() if host in WILDCARDS else host
        return f"http://{f'[{shown}]' if ':' in shown else shown}:{port}/live"

    def show(self, state: Mapping[str, Any]) -> None:
        """What browsers are told from now on."""
        self._state = json.dumps(state).encode()

    def close(self) -> None:
        """Stop listening."""
        self._server.shutdown()
        self._server.server_close()

    def answer(self, request: BaseHTTPRequestHandler, files: Mapping[str, tuple[bytes, str]]) -> None:
        """One of the page's files, or what is shown now; nothing to who asks for another machine."""
        port = self._server.server_address[1]
        path = request.path.partition("?")[0]
        headers = Headers(request.headers.items())
        foreign = self._access.answer(headers, path, int(port), websocket=False, own=lambda _: True)
        status, body, kind = (HTTPStatus.NOT_FOUND, b"The page is /live.\n", "text/plain")
        if foreign is not None:
            status, body = foreign.status, foreign.text.encode()
        elif path == STATE:
            status, body, kind = HTTPStatus.OK, self._state, "application/json"
        elif path in files:
            status, (body, kind) = HTTPStatus.OK, files[path]
        with contextlib.suppress(OSError):
            request.send_response(status)
            for name, value in (*HEADERS, ("Content-Type", kind), ("Content-Length", str(len(body)))):
                request.send_header(name, value)
            if path == "/" and foreign is None:
                request.send_header("Refresh", "0; url=/live")
            request.end_headers()
            request.wfile.write(body)
