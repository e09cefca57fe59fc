"""rerun's bundled web viewer with one recording, for this machine only; nothing in the page reaches out.

The page that rerun ships fetches fonts and reports its use to servers on the internet. Here it is handed out
with a content security policy that lets it reach this address only, from a server that answers only requests
for this address, so that no foreign page can read a recording by way of a name that it controls.
"""

import re
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Mapping
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote

from addb_viewer.recordings.rerun_program import rerun_command, rerun_environment
from solver.common.errors import SolverError
from solver.common.operating_system import end_family

THIS_MACHINE = "127.0.0.1"
RECORDING = "/recording.rrd"
PATIENCE_S = 60.0  # for rerun's program to hand out its page
POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; media-src blob:; font-src 'self' data:; "
    "connect-src 'self' data: blob:; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
_PAGE = {
    "/": "text/html; charset=utf-8",
    "/re_viewer.js": "text/javascript; charset=utf-8",
    "/re_viewer_bg.wasm": "application/wasm",
}
_HOSTED = re.compile(r"Hosting a web-viewer at (http://[\d.]+:\d+)")


class ViewerError(SolverError):
    """rerun's viewer cannot be started."""


@dataclass(frozen=True)
class ViewerFiles:
    """rerun's page, by path."""

    files: Mapping[str, bytes]


def viewer_files() -> ViewerFiles:
    """The web viewer that comes with rerun's program.

    Raises:
        ViewerError: the program does not start, or has no viewer.
    """
    with tempfile.TemporaryDirectory() as folder, (Path(folder) / "said").open("w+") as said:
        options = ["--serve-web", "--bind", THIS_MACHINE, "--port", "auto", "--web-viewer-port", "0"]
        program = subprocess.Popen(
            [*rerun_command(), *options],
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            env=rerun_environment(Path(folder)) | {"NO_COLOR": "1"},
        )
        try:
            address = _address(program, Path(said.name))
            return ViewerFiles({name: _fetched(address + name) for name in _PAGE})
        except OSError as error:
            raise ViewerError(f"rerun's viewer cannot be read ({error}).") from error
        finally:
            end_family(program)  # a script and, below it, the program itself
            program.wait()


class RrdServer:
    """Hands out the viewer and one recording until it is closed."""

    def __init__(self, file: Path, viewer: ViewerFiles, port: int = 0) -> None:
        """Listen on a port of this machine; 0 lets the system choose.

        Raises:
            ViewerError: the port is taken.
        """
        try:
            self._server = ThreadingHTTPServer((THIS_MACHINE, port), _handler(file, viewer))
        except OSError as error:
            raise ViewerError(
                f"port {port} of {THIS_MACHINE} cannot be used ({error.strerror}); choose another with --port"
            ) from error

    @property
    def port(self) -> int:
        """The one that it listens on."""
        return self._server.server_port

    @property
    def url(self) -> str:
        """What to open in a browser."""
        own = f"http://{THIS_MACHINE}:{self.port}"
        return f"{own}/?url={quote(own + RECORDING, safe='')}&persist=0"

    def serve(self) -> None:
        """Answer until `close` or an interrupt."""
        self._server.serve_forever()

    def close(self) -> None:
        """Stop answering."""
        self._server.shutdown()
        self._server.server_close()


def _handler(file: Path, viewer: ViewerFiles) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            port = self.connection.getsockname()[1]
            if self.headers.get("Host") not in (f"{THIS_MACHINE}:{port}", f"localhost:{port}"):
                self.send_error(403, "This recording is for this machine only")
                return
            name = self.path.partition("?")[0]
            if name == RECORDING:
                self._answer("application/octet-stream", file.read_bytes())
            elif name in viewer.files:
                self._answer(_PAGE[name], viewer.files[name])
            else:
                self.send_error(404)

        def _answer(self, kind: str, content: bytes) -> None:
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Content-Security-Policy", POLICY)
            self.send_header("X-Content-Type-Options", "nosniff")
            self.send_header("Referrer-Policy", "no-referrer")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *arguments: object) -> None:
            """Nobody reads it."""

    return Handler


def _address(program: subprocess.Popen[bytes], said: Path) -> str:
    """Where rerun's program hands out its page, once it says so."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end and program.poll() is None:
        found = _HOSTED.search(said.read_text(encoding="utf-8", errors="replace"))
        if found is not None:
            return found[1]
        time.sleep(0.05)
    last = said.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-1:]
    raise ViewerError(f"rerun's viewer did not start: {' '.join(last) or 'it said nothing'}")


def _fetched(url: str) -> bytes:
    with urllib.request.urlopen(url, timeout=PATIENCE_S) as answer:
        content: bytes = answer.read()
    return content
