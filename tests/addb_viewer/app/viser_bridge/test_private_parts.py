"""What the bridge relies on inside viser: a release that lacks it fails here, with a sentence."""

import ast
import inspect
import re
import threading
from pathlib import Path

import msgspec
import pytest
import viser
import websockets.asyncio.server
import websockets.sync.client
from viser.infra import _infra

from addb_viewer.app import viser_bridge
from addb_viewer.app.viser_bridge import private_parts
from addb_viewer.app.viser_bridge.private_parts import (
    PageError,
    check_updates,
    guarded_requests,
    page_scripts,
)
from tests.patience import PATIENCE_S

ROOT = Path(viser_bridge.__file__).parents[3]
BRIDGE = Path(viser_bridge.__file__).parent
INSIDES = ("mantine", "tabler", "#root", "viser-user", ".prototype.")  # of viser's page and the browser


def lacking(what):
    """The sentence about a viser that the bridge cannot work with."""
    return f"viser {viser.__version__} {what}; app/viser_bridge relies on it: adapt it, or pin viser below"


def test_viser_serves_by_a_call_that_is_looked_up_when_a_server_starts():
    source = inspect.getsource(_infra)
    assert re.search(r"process_request=", source), lacking("answers no request through `process_request`")
    asked, wrapped = threading.Event(), threading.Event()

    def look(connection, request, pass_on):
        asked.set()
        return pass_on()

    def guard(handler):
        wrapped.set()
        return handler

    before = websockets.asyncio.server.serve
    with guarded_requests(look, guard):
        server = viser.ViserServer(port=0, verbose=False)
    assert websockets.asyncio.server.serve is before
    try:
        assert wrapped.wait(PATIENCE_S), lacking("does not call `websockets.asyncio.server.serve`")
        with websockets.sync.client.connect(f"ws://127.0.0.1:{server.get_port()}"):
            assert asked.is_set(), lacking("does not hand requests to what `serve` was given")
    finally:
        server.stop()


def test_visers_page_packs_its_script_as_the_bridge_unpacks_it():
    loader, script = page_scripts()
    assert b"ZSTD_decompress" in loader, lacking("unpacks its page by another script")
    assert len(script) > 100_000, lacking("has another script in its page")
    assert b"createElement" in script, lacking("has another script in its page")


def test_a_page_that_is_built_in_another_way_is_an_error_with_a_way_out(tmp_path, monkeypatch):
    page = tmp_path / "client" / "build" / "index.html"
    page.parent.mkdir(parents=True)
    monkeypatch.setattr(private_parts.viser, "__file__", str(tmp_path / "__init__.py"))
    for content, words in (
        ("<script>run()</script>", "pip install viser==1.1.1"),
        ('<script data-p="~~~" data-ss="1" data-cs="2">run()</script>', "cannot be unpacked"),
    ):
        page.write_text(content)
        with pytest.raises(PageError, match=words):
            page_scripts()


def test_values_for_controls_pass_by_the_bridge():
    server, seen = viser.ViserServer(port=0, verbose=False), []
    try:
        for name in ("_websock_interface", "_handle_gui_updates", "_gui_input_handle_from_uuid"):
            assert hasattr(server.gui, name), lacking(f"has no `GuiApi.{name}`")
        box = server.gui.add_checkbox("Bones", False)

        def may_set(control, updates):
            seen.append((control, dict(updates)))
            return updates == {"value": True}

        check_updates(server.gui, may_set)
        (uuid,) = server.gui._gui_input_handle_from_uuid
        with websockets.sync.client.connect(
            f"ws://127.0.0.1:{server.get_port()}", subprotocols=[f"viser-v{viser.__version__}"], max_size=None
        ) as browser:
            for value in (5, True):
                update = {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}
                browser.send(msgspec.msgpack.encode(update))
            wait = threading.Event()
            for _ in range(100):
                if len(seen) == 2 and box.value is True:
                    break
                wait.wait(PATIENCE_S / 100)
        assert seen == [(box, {"value": 5}), (box, {"value": True})], lacking("sets controls in another way")
        assert box.value is True, lacking("sets controls in another way")
    finally:
        server.stop()


@pytest.mark.browser
def test_visers_page_has_the_elements_that_our_scripts_and_styles_name(browser):
    server = viser.ViserServer(port=0, verbose=False)
    server.gui.add_slider("Frame", 0, 9, 1, 0)
    server.gui.add_command("Play")
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    try:
        page.goto(f"http://127.0.0.1:{server.get_port()}")
        page.locator("#root canvas").first.wait_for()
        page.get_by_text("Frame").first.wait_for()
        for selector in (
            "html[data-mantine-color-scheme=light]",
            "body > #root",
            "#root label[for]",
            "button > .mantine-ActionIcon-icon > .tabler-icon-adjustments",
        ):
            assert page.locator(selector).count(), lacking(f"has no `{selector}` in its page")
        style = "(name) => getComputedStyle(document.documentElement).getPropertyValue(name)"
        for name in set(re.findall(r"--mantine-[\w-]+", (BRIDGE / "web" / "viser.css").read_text())):
            assert page.evaluate(style, name), lacking(f"has no colour `{name}`")
    finally:
        page.close()
        server.stop()


def test_nothing_outside_the_bridge_touches_visers_inside():
    package = Path(viser.__file__).parent
    sources = "".join(file.read_text(encoding="utf-8") for file in package.rglob("*.py"))
    private = set(re.findall(r"(?:self|cls)\.(_[a-z]\w*)", sources))
    found = []
    for file in (ROOT / "addb_viewer").rglob("*.py"):
        if BRIDGE in file.parents:
            continue
        text = file.read_text(encoding="utf-8")
        found += [
            f"{file}: imports {name}" for name in re.findall(r"(?:from|import) (viser\.?\w*\._\w+)", text)
        ]
        found += re.findall(r"from viser import .*\b_\w+", text)
        if "viser" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            own = isinstance(node, ast.Attribute) and ast.unparse(node.value) in ("self", "cls")
            if isinstance(node, ast.Attribute) and node.attr in private and not own:
                found.append(f"{file}:{node.lineno}: {ast.unparse(node)}")
    for file in (ROOT / "addb_viewer" / "app").rglob("*"):
        if file.suffix in (".js", ".css") and BRIDGE not in file.parents:
            text = file.read_text(encoding="utf-8")
            found += [f"{file}: {word}" for word in INSIDES if word in text]
    assert found == []


def test_the_bridge_stays_small():
    files = [file for file in BRIDGE.rglob("*") if file.suffix in (".py", ".js", ".css")]
    assert sum(len(file.read_text(encoding="utf-8").splitlines()) for file in files) <= 400
