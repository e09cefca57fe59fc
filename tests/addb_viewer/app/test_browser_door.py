"""The page against strangers, in a real browser: it listens to its own server alone, and nobody frames it."""

import contextlib
import http.server
import socket
import threading

import msgspec
import pytest
import viser
import zstandard
from websockets.sync.server import serve

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.access import Access
from addb_viewer.app.security.server import address, open_server
from tests.addb_viewer.app.conftest import EVAL_PROBE
from tests.patience import PATIENCE_MS

pytestmark = pytest.mark.browser

NO_FRAGMENT = "Fragment identifiers are not allowed"  # Chromium, of the page's own address as a server's
LINKS = (
    "?websocket={there}",
    "?%77eb%73ocket={there}",
    "?a=1&websocket={there}&websocket=ws://127.0.0.1",
    "?WebSocket={there}&websocket={there}",
    "index.html?websocket={there}",
    "?websocket={there}#websocket={there}",
    "#?websocket={there}",
)
PATIENCE_S = 60.0  # software rendering on a busy machine
SCRIPT = "window.hacked = 1; document.title = 'hacked'"


@pytest.fixture(scope="module", params=[None, "right-token"], ids=["loopback", "token"])
def guarded(request, tmp_path_factory, make_replay, make_library):
    """An app on the loopback, or one that asks for a token as on the network."""
    access = Access("127.0.0.1", request.param)
    library = make_library(tmp_path_factory.mktemp("subject"), [make_replay()])
    app = ReviewApp(open_server(port=0, access=access), TrialQueue.of(library), access=access)
    yield app
    app.close()


@pytest.fixture(scope="module")
def reviewers_browser(browser, guarded):
    """It has been in the app and keeps the cookie."""
    context = browser.new_context()
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    assert page.goto(address(guarded.server, guarded.access)).status == 200
    page.close()
    yield context
    context.close()


@pytest.fixture
def let_in(reviewers_browser):
    """A page of it, still empty."""
    page = reviewers_browser.new_page()
    page.said = []
    page.on("console", lambda said: page.said.append(said.text))
    yield page
    page.close()


@pytest.fixture
def hostile():
    """A stranger's server of viser's protocol, which sends JavaScript to whoever connects."""
    visits = []
    content = msgspec.msgpack.encode(
        {
            "messages": ({"type": "RunJavascriptMessage", "source": SCRIPT},),
            "timestampSec": 0.0,
            "binaryBufferLengths": (),
        }
    )
    packed = zstandard.ZstdCompressor().compress(content)
    frame = len(content).to_bytes(8, "little") + len(packed).to_bytes(8, "little") + packed

    def greet(connection):
        visits.append(connection.request.path)
        connection.send(frame + bytes(-len(frame) % 8))
        for _ in connection:
            pass

    with serve(greet, "127.0.0.1", 0, subprotocols=[f"viser-v{viser.__version__}"]) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.socket.getsockname()[1], visits
        server.shutdown()


@pytest.fixture
def strange_pages(tmp_path):
    """A stranger's web server with files, open to every page; and the paths that were asked for."""
    asked = []

    class Handler(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *args):
            super().__init__(*args, directory=str(tmp_path))

        def end_headers(self):
            self.send_header("Access-Control-Allow-Origin", "*")
            super().end_headers()

        def log_message(self, *args):
            asked.append(self.path)

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_address[1], tmp_path, asked
        server.shutdown()


@pytest.mark.slow
def test_the_page_listens_to_no_server_that_a_link_names(guarded, let_in, hostile, until):
    """Who has the token's cookie is answered as everybody on the loopback: one link is enough there."""
    port, visits = hostile
    home = f"http://127.0.0.1:{guarded.server.get_port()}/"
    for options in LINKS[:1] if guarded.access.token else LINKS:
        before = set(guarded.sessions)
        let_in.said.clear()
        let_in.goto(home + options.format(there=f"ws://127.0.0.1:{port}"))
        until(lambda b=before: visits or set(guarded.sessions) - b or _tried_in_vain(let_in), "a connection")
        assert visits == [], options
        assert let_in.evaluate("window.hacked") is None, options


def _tried_in_vain(page):
    page.evaluate("0")  # lets playwright hear what was said meanwhile
    return any(NO_FRAGMENT in text for text in page.said)


@pytest.mark.slow
def test_the_page_plays_no_recording_that_a_link_names(guarded, let_in, strange_pages, until):
    port, folder, asked = strange_pages
    (folder / "evil.viser").write_bytes(_recording())
    before = set(guarded.sessions)
    home = f"http://127.0.0.1:{guarded.server.get_port()}/"
    for name in ("playbackPath", "%70laybackPath"):
        let_in.goto(f"{home}?{name}=http://127.0.0.1:{port}/evil.viser")
        until(lambda: asked or set(guarded.sessions) - before, "a connection or a download")
        assert asked == []
        assert let_in.evaluate("window.hacked") is None


def _recording():
    messages = ((0.0, {"type": "RunJavascriptMessage", "source": SCRIPT}),)
    content = msgspec.msgpack.encode(
        {
            "durationSeconds": 1.0,
            "messages": messages,
            "viserVersion": viser.__version__,
            "binaryBufferLengths": (),
        }
    )
    inner = len(content).to_bytes(8, "little") + content
    inner += bytes(-len(inner) % 8)
    return len(inner).to_bytes(8, "little") + zstandard.ZstdCompressor().compress(inner)


def test_even_a_script_in_the_page_reaches_nobody_else(guarded, let_in, hostile, strange_pages):
    port, visits = hostile
    pages, folder, asked = strange_pages
    (folder / "file.txt").write_text("")
    let_in.goto(f"http://127.0.0.1:{guarded.server.get_port()}/")
    tried = let_in.evaluate(
        """async ([port, pages]) => {
            const there = `http://127.0.0.1:${pages}/file.txt`;
            const tell = (object) => new Promise(done => {
                object.onopen = object.onload = () => done("reached");
                object.onerror = () => done("refused");
            });
            const socket = () => tell(new WebSocket(`ws://127.0.0.1:${port}`, "viser-v1.1.1"));
            const image = () => { const i = new Image(); i.src = there; return tell(i); };
            const script = () => {
                const s = Object.assign(document.createElement("script"), { src: there });
                document.head.append(s);
                return tell(s);
            };
            const fetched = () => fetch(there).then(() => "reached", () => "refused");
            return Promise.all([socket, image, script, fetched].map(async (f) => {
                try { return await f(); } catch { return "refused"; }
            }));
        }""",
        [port, pages],
    )
    assert tried == ["refused"] * 4
    assert visits == []
    assert asked == []


def test_what_is_put_into_the_page_does_not_run(guarded, let_in, until):
    let_in.goto(f"http://127.0.0.1:{guarded.server.get_port()}/")
    let_in.evaluate(
        """() => {
            window.refused = [];
            document.addEventListener("securitypolicyviolation", (e) => refused.push(e.effectiveDirective));
            const inline = document.createElement("script");
            inline.textContent = "window.hacked = 1";
            document.body.append(inline);
            document.body.insertAdjacentHTML("beforeend", "<img src='data:,' onerror='window.hacked = 2'>");
        }"""
    )
    until(lambda: {"script-src-attr", "script-src-elem"} <= set(let_in.evaluate("refused")), "two refusals")
    assert let_in.evaluate("window.hacked") is None


def test_no_other_page_shows_it_in_a_frame(guarded, let_in, strange_pages, until):
    port, folder, _ = strange_pages
    home = f"http://127.0.0.1:{guarded.server.get_port()}/"
    (folder / "frame.html").write_text(f"<iframe src='{home}'></iframe>")
    before = set(guarded.sessions)
    let_in.goto(f"http://127.0.0.1:{port}/frame.html")
    until(lambda: set(guarded.sessions) - before or _refused(let_in), "the frame")
    assert _refused(let_in)


def _refused(page):
    with contextlib.suppress(IndexError):
        return page.frames[1].url.startswith("chrome-error:")
    return False


@pytest.mark.slow
def test_pictures_and_downloads_pass_the_policy(guarded, let_in, until):
    """Viser's own way to a picture of the scene, and a file that the page saves."""
    client = _client_of(guarded, let_in, f"http://127.0.0.1:{guarded.server.get_port()}/", until)
    for kind in ("jpeg", "png"):
        picture = client.get_render(90, 160, transport_format=kind, timeout=PATIENCE_S)
        assert picture.shape[:2] == (90, 160)
        assert picture[..., :3].std() > 1.0  # somebody over plates, not one colour
    content = bytes(range(256)) * 9000  # more than one part
    with let_in.expect_download(timeout=1000 * PATIENCE_S) as saved:
        client.send_file_download("walk.mcap", content, save_immediately=True)
    assert saved.value.suggested_filename == "walk.mcap"
    assert saved.value.path().read_bytes() == content
    assert refused_beside_the_probe(let_in) == []


def test_the_loopback_of_ipv6_works(browser, tmp_path, make_replay, make_library, until):
    with contextlib.closing(socket.socket(socket.AF_INET6)) as trial:
        try:
            trial.bind(("::1", 0))
        except OSError:
            pytest.skip("this machine has no IPv6 loopback")
    access = Access.of("::1")
    assert access.token is None
    app = ReviewApp(
        open_server("::1", port=0, access=access),
        TrialQueue.of(make_library(tmp_path, [make_replay()])),
        access=access,
    )
    context = browser.new_context()
    page = context.new_page()
    page.said = []
    page.on("console", lambda said: page.said.append(said.text))
    try:
        client = _client_of(app, page, address(app.server, access), until)
        assert client.get_render(90, 160, timeout=PATIENCE_S).shape[:2] == (90, 160)
        assert refused_beside_the_probe(page) == []
    finally:
        context.close()
        app.close()


def refused_beside_the_probe(page):
    """What the policy refused, but for what a library of viser's tries and does without."""
    return [text for text in page.said if "Content Security Policy" in text and EVAL_PROBE not in text]


def _client_of(app, page, home, until):
    """The server's side of a page that has just come."""
    before = set(app.sessions)
    page.goto(home)
    (new,) = until(lambda: set(app.sessions) - before, "a connection")
    return app.server.get_clients()[new]
