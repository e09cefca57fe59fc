"""Pages of our own beside viser's, behind the same door: plain files, and connections of their own.

Their policy is stricter than that of viser's page: scripts and styles come from files of this server alone,
nothing is evaluated, and they talk to this server only.
"""

import functools
import gzip
import http
from dataclasses import dataclass, field
from importlib import resources

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Response

from addb_viewer.app.security.file_parts import ServedFile
from addb_viewer.app.viser_bridge.private_parts import Handler

KINDS = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
MOST_BYTES = 2**20  # of a message to one of these connections


@dataclass
class OwnPages:
    """What this server answers to beside viser's page, by path."""

    files: dict[str, tuple[str, bytes]] = field(default_factory=dict)  # kind and content
    connections: dict[str, Handler] = field(default_factory=dict)
    served: dict[str, ServedFile] = field(
        default_factory=dict
    )  # of subjects, under names that cannot be guessed
    head: str = ""  # of viser's page, ahead of its own scripts: safe HTML

    def add_folder(self, package: str, at: str, page: str) -> None:
        """Serve the web files of a package.

        Args:
            package: that holds them.
            at: path below which they lie.
            page: path of the one that ends in `.html`.
        """
        for file in resources.files(package).iterdir():
            ending = file.name[file.name.rfind(".") :]
            if ending in KINDS:
                path = page if ending == ".html" else f"{at}/{file.name}"
                self.files[path] = (KINDS[ending], file.read_bytes())

    def has(self, path: str) -> bool:
        """Whether a request for it, without anything behind a `?`, is answered here."""
        return path in self.files or path in self.served

    def answer(self, connection: ServerConnection, path: str) -> Response | None:
        """The file; None where it is none of ours."""
        if path not in self.files:
            return None
        kind, content = self.files[path]
        response = connection.respond(http.HTTPStatus.OK, "")
        response.body = content
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(content))
        del response.headers["Content-Type"]
        response.headers["Content-Type"] = f"{kind}; charset=utf-8"
        return response

    def with_head(self, response: Response) -> Response:
        """Viser's page with our head in it; any other answer as it is."""
        if self.head and response.headers.get("Content-Type", "").startswith("text/html"):
            packed = response.headers.get("Content-Encoding") == "gzip"
            response.body = _with_head(bytes(response.body or b""), self.head.encode(), packed=packed)
            del response.headers["Content-Length"]
            response.headers["Content-Length"] = str(len(response.body))
        return response

    def in_front_of(self, handler: Handler) -> Handler:
        """The handler of all connections: ours by their paths, the others are viser's."""

        async def chosen(connection: ServerConnection) -> None:
            request = connection.request
            own = self.connections.get("" if request is None else request.path)
            if own is None:
                await handler(connection)
            else:
                await own(connection)

        return chosen


@functools.lru_cache(maxsize=4)
def _with_head(page: bytes, head: bytes, *, packed: bool) -> bytes:
    text = gzip.decompress(page) if packed else page
    text = text.replace(b"<head>", b"<head>" + head, 1)
    return gzip.compress(text) if packed else text
