"""The review app: a server, the subjects of its root, and a session for every browser."""

import contextlib
import getpass
import os
import signal
import sys
import threading
import webbrowser
from pathlib import Path

import viser

from addb_viewer.app.page.browser_memory import Remembered
from addb_viewer.app.page.notices import Notices, log_error
from addb_viewer.app.queue.next_trial import next_trial
from addb_viewer.app.scene.camera import first_sight
from addb_viewer.app.security.access import Door, is_loopback
from addb_viewer.app.security.control_guard import ControlDoor
from addb_viewer.app.security.server import address, open_server
from addb_viewer.app.shell.playback import Pace
from addb_viewer.app.shell.session import Session
from addb_viewer.app.subjects.root_folder import open_root
from addb_viewer.app.subjects.shared_subject import SubjectRoom
from addb_viewer.app.subjects.workspace import House
from solver.errors import SolverError

SWITCH_S = 0.001  # after which a busy thread lets another one in: so long a key waits for a picture


class ReviewApp:
    """One root on one server."""

    def __init__(
        self,
        server: viser.ViserServer,
        house: House,
        first: str = ".",
        *,
        login: str | None = None,
        door: Door | None = None,
    ) -> None:
        """Serve from now on.

        Args:
            server: listening.
            house: the subjects.
            first: name of the subject that browsers begin with.
            login: name that is suggested to who has not said one; None: whoever is logged in here.
            door: that the server asks.
        """
        sys.setswitchinterval(SWITCH_S)
        self.server, self.house, self.door = server, house, door or Door.of("127.0.0.1")
        self.pace = Pace()
        self.sessions: dict[int, Session] = {}
        self._first, self._login = first, _login_name() if login is None else login
        self._lock = threading.Lock()
        self._closed = False
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        first_sight(server)
        house.watch()
        server.on_client_connect(self._join)
        server.on_client_disconnect(self._leave)

    def close(self) -> None:
        """Stop working, drawing and serving."""
        with self._lock:
            self._closed = True
            sessions, self.sessions = list(self.sessions.values()), {}
        for session in sessions:
            session.close()
        self.house.close()
        self.server.stop()

    def _join(self, client: viser.ClientHandle) -> None:
        people = self.house.people
        ControlDoor(client.gui)
        try:
            memory = Remembered(client, self._login)
            people.arrive(client.client_id, memory.author, memory.browser)
            room, trial = self._beginning(client.client_id, memory)
            session = Session(client, self.house, room, self.pace, memory)
        except Exception as error:  # a browser that left at once, or a subject that broke meanwhile
            people.leave(client.client_id)
            Notices(client).error("Opening the page", error)
            return
        with self._lock:
            gone = self._closed or client.client_id not in self.server.get_clients()
            if not gone:
                self.sessions[client.client_id] = session
        if gone:
            session.close()
            return
        session.notices.do("Opening the subject", lambda: session.enter(trial))

    def _beginning(self, page: int, memory: Remembered) -> tuple[SubjectRoom, str | None]:
        """Where a browser begins: where it was, else at the worst trial that waits and that nobody is on."""
        if memory.place is not None and memory.place[0] in self.house.root.names:
            with contextlib.suppress(SolverError):  # it may have broken meanwhile
                return self.house.room(memory.place[0]), memory.place[1]
        rows = self.house.rows()
        row = self.house.people.offer(page, lambda taken: next_trial(rows, None, taken))
        if row is not None:
            with contextlib.suppress(SolverError):  # it may have broken meanwhile
                return self.house.room(row.subject), row.trial
        return self.house.room(self._first), None

    def _leave(self, client: viser.ClientHandle) -> None:
        with self._lock:
            session = self.sessions.pop(client.client_id, None)
        if session is not None:
            session.close()


def start(
    folder: Path,
    host: str = "127.0.0.1",
    port: int = 8080,
    results: Path | None = None,
    log: Path | None = None,
) -> ReviewApp:
    """Open a subject, or a folder of several, in the app and return at once.

    Args:
        folder: the recordings.
        host: address to listen on; others than the loopback ask browsers for a token.
        port: wished for; the next free one is taken when it's not.
        results: folder of the fit; inside the subject's folder by default.
        log: file that the session is written down in.

    Raises:
        CaptureError, ResultsError: the folder, or the fit of the first subject, cannot be read; or the log
            cannot be made.
        AddressError: the host is no address of this machine.
    """
    house = House(open_root(folder), results, log)
    first = _first_of(house)
    door = Door.of(host)
    server = open_server(host, port, door)
    return ReviewApp(server, house, first, login=None if is_loopback(host) else "", door=door)


def _first_of(house: House) -> str:
    """The subject of the worst trial; read now, so that its first picture comes at once."""
    if not house.several:
        house.room(house.root.names[0])
        return house.root.names[0]
    for name in dict.fromkeys(row.subject for row in house.rows() if not row.error):
        try:
            house.room(name)
        except Exception as error:  # another subject may be whole
            log_error(f"Opening {name}", error)
        else:
            return name
    house.room(house.root.names[0])  # says what is wrong
    return house.root.names[0]


def serve(
    folder: Path,
    host: str = "127.0.0.1",
    port: int = 8080,
    results: Path | None = None,
    log: Path | None = None,
) -> None:
    """Show subjects in the browser until Ctrl+C; prints the address. Arguments as for `start`."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ended kindly, as by Ctrl+C: all is closed
    app = start(folder, host, port, results, log)
    where = address(app.server, app.door)
    taken = f"Port {port} is taken. " if port and app.server.get_port() != port else ""
    print(f"{taken}The app is at {where} (Ctrl+C ends it).", flush=True)
    for room in app.house.rooms:
        if room.log is not None:
            print(f"The session is logged in {room.log.file}.", flush=True)
    if _has_display():
        webbrowser.open(where)
    try:
        _until_interrupted()
    except KeyboardInterrupt:
        print()
    finally:
        app.close()


def _until_interrupted() -> None:
    threading.Event().wait()


def _login_name() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return ""


def _has_display() -> bool:
    """Whether a browser could open beside the terminal."""
    if sys.platform in ("darwin", "win32"):
        return "SSH_CONNECTION" not in os.environ
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
