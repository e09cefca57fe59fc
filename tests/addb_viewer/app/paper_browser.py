"""A browser without a picture: speaks the page's language, so that whole sessions are tested quickly."""

import json
import re
import threading
import time
from concurrent.futures import CancelledError
from contextlib import suppress

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from addb_viewer.app.page.channel import CONNECTION
from addb_viewer.app.shell.commands import COMMANDS
from tests.patience import PATIENCE_S

ENDING_S = 2.0
ACTIONS = {command.label: command.action for command in COMMANDS}


def _texts(value):
    """All texts in what JSON holds."""
    if isinstance(value, str):
        return [value]
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return [text for each in inside for text in _texts(each)]


def let_finish(session):
    """Wait for what the session is doing: a test that sees the first of its results may ask for the last.

    Not for ever: it may itself be waiting for what the test does next.
    """
    if session is not None:
        with suppress(RuntimeError, CancelledError, TimeoutError):  # it has ended, ends just now, or waits
            session.notices._hand.submit(lambda: None).result(ENDING_S)


class PaperBrowser:
    """One connection to the app. What the server sent is in `commands` and `gui`."""

    def __init__(self, port, headers=None, name="Zoë", at=None):
        """The browser remembers name and place (subject and trial); None: it has never been here."""
        self.memory = {} if name is None else {"reviewer": name, "place": at}
        self.commands, self.gui, self.session = {}, {}, None
        self.messages = 0
        self._heard = threading.Condition()
        self._port, self._headers, self._told, self._typed = port, headers, {}, ""
        self._channel = None
        self._socket = connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],
            max_size=None,
            compression=None,
            additional_headers=headers,
            open_timeout=PATIENCE_S,
            ping_timeout=PATIENCE_S,
        )
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()
        self._say(
            "ViewerCameraMessage",
            wxyz=(1.0, 0.0, 0.0, 0.0),
            position=(0.0, 1.0, 3.0),
            fov=0.7,
            near=0.01,
            far=1000.0,
            image_height=800,
            image_width=1280,
            look_at=(0.0, 1.0, 0.0),
            up_direction=(0.0, 1.0, 0.0),
        )

    def press(self, label):
        """As the command's key does: over the channel, in the order of the clicks."""
        self.until(lambda: self._told.get("keys"), "the keys")
        self._ask("do", ACTIONS[label])

    def press_in_palette(self, label):
        """As the palette of commands does: after what was put into fields."""
        self._say("CommandTriggerMessage", uuid=self.until(lambda: self.commands.get(label), label))

    def finish(self, *words):
        """T, and again when the first one has asked, and said what speaks against it: with these words."""
        self.press("Finish the trial, go to the next")
        for said in ("Finish ", *words):
            self.until(lambda said=said: self.asked(said), said)
        self.press("Finish the trial, go to the next")

    @property
    def verdict(self):
        """The first line of the page, in one text; empty before a trial is open."""
        told = (self._shown("bar") or {}).get("verdict") or {}
        return " · ".join(told[part] for part in ("use", "why", "frames", "open") if told.get(part))

    def go_to(self, text):
        """As a click on the timeline or on a list."""
        self._ask("go_to", text)

    def select(self, start, end):
        """Frames, the last exclusive, as a drag over the timeline does; returns when they are."""
        self.go_to(f"{start}:{end}")
        self.until(lambda: self._shown("selection") == [start, end], "the selection")

    def open_trial(self, name):
        """From the list of trials."""
        self.press("Choose a trial")
        row = self.until(
            lambda: re.search(
                rf"data-addb-go-to='(#\d+)'(?:(?!<b).)*<b[^>]*>[^<]*{re.escape(name)}</b>",
                " ".join(self.questions),
            ),
            name,
        )
        self.go_to(row[1])

    def put(self, label, value):
        """Write into a field, choose from a list, tick a box."""
        if (self._dialog.get("field") or {}).get("label") == label:
            self._typed = value
            return
        uuid = self.until(lambda: self._field(label), label)
        self._say("GuiUpdateMessage", uuid=uuid, updates={"value": value})

    def click(self, label):
        """On a button, which bears these words or begins with them."""
        dialog = self._dialog
        for button, words in enumerate(dialog.get("buttons", ())):
            if words.startswith(label):
                typed = self._typed or (dialog["field"] or {}).get("value", "")
                self._ask("answer", {"dialog": dialog["number"], "button": button, "text": typed})
                return
        self._say(
            "GuiUpdateMessage", uuid=self.until(lambda: self._button(label), label), updates={"value": True}
        )

    @property
    def questions(self):
        """All texts of the dialog that is open."""
        return _texts(self._dialog)

    def asked(self, words):
        """Whether a dialog is open whose title or text says this."""
        return any(words in text for text in self.questions)

    @property
    def _dialog(self):
        return self._shown("dialog") or {}

    def html(self):
        """All texts on the page, those in the bar included."""
        with self._heard:
            texts = [p["content"] for p in self.gui.values() if isinstance(p.get("content"), str)]
        return " ".join([*texts, *_texts(self._shown("bar"))])

    @property
    def frame(self):
        """On which the cursor of the page stands; None before a trial is open."""
        return self._shown("cursor")

    @property
    def trial(self):
        """What the timeline knows of the trial on the screen; None before one is open."""
        return self._shown("trial")

    @property
    def bar(self):
        """What the bar at the lower edge says, by part."""
        return self._shown("bar") or {}

    @property
    def notices(self):
        """Title and text of all that was told, oldest first."""
        return [(notice["title"], notice["body"]) for notice in self._shown("notices") or ()]

    def told(self, words):
        """Whether a notice says this."""
        return any(words in f"{title} {body}" for title, body in self.notices)

    def _shown(self, kind):
        """What the session shows over the channel of our own."""
        return self._told.get(kind) if self.session is None else self.session.channel.shown(kind)

    def until(self, condition, what="the app"):
        end = time.monotonic() + PATIENCE_S
        while not (value := condition()):
            assert time.monotonic() < end, f"waited in vain for {what}; notices: {self.notices}"
            with self._heard:
                self._heard.wait(0.02)
        let_finish(self.session)
        return value

    def close(self):
        self._socket.close()
        if self._channel is not None:
            self._channel.close()
        self._thread.join(PATIENCE_S)

    def field(self, label):
        """What the page knows of a field."""
        return self.gui[self.until(lambda: self._field(label), label)]

    def _field(self, label):
        with self._heard:
            return next((uuid for uuid, props in self.gui.items() if props.get("label") == label), None)

    def _button(self, label):
        with self._heard:
            return next((uuid for uuid, p in self.gui.items() if str(p.get("label")).startswith(label)), None)

    def _say(self, kind, **content):
        self._socket.send(msgspec.msgpack.encode({"type": kind, **content}))

    def _listen(self):
        try:
            for raw in self._socket:
                size = int.from_bytes(raw[8:16], "little")
                content = zstandard.ZstdDecompressor().decompress(
                    raw[16 : 16 + size], max_output_size=int.from_bytes(raw[:8], "little")
                )
                with self._heard:
                    for message in msgspec.msgpack.decode(content)["messages"]:
                        self._hear(message)
                    self._heard.notify_all()
        except Exception:  # the connection ended
            return

    def _ask(self, kind, value):
        self.until(lambda: self._channel, "the channel")
        self._channel.send(json.dumps([kind, value]))

    def _listen_to_channel(self, name):
        address = f"ws://127.0.0.1:{self._port}{CONNECTION}"
        try:
            with connect(
                address, additional_headers=self._headers, open_timeout=PATIENCE_S, compression=None
            ) as socket:
                socket.send(json.dumps({"name": name, "query": "", "memory": self.memory}))
                self._channel = socket
                for text in socket:
                    kind, value = json.loads(text)
                    with self._heard:
                        self._told[kind] = value
                        if kind == "memory":
                            self.memory = value
                        self._heard.notify_all()
        except (ConnectionClosed, OSError):  # the session or the app has ended
            return

    def _hear(self, message):
        kind = message["type"]
        self.messages += 1
        if kind == "RegisterCommandMessage":
            self.commands[message["props"]["label"]] = message["uuid"]
        elif kind == "GuiRemoveMessage":
            self.gui.pop(message["uuid"], None)
        elif kind == "GuiUpdateMessage":
            self.gui.get(message["uuid"], {}).update(message["updates"])
        elif kind.startswith("Gui") and "props" in message:
            if page := re.search("data-addb-page='(.+)'", str(message["props"].get("content"))):
                threading.Thread(target=self._listen_to_channel, args=(page[1],), daemon=True).start()
            self.gui[message["uuid"]] = {**message["props"], "value": message.get("value")}
