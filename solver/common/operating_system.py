"""What systems do each in their own way: locks, signals, priorities, memory.

Locks hold between processes, and on network file systems that pass them on (NFS 4, SMB) between machines, and
end with the process that holds them, however it ends. Where there are none, as on some network shares and on
Windows, `taken` says so, and the caller goes by age. Windows ends another process without a word to it.
"""

import contextlib
import errno
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil

with contextlib.suppress(ImportError):  # Windows
    import fcntl
    import resource

HAS_LOCKS = sys.platform != "win32"
UNOWNED_S = 86400.0  # [s] without locks, what nobody has touched for a day is nobody's: no write takes that
AGAIN_S = 0.01  # [s] between two tries; a lock is held while a file is written and a folder renamed
CANCELLED = 143  # exit status, as shells count it
LOWEST = 19  # of 19: what nobody waits for
NICE = 10  # of 19: the less, the sooner it gets the processor; the app itself has 0
CGROUPS = Path("/sys/fs/cgroup")
OWN_GROUPS = Path("/proc/self/cgroup")
UNLIMITED = 2**60  # bytes; what groups without a limit say is near 2^63

_HELD_BY_ANOTHER = {errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES}


def taken(handle: int, patience_s: float = 0.0) -> bool | None:
    """Lock an open file for this process alone; closing it lets it go.

    Args:
        handle: open for writing.
        patience_s: how long to wait while somebody else holds it [s].

    Returns:
        Whether it is held now; None where this file system has no locks.
    """
    if sys.platform == "win32":
        return None
    end = time.monotonic() + patience_s
    while True:
        held = _held(lambda: fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB))
        if held is not False or time.monotonic() >= end:
            return held
        time.sleep(AGAIN_S)


def _held(lock: Callable[[], None]) -> bool | None:
    try:
        lock()
    except OSError as error:
        return False if error.errno in _HELD_BY_ANOTHER else None
    return True


def abandoned(path: Path) -> bool:
    """Whether nobody has touched a file or folder for so long that it is nobody's, locks or not."""
    try:
        return time.time() - path.stat().st_mtime > UNOWNED_S
    except OSError:
        return False  # somebody removes it just now


def remove_lock(file: Path, handle: int) -> None:
    """Remove a file that is locked, and let it go: who waits for it looks again."""
    if HAS_LOCKS:
        file.unlink(missing_ok=True)
    os.close(handle)
    if not HAS_LOCKS:
        with contextlib.suppress(OSError):  # Windows removes no open file: another one's by now
            file.unlink()


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk, where a system can say so."""
    if sys.platform == "win32":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def ask_to_end(process: subprocess.Popen[str]) -> None:
    """Let a process of ours clear away what is half written; the end of its stdin says so on Windows."""
    if sys.platform != "win32":
        process.terminate()
    elif process.stdin is not None:
        process.stdin.close()


def end_self(patience_s: float) -> None:
    """Ask this process, from any of its threads, to end; where it does not obey, at once."""
    if sys.platform == "win32":
        signal.raise_signal(signal.SIGTERM)  # what `os.kill` does there asks nobody
    else:
        os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(patience_s)
    psutil.Process().kill()


def end_family(process: subprocess.Popen[bytes]) -> None:
    """End a program and those that it has started."""
    with contextlib.suppress(psutil.NoSuchProcess):
        root = psutil.Process(process.pid)
        for one in (*root.children(recursive=True), root):
            with contextlib.suppress(psutil.NoSuchProcess):
                one.terminate()


def end_in_order() -> None:
    """In a process of ours: let who asks it to end have it clear away what is half written."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(CANCELLED))


def ignore_ctrl_c() -> None:
    """Leave Ctrl-C to the process that started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextlib.contextmanager
def polite_kill_is_ctrl_c() -> Iterator[None]:
    """Whoever asks this process to end is taken for Ctrl-C; elsewhere than in the main thread nothing can."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def signal_of(status: int) -> str | None:
    """Name of the signal that ended a process of this exit status; None where it ended otherwise."""
    return signal.Signals(-status).name if status < 0 else None


def give_way(process: int, nice: int = NICE) -> None:
    """Let others have the processor first."""
    if sys.platform == "win32":
        nice = psutil.IDLE_PRIORITY_CLASS if nice > NICE else psutil.BELOW_NORMAL_PRIORITY_CLASS
    with contextlib.suppress(psutil.Error):  # it has ended already
        psutil.Process(process).nice(nice)


def processors() -> int:
    """That this process may use."""
    process = psutil.Process()
    return len(process.cpu_affinity()) if hasattr(process, "cpu_affinity") else os.cpu_count() or 1


def peak_memory_MB() -> float:
    """The most that this process has held."""
    if sys.platform == "win32":
        return psutil.Process().memory_info().peak_wset / 1e6
    unit = 1 if sys.platform == "darwin" else 1024  # bytes
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def available_bytes() -> int:
    """What this process may still take: of the machine, of its control group, and of its own limit."""
    memory = psutil.virtual_memory()
    # macOS makes swap files as they are needed, and what it calls available leaves out what it would swap.
    machine = memory.total if sys.platform == "darwin" else memory.available + psutil.swap_memory().free
    return max(0, min(machine, _group_bytes(), _own_bytes()))


def _group_bytes() -> int:
    """Of the control groups that hold this process (a container, a batch job), the least."""
    try:
        lines = OWN_GROUPS.read_text().splitlines()
    except OSError:
        return UNLIMITED
    left = UNLIMITED
    for line in lines:
        _, kinds, path = line.split(":", 2)
        if kinds == "":
            root, limit, used = CGROUPS, "memory.max", "memory.current"
        elif "memory" in kinds.split(","):
            root, limit, used = CGROUPS / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes"
        else:
            continue
        inner = root / path.strip("/")
        for group in (inner, *inner.parents):  # in a container, the path may be the host's
            if group.is_relative_to(root):
                left = min(left, _left_in(group, limit, used))
    return left


def _left_in(group: Path, limit: str, used: str) -> int:
    try:
        most = (group / limit).read_text().strip()
        if not most.isdigit() or int(most) >= UNLIMITED:  # "max"
            return UNLIMITED
        stat = dict(line.split(" ", 1) for line in (group / "memory.stat").read_text().splitlines())
        cache = int(stat.get("total_inactive_file", stat.get("inactive_file", "0")))  # given back when asked
        return int(most) - int((group / used).read_text()) + cache
    except (OSError, ValueError):
        return UNLIMITED


def _own_bytes() -> int:
    """What `ulimit -v` leaves."""
    if sys.platform == "win32":
        return UNLIMITED
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    return UNLIMITED if most == resource.RLIM_INFINITY else most - psutil.Process().memory_info().vms
