"""The review app: a server, the subjects of its root, and a session for every browser."""

import contextlib
import getpass
import os
import sys
import threading
import time
import webbrowser
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import viser

from addb_viewer.app.page.channel import Channels
from addb_viewer.app.page.notices import log_error
from addb_viewer.app.page.reviewer import BrowserMemory
from addb_viewer.app.queue.page_channel import QueuePage
from addb_viewer.app.queue.queue_rows import next_trial
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.scene.camera import first_sight
from addb_viewer.app.security.access import Access, TrialAddress, is_loopback
from addb_viewer.app.security.server import AppServer, address, guard_controls, open_server
from addb_viewer.app.shell.actions import connect
from addb_viewer.app.shell.commands import COMMANDS, Command
from addb_viewer.app.shell.keys import chosen_commands
from addb_viewer.app.shell.playback import Pace
from addb_viewer.app.shell.session import Session
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.app.subjects.shared_subject import SharedSubject
from addb_viewer.jobs.root_folder import open_root
from solver.common.errors import SolverError
from solver.common.memory_release import keep_little
from solver.common.operating_system import polite_kill_is_ctrl_c

SWITCH_S = 0.001  # after which a busy thread lets another one in: so long a key waits for a picture


class ReviewApp:
    """One root on one server."""

    def __init__(
        self,
        server: AppServer,
        trials: TrialQueue,
        first: str = ".",
        *,
        login: str | None = None,
        access: Access | None = None,
        commands: Sequence[Command] = COMMANDS,
    ) -> None:
        """Serve from now on.

        Args:
            server: listening.
            trials: the queue of all trials, and their subjects.
            first: name of the subject that browsers begin with.
            login: name that is suggested to who has not said one; None: whoever is logged in here.
            access: that the server asks.
            commands: what keys do.
        """
        sys.setswitchinterval(SWITCH_S)
        keep_little()
        self.server, self.queue, self.access = server, trials, access or Access.of("127.0.0.1")
        self.subjects = trials.subjects
        self.pace, self.channels, self._commands = Pace(), Channels(server.own), commands
        self.sessions: dict[int, Session] = {}
        self._first, self._login = first, _login_name() if login is None else login
        self._lock = threading.Lock()
        self._closed = False
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        first_sight(server)
        trials.watch()
        self.queue_page = QueuePage(trials, server.own, self._login)
        server.on_client_connect(self._join)
        server.on_client_disconnect(self._leave)

    def close(self) -> None:
        """Stop working, drawing and serving."""
        with self._lock:
            self._closed = True
            sessions, self.sessions = list(self.sessions.values()), {}
        for session in sessions:
            session.close()
        self.queue_page.close()
        self.queue.close()
        self.server.stop()

    def _join(self, client: viser.ClientHandle) -> None:
        people = self.queue.people
        guard_controls(client.gui)
        try:
            channel = self.channels.open(client)
            memory, asked = BrowserMemory(channel, self._login), channel.greeting().asked
            people.arrive(client.client_id, memory.author, memory.browser)
            shared, trial, frame = self._beginning(client.client_id, memory, asked)
            session = Session(client, self.queue, shared, self.pace, memory, channel=channel)
            session.at_end = partial(self.channels.close, channel)
            connect(session, self._commands)
        except Exception as error:  # a browser that left at once, or a subject that broke meanwhile
            people.leave(client.client_id)
            log_error("Opening the page", error)
            client.add_notification("Opening the page failed", str(error), color="red")
            return
        with self._lock:
            gone = self._closed or client.client_id not in self.server.get_clients()
            if not gone:
                self.sessions[client.client_id] = session
        if gone:
            session.close()
            return
        session.notices.do("Opening the subject", lambda: session.enter(trial, frame))
        if asked is not None:
            session.notices.do("Opening the address", lambda: _tell_if_elsewhere(session, asked))
        session.notices.do("Reading ahead", session.queue.read_ahead)

    def _beginning(
        self, page: int, memory: BrowserMemory, asked: TrialAddress | None
    ) -> tuple[SharedSubject, str | None, int]:
        """Where a browser begins: where its address or memory says, else at the worst trial that is free."""
        kept = memory.place
        for name, trial, frame in (
            *([(asked.subject, asked.trial, asked.frame)] if asked else []),
            *([(*kept, 0)] if kept else []),
        ):
            if name in self.subjects.root.names:
                with contextlib.suppress(SolverError):  # it may have broken meanwhile
                    return self.subjects.subject(name), trial, frame
        rows = self.queue.rows()
        row = self.queue.people.offer(page, lambda taken: next_trial(rows, None, taken))
        if row is not None:
            with contextlib.suppress(SolverError):  # it may have broken meanwhile
                return self.subjects.subject(row.subject), row.trial, 0
        return self.subjects.subject(self._first), None, 0

    def _leave(self, client: viser.ClientHandle) -> None:
        with self._lock:
            session = self.sessions.pop(client.client_id, None)
        if session is not None:
            session.close()


def _tell_if_elsewhere(session: Session, asked: TrialAddress) -> None:
    """What an address names may have another name now, or lie in another folder."""
    if (session.shared.name, session.shown) != (asked.subject, asked.trial):
        session.notices.tell(
            "The address names a trial that is not here",
            f"{asked.subject}, {asked.trial}: not in the opened folder, or it cannot be read.",
            important=True,
        )


def start(
    folder: Path,
    host: str = "127.0.0.1",
    port: int = 8080,
    results: Path | None = None,
) -> ReviewApp:
    """Open a subject, or a folder of several, in the app and return at once.

    Args:
        folder: the recordings.
        host: address to listen on; others than the loopback ask browsers for a token.
        port: wished for; the next free one is taken when it's not.
        results: folder of the fit; inside the subject's folder by default.

    Raises:
        KeyFileError: the user's file of keys cannot be used.
        CaptureError, ResultsError: the folder, or the fit of the first subject, cannot be read.
        AddressError: the host is no address of this machine.
    """
    commands = chosen_commands()
    trials = TrialQueue(OpenSubjects(open_root(folder), results))
    first = _first_of(trials)
    access = Access.of(host)
    server = open_server(host, port, access)
    login = None if is_loopback(host) else ""
    return ReviewApp(server, trials, first, login=login, access=access, commands=commands)


def _first_of(trials: TrialQueue) -> str:
    """The subject of the worst trial; read now, so that its first picture comes at once."""
    subjects = trials.subjects
    names = dict.fromkeys(row.subject for row in trials.rows() if not row.error) if subjects.several else ()
    for name in names:
        try:
            subjects.subject(name)
        except Exception as error:  # another subject may be whole
            log_error(f"Opening {name}", error)
        else:
            return name
    subjects.subject(subjects.root.names[0])  # says what is wrong
    return subjects.root.names[0]


@polite_kill_is_ctrl_c()  # all is closed
def serve(
    folder: Path,
    host: str = "127.0.0.1",
    port: int = 8080,
    results: Path | None = None,
) -> None:
    """Show subjects in the browser until Ctrl+C; prints the address. Arguments as for `start`."""
    app = start(folder, host, port, results)
    where = address(app.server, app.access)
    taken = f"Port {port} is taken. " if port and app.server.get_port() != port else ""
    print(f"{taken}The app is at {where} (Ctrl+C ends it).", flush=True)
    if _has_display():
        webbrowser.open(where)
    try:
        _until_interrupted()
    except KeyboardInterrupt:
        print()
    finally:
        app.close()


def _until_interrupted() -> None:
    while True:
        time.sleep(3600.0)  # which Ctrl-C ends on Windows too; `Event.wait` it does not


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
