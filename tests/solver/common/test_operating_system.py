"""What no other module may name; and the branches of Windows, on a stand-in for it."""

import ast
import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from solver.capture.atomic import draft_folder, move_draft_folder
from solver.common import operating_system
from solver.fitting.results.writing import LOCK, writing

PROJECT = Path(__file__).parents[3]
MODULE = PROJECT / "solver" / "common" / "operating_system.py"
MODULES = {"signal", "fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "posix", "msvcrt", "winreg"}
WORDS = ("start_new_session", "preexec_fn", "process_group", "creationflags", "pass_fds")
PLACES = ("/proc", "/sys", "/etc", "/var", "/tmp")


def _windows_lacks():
    """Names of `os` that typeshed, which mypy reads, keeps from Windows."""
    stubs = Path(pytest.importorskip("mypy").__file__).parent / "typeshed" / "stdlib" / "os" / "__init__.pyi"
    names = set()
    for block in ast.parse(stubs.read_text(encoding="utf-8")).body:
        if isinstance(block, ast.If) and ast.unparse(block.test) == "sys.platform != 'win32'":
            inner = [node for part in block.body for node in ast.walk(part)]
            names |= {node.name for node in inner if isinstance(node, ast.FunctionDef)}
            names |= {
                node.target.id
                for node in inner
                if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
            }
    return names


def _foreign(tree, lacking):
    """Lines of code that only some systems can run."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found = MODULES & {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found = (MODULES & {node.module}) | (
                lacking & {name.name for name in node.names} if node.module == "os" else set()
            )
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "os":
            found = lacking & {node.attr}
        elif isinstance(node, ast.keyword):
            found = {node.arg} & set(WORDS)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found = {place for place in PLACES if node.value == place or node.value.startswith(place + "/")}
        else:
            continue
        yield from ((node.lineno, name) for name in found)


def test_one_module_alone_names_what_only_some_systems_have():
    lacking = _windows_lacks() | {"kill", "O_NOFOLLOW"}  # `kill` is there, and ends without a word
    assert {"killpg", "fork", "geteuid", "sync", "pwrite", "setpriority", "sched_getaffinity"} <= lacking
    assert list(_foreign(ast.parse(MODULE.read_text(encoding="utf-8")), lacking))  # the check sees some
    found = [
        f"{path.relative_to(PROJECT)}:{line}: {name}"
        for package in ("solver", "annotations", "addb_viewer")
        for path in sorted((PROJECT / package).rglob("*.py"))
        if path != MODULE
        for line, name in _foreign(ast.parse(path.read_text(encoding="utf-8")), lacking)
    ]
    assert found == []


@pytest.fixture
def windows(monkeypatch):
    """What Windows has not is gone, and what it has is noted."""
    monkeypatch.setattr(sys, "platform", "win32")
    for name in ("HAS_LOCKS", "fcntl", "resource"):
        monkeypatch.setattr(operating_system, name, False)
    monkeypatch.setattr("solver.capture.atomic.HAS_LOCKS", False)
    monkeypatch.delattr(os, "setpriority")


def _open_below(folder):
    return [file.path for file in psutil.Process().open_files() if Path(file.path).is_relative_to(folder)]


def test_windows_moves_no_folder_with_an_open_file(windows, tmp_path):
    with draft_folder(tmp_path) as draft:
        (draft / "a.txt").write_text("whole")
        assert _open_below(tmp_path) == []
        move_draft_folder(draft, tmp_path / "made")
    assert [path.name for path in tmp_path.iterdir()] == ["made"]
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["a.txt"]


def test_windows_removes_a_lock_once_it_is_closed(windows, tmp_path, monkeypatch):
    remove, were_open = Path.unlink, []

    def unlink(path, missing_ok=False):
        were_open.append(_open_below(tmp_path))
        remove(path, missing_ok=missing_ok)

    monkeypatch.setattr(Path, "unlink", unlink)
    with writing(tmp_path) as is_alone:
        assert not is_alone
        assert (tmp_path / LOCK).exists()
    assert were_open == [[]]
    assert not (tmp_path / LOCK).exists()


def test_a_process_on_windows_is_asked_by_the_end_of_its_stdin(windows):
    code = "import sys; sys.stdin.read(); sys.exit(5)"
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, text=True)
    operating_system.ask_to_end(process)
    assert process.wait(20) == 5


def test_a_process_on_windows_ends_itself_in_order(windows, monkeypatch):
    asked, ended = [], []
    monkeypatch.setattr(signal, "raise_signal", asked.append)
    monkeypatch.setattr(os, "kill", ended.append)
    monkeypatch.setattr(psutil.Process, "kill", lambda _: ended.append("at once"))
    operating_system.end_self(0.0)
    assert asked == [signal.SIGTERM]
    assert ended == ["at once"]


def test_windows_has_classes_of_priority_and_its_own_peak(windows, monkeypatch):
    given = []
    monkeypatch.setattr(psutil, "IDLE_PRIORITY_CLASS", 64, raising=False)
    monkeypatch.setattr(psutil, "BELOW_NORMAL_PRIORITY_CLASS", 16384, raising=False)
    monkeypatch.setattr(psutil.Process, "nice", lambda _, value: given.append(value))
    operating_system.give_way(os.getpid())
    operating_system.give_way(os.getpid(), operating_system.LOWEST)
    assert given == [16384, 64]
    memory = type("Memory", (), {"peak_wset": 5_000_000})
    monkeypatch.setattr(psutil.Process, "memory_info", lambda _: memory)
    assert operating_system.peak_memory_MB() == 5.0
    assert operating_system._own_bytes() == operating_system.UNLIMITED


def test_windows_waits_for_no_folder(windows, tmp_path):
    operating_system.sync_folder(tmp_path / "missing")  # elsewhere an error


def test_a_program_ends_with_those_that_it_started():
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'print(1, flush=True); input()'])"
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    process.stdout.readline()
    (child,) = psutil.Process(process.pid).children()
    operating_system.end_family(process)
    assert process.wait(20) == -signal.SIGTERM
    child.wait(20)
    operating_system.end_family(process)  # who has ended already is no error


def test_peak_is_no_less_than_what_is_held():
    assert operating_system.peak_memory_MB() * 1e6 >= 0.95 * psutil.Process().memory_info().rss
