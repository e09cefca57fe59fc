"""Files appear whole or not at all."""

import errno
import os
import signal
import subprocess
import sys
import textwrap

import pytest

from solver.capture.atomic import DRAFT, clear_drafts, draft_folder, whole_file, write_whole
from solver.common.disk_errors import check_room
from solver.common.errors import CaptureError


def test_writes_and_replaces(tmp_path):
    path = tmp_path / "a.txt"
    write_whole(path, "one\n")
    write_whole(path, "Zoë\r\n")
    assert path.read_bytes() == "Zoë\r\n".encode()
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(CaptureError, match=r"nowhere.*cannot write here"):
        write_whole(tmp_path / "nowhere" / "a.txt", "x")


def test_the_name_of_another_program_is_written_as_it_is_shown(tmp_path):
    path = tmp_path / "a.txt"
    write_whole(path, "of \udce4.trc\n")
    assert path.read_text(encoding="utf-8") == "of ä.trc\n"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_written_in_pieces_appears_at_the_end(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with whole_file(path) as file:
        file.write(b"ne")
        assert path.read_bytes() == b"old"
        file.write(b"w")
    assert path.read_bytes() == b"new"


def test_a_block_that_fails_leaves_the_old_file_alone(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    written = [b"half"]
    with pytest.raises(IndexError), whole_file(path) as file:
        file.writelines(written.pop() for _ in range(2))
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_told_with_file_room_and_advice_and_keeps_no_draft(small_disk):
    path = small_disk.folder / "a.txt"
    write_whole(path, "old")
    small_disk.fill()
    with pytest.raises(CaptureError, match=r"a\.txt.*No space left.*0\.0 MB free.*free some space"):
        write_whole(path, "new")  # shorter than a buffer: it fails when it is flushed
    with pytest.raises(CaptureError, match=r"a\.txt.*No space left"), whole_file(path) as file:
        file.write(bytes(10**6))
    assert path.read_text() == "old"
    assert sorted(entry.name for entry in small_disk.folder.iterdir()) == ["a.txt", "filler"]


def test_a_limit_on_the_size_of_files_is_told_and_keeps_no_draft(tmp_path):
    script = f"""
        import resource
        from pathlib import Path
        from solver.capture.atomic import write_whole
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        write_whole(Path({str(tmp_path / "a.txt")!r}), "x" * 200)
    """
    run = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], check=False, capture_output=True, text=True
    )
    assert "CaptureError" in run.stderr.splitlines()[-1]
    assert "a.txt: cannot write here (File too large" in run.stderr
    assert list(tmp_path.iterdir()) == []


WRITES_AND_WAITS = """
    import sys, time
    from pathlib import Path
    from solver.capture.atomic import draft_folder, whole_file
    with whole_file(Path("a.bin")) as file, draft_folder(Path(".")) as folder:
        file.write(b"half")
        file.flush()
        (folder / "half").write_bytes(b"half")
        print("writing", flush=True)
        sys.stdin.read()
"""


def test_drafts_of_a_killed_run_go_with_the_next_and_those_of_a_living_one_stay(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(WRITES_AND_WAITS)],
        cwd=tmp_path,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.getcwd()},
    ) as run:
        assert run.stdout is not None
        assert run.stdout.readline() == b"writing\n"
        drafts = sorted(tmp_path.iterdir())
        assert [draft.name.startswith(DRAFT) for draft in drafts] == [True, True]
        clear_drafts(tmp_path)
        assert sorted(tmp_path.iterdir()) == drafts
        run.send_signal(signal.SIGKILL)
        run.wait()
    write_whole(tmp_path / "b.txt", "whatever is written there next")
    assert [path.name for path in tmp_path.iterdir()] == ["b.txt"]


def test_a_folder_that_is_left_before_it_is_moved_goes(tmp_path):
    written = []
    with pytest.raises(IndexError), draft_folder(tmp_path) as folder:
        (folder / "half").write_text(written.pop())
    assert list(tmp_path.iterdir()) == []


def test_where_there_are_no_locks_only_old_drafts_go(tmp_path, monkeypatch):
    monkeypatch.setattr("fcntl.flock", _no_locks)
    young, old = tmp_path / f"{DRAFT}young", tmp_path / f"{DRAFT}old"
    for draft in (young, old):
        draft.write_text("half")
    os.utime(old, (0, 0))
    clear_drafts(tmp_path)
    assert list(tmp_path.iterdir()) == [young]


def _no_locks(_handle, _how):
    raise OSError(errno.ENOLCK, "No locks available")


def test_what_will_not_fit_is_refused_before_it_is_begun(small_disk):
    small_disk.fill(but=200_000)
    check_room(small_disk.folder / "not yet", 100_000, "a fit")
    with pytest.raises(CaptureError, match=r"0\.2 MB free, and a fit will take about 5\.0 MB"):
        check_room(small_disk.folder / "not yet", 5e6, "a fit")
