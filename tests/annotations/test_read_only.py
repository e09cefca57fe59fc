"""A log that lies where nothing can be written is read all the same, and says why nothing is recorded."""

import shutil

import pytest

from annotations.events import FlagRange
from annotations.log import ReviewLog
from annotations.review_errors import ReviewError

FIRST, SECOND = FlagRange(10, 20, "manualReview"), FlagRange(30, 40, "manualReview")
NOT_HERE = (
    r"annotations\.sqlite: nothing was recorded: it cannot be written to from here.*make it and its folder"
)
NO_ROOM = (
    r"annotations\.sqlite: nothing was recorded: .*the disk could not be written \(0\.0 MB free\); "
    "free some space"
)


def _written(path):
    """A closed log with one edit."""
    with ReviewLog.open(path) as log:
        log.append("walk", FIRST, "anna")


def _left_behind(path):
    """What a killed program leaves: the second edit is in the write-ahead log alone."""
    _written(path)
    with ReviewLog.open(path) as log:
        log.append("walk", SECOND, "ben")
        for name in (path.name, f"{path.name}-wal"):
            shutil.copy(path.with_name(name), path.with_name(f"copy {name}"))
    for name in (path.name, f"{path.name}-wal"):
        path.with_name(f"copy {name}").rename(path.with_name(name))


@pytest.mark.parametrize(("make", "edits"), [(_written, [FIRST]), (_left_behind, [FIRST, SECOND])])
def test_a_log_in_a_read_only_folder_is_read_and_refuses_edits(tmp_path, read_only, make, edits):
    folder = tmp_path / "subject"
    folder.mkdir()
    make(folder / "annotations.sqlite")
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    with ReviewLog.open(read_only(folder) / "annotations.sqlite") as log:
        assert [edit.event for edit in log.history()] == edits
        assert log.file is None
        with pytest.raises(ReviewError, match=NOT_HERE):
            log.append("walk", SECOND, "anna")
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.parametrize(("make", "edits"), [(_written, [FIRST]), (_left_behind, [FIRST, SECOND])])
def test_a_log_on_a_full_disk_is_read_and_refuses_edits(small_disk, make, edits):
    path = small_disk.folder / "annotations.sqlite"
    make(path)
    small_disk.fill()
    with ReviewLog.open(path) as log:
        assert [edit.event for edit in log.history()] == edits
        with pytest.raises(ReviewError, match=NO_ROOM):
            log.append("walk", SECOND, "anna")
    small_disk.empty()
    with ReviewLog.open(path) as log:
        log.append("walk", SECOND, "anna")
        assert [edit.event for edit in log.history()] == [*edits, SECOND]


def test_what_others_record_meanwhile_is_seen(tmp_path, read_only):
    folder = tmp_path / "subject"
    folder.mkdir()
    _written(folder / "annotations.sqlite")
    with ReviewLog.open(read_only(folder) / "annotations.sqlite") as log:
        assert log.revision() == 1
        with ReviewLog.open(folder / "annotations.sqlite") as other:
            other.append("walk", SECOND, "ben")
            assert [edit.event for edit in log.reading(after=1).edits] == [SECOND]
        assert [edit.event for edit in log.history()] == [FIRST, SECOND]


def test_a_log_of_another_kind_is_refused_by_name_there_too(tmp_path, read_only):
    folder = tmp_path / "subject"
    folder.mkdir()
    (folder / "annotations.sqlite").write_text("these are no pages of a database, " * 99)
    with pytest.raises(ReviewError, match=r"annotations\.sqlite: .*file is not a database"):
        ReviewLog.open(read_only(folder) / "annotations.sqlite")
