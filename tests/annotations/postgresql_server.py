"""A real PostgreSQL server in a temporary folder, reached over a socket there and over nothing else."""

import os
import pwd
import shutil
import subprocess
import tempfile
from itertools import count
from pathlib import Path
from urllib.parse import quote

import psycopg
import pytest

from tests.patience import PATIENCE_S

DEBIANS = "/usr/lib/postgresql"  # which keeps the server's programs off PATH, by version
USER = "reviews"
MISSING = (
    "no PostgreSQL server found: initdb is neither on PATH nor below /usr/lib/postgresql (Debian: postgresql)"
)


class Server:
    """Starts when made; what is kept in it goes with it."""

    def __init__(self, programs: Path, folder: Path) -> None:
        self._programs, self._folder = programs, folder
        self._names = (f"reviews_{number}" for number in count(1))
        self._as = _unprivileged()
        folder.chmod(0o700)
        if self._as:
            shutil.chown(folder, self._as["user"])
        self._run("initdb", "--username", USER, "--auth", "trust", "--encoding", "UTF8", "--locale", "C")
        self.start()

    def start(self) -> None:
        """Let it serve; after a crash it first brings its files in order."""
        settings = f"-c listen_addresses= -c unix_socket_directories={self._folder}"
        self._run(
            "pg_ctl",
            "--wait",
            "--timeout",
            f"{PATIENCE_S:.0f}",
            "--log",
            self._folder / "log",
            "-o",
            settings,
            "start",
        )

    def stop(self, mode: str = "fast") -> None:
        """End it; `immediate` is a crash: nothing is brought in order."""
        self._run("pg_ctl", "--wait", "--timeout", f"{PATIENCE_S:.0f}", "--mode", mode, "stop")

    def new_place(self) -> str:
        """The URL of an empty schema; many databases would take long to make and to remove."""
        name = next(self._names)
        with psycopg.connect(host=str(self._folder), user=USER, dbname="postgres") as connection:
            connection.execute(f"CREATE SCHEMA {name}")
        folder = quote(str(self._folder), safe="")
        return f"postgresql://{USER}@/postgres?host={folder}&options=-csearch_path%3D{name}"

    def _run(self, program: str, *arguments: object) -> None:
        done = subprocess.run(
            [self._programs / program, "--pgdata", self._folder / "data", *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=self._folder,
            check=False,
            timeout=PATIENCE_S,
            **self._as,
        )
        if done.returncode:
            log = self._folder / "log"
            pytest.fail(f"{program} failed: {log.read_text() if log.exists() else 'before it had a log'}")


@pytest.fixture(scope="session")
def postgresql():
    """A server for all tests of a process; they are skipped where there is none on this machine."""
    programs = _programs()
    if programs is None:
        pytest.skip(MISSING)
    with tempfile.TemporaryDirectory(prefix="addb-pg-", dir="/tmp") as folder:  # a socket's path is short
        server = Server(programs, Path(folder))
        yield server
        server.stop("immediate")


def _programs() -> Path | None:
    """The folder with the server's programs, of the newest version that there is."""
    on_path = shutil.which("initdb")
    if on_path is not None:
        return Path(on_path).resolve().parent
    found = sorted(Path(DEBIANS).glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    return found[-1].parent if found else None


def _unprivileged() -> dict[str, object]:
    """How to run as somebody who is not root, whom PostgreSQL refuses."""
    if os.geteuid() != 0:
        return {}
    for name in ("postgres", "nobody"):
        try:
            return {"user": name, "group": pwd.getpwnam(name).pw_gid, "extra_groups": []}
        except KeyError:
            continue
    return pytest.skip("running as root, and no user 'nobody' to run PostgreSQL as")
