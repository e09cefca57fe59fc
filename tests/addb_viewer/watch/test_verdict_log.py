"""The log of verdicts: whatever is torn, repeated or claimed twice, each trial has one verdict."""

import os
from dataclasses import replace

import pytest

from addb_viewer.watch import verdict_log
from addb_viewer.watch.verdict_log import (
    ABANDONED_S,
    LOG,
    Colour,
    Stage,
    VerdictLine,
    append,
    claim,
    present,
    read_log,
)

FIRST = VerdictLine("walk", "a", Stage.FIRST, Colour.GREEN, "w", "t", "2026-11-29T10:00:00Z", 2.0)
VERDICT = replace(FIRST, stage=Stage.VERDICT, off_zero=("plate_1",), names=("plate_bias plate_1",))


def test_a_line_comes_back_as_it_was_and_is_said_once(tmp_path):
    assert read_log(tmp_path) == []
    assert append(tmp_path, FIRST)
    assert append(tmp_path, VERDICT)
    assert not append(tmp_path, replace(VERDICT, words="another watcher's"))
    assert not append(tmp_path, replace(FIRST, stage=Stage.FIT))  # its verdict is there
    assert read_log(tmp_path) == [FIRST, VERDICT]


def test_a_replaced_file_supersedes_and_the_former_verdict_stays(tmp_path):
    for line in (VERDICT, replace(VERDICT, files="b", words="new"), VERDICT):
        assert append(tmp_path, line)
    other = replace(VERDICT, trial="run")
    append(tmp_path, other)
    assert len(read_log(tmp_path)) == 4
    assert present(read_log(tmp_path)) == {"walk": VERDICT, "run": other}


def test_a_line_torn_anywhere_loses_itself_alone(tmp_path):
    append(tmp_path, FIRST)
    first = (tmp_path / LOG).read_bytes()
    append(tmp_path, VERDICT)
    whole = (tmp_path / LOG).read_bytes()
    for end in range(len(first) + 1, len(whole), 7):
        (tmp_path / LOG).write_bytes(whole[:end])
        assert read_log(tmp_path) == ([FIRST] if end < len(whole) - 1 else [FIRST, VERDICT])
        append(tmp_path, VERDICT)
        assert read_log(tmp_path) == [FIRST, VERDICT]


def test_lines_of_two_that_could_not_lock_count_once(tmp_path, monkeypatch):
    append(tmp_path, VERDICT)
    twice = (tmp_path / LOG).read_bytes() * 2
    (tmp_path / LOG).write_bytes(twice)
    assert read_log(tmp_path) == [VERDICT]


def test_one_of_two_gets_the_claim_until_it_is_released(tmp_path):
    mine = claim(tmp_path, "walk")
    assert claim(tmp_path, "walk") is None
    assert claim(tmp_path, "run") is not None
    mine.release()
    assert claim(tmp_path, "walk") is not None


@pytest.mark.parametrize(("share", "is_taken"), [(0.7, True), (1.4, False)])
def test_a_claim_that_is_not_renewed_is_anybodys(tmp_path, share, is_taken):
    mine = claim(tmp_path, "walk")
    at = mine.file.stat().st_mtime - share * ABANDONED_S
    os.utime(mine.file, (at, at))
    other = claim(tmp_path, "walk")
    assert (other is None) is is_taken
    if other is not None:
        mine.release()  # it is somebody else's by now
        assert claim(tmp_path, "walk") is None
    mine.renew()
    assert claim(tmp_path, "walk") is None


def test_a_claim_of_a_process_of_this_machine_that_is_dead_is_anybodys_at_once(tmp_path, monkeypatch):
    claim(tmp_path, "walk")
    monkeypatch.setattr(verdict_log.psutil, "pid_exists", lambda pid: False)
    assert claim(tmp_path, "walk") is not None


def test_claims_last_some_renewals_and_no_coffee_break():
    assert 10 <= ABANDONED_S <= 20
