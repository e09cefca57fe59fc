"""Files appear whole or not at all."""

import pytest

from solver.capture.atomic import whole_file, write_whole
from solver.errors import CaptureError


def test_writes_and_replaces(tmp_path):
    path = tmp_path / "a.txt"
    write_whole(path, "one\n")
    write_whole(path, "Zoë\r\n")
    assert path.read_bytes() == "Zoë\r\n".encode()
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(CaptureError, match=r"nowhere.*cannot write here"):
        write_whole(tmp_path / "nowhere" / "a.txt", "x")


def test_the_old_file_stays_when_writing_fails(tmp_path):
    path = tmp_path / "a.txt"
    write_whole(path, "old")
    with pytest.raises(UnicodeEncodeError):
        write_whole(path, "new \udc80")
    assert path.read_text() == "old"
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
