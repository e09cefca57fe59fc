"""A watched folder: every trial gets one verdict, whatever happens meanwhile."""

import os
import time
from pathlib import Path

import pytest

from addb_viewer.watch import verdict_log
from addb_viewer.watch.verdict_log import Stage, claim, log_folder, read_log
from addb_viewer.watch.watching import FIT_ALONE_S, Session
from solver.common import disk_errors


class Watched:
    """A session with a clock of its own; what it says and complains of is kept."""

    def __init__(self, folder):
        self.now, self.said, self.complaints = 100.0, [], []
        say = lambda subject, line, own: self.said.append((subject, line.trial, line.stage, own))  # noqa: E731
        self.session = Session(folder, say=say, complain=self.complaints.append, clock=lambda: self.now)

    def live(self, seconds):
        for _ in range(round(4 * seconds)):
            self.now += 0.25
            self.session.news()
            self.session.tick()
            for one in self.session._judging:
                for future in filter(None, (one.first, one.fit, one.diagnosis)):
                    future.exception()
        return [(trial, stage) for _, trial, stage, _ in self.said]


@pytest.fixture
def watched(judges):
    return Watched


def stages(folder):
    return [(line.trial, line.stage.value) for line in read_log(log_folder(folder / "results"))]


BOTH = [("walk", "first"), ("walk", "verdict")]


def test_a_trial_is_judged_once_it_rests_and_never_again(tmp_path, put, watched, judges):
    one = watched(tmp_path)
    assert one.live(2) == []
    put(tmp_path / "S01", "walk")
    assert one.live(0.75) == []
    one.live(3)
    assert stages(tmp_path / "S01") == BOTH
    assert one.said[-1] == ("S01", "walk", "verdict", True)
    again = watched(tmp_path)  # as after a kill
    again.live(5)
    assert (stages(tmp_path / "S01"), again.said) == (BOTH, [])
    assert judges == [("first", "walk"), ("fit", "walk")]


def test_a_subject_that_comes_later_and_a_static_trial(tmp_path, put, recording, watched):
    one = watched(tmp_path)
    put(tmp_path / "S01", "walk")
    one.live(4)
    (tmp_path / "S02").mkdir()
    (tmp_path / "S02" / "static.trc").write_bytes(recording(moving=0.0)[0])
    one.live(6)
    put(tmp_path / "S02", "run")
    one.live(5)
    assert stages(tmp_path / "S02") == [("static", "static"), ("run", "first"), ("run", "verdict")]


def test_a_replaced_file_is_judged_again_also_while_it_is_being_judged(tmp_path, put, watched):
    one = watched(tmp_path)
    put(tmp_path / "S01", "walk")
    one.live(4)
    put(tmp_path / "S01", "walk", 1)
    one.live(4)
    put(tmp_path / "S01", "walk", 0)
    one.live(4)
    assert stages(tmp_path / "S01") == BOTH * 3
    lines = read_log(log_folder(tmp_path / "S01" / "results"))
    assert lines[1].files == lines[5].files != lines[3].files


def test_two_watchers_say_it_once_and_both_show_it(tmp_path, put, watched):
    one, other = watched(tmp_path), watched(tmp_path)
    put(tmp_path / "S01", "walk")
    for _ in range(6):
        one.live(1)
        other.live(1)
    assert stages(tmp_path / "S01") == BOTH
    assert [len(one.said), len(other.said)] == [2, 2]
    assert [own for _, _, _, own in one.said] == [not own for _, _, _, own in other.said]


def test_what_a_dead_watcher_had_claimed_is_judged_by_another(tmp_path, put, watched, monkeypatch):
    put(tmp_path / "S01", "walk")
    folder = log_folder(tmp_path / "S01" / "results")
    mine = claim(folder, "walk")
    one = watched(tmp_path)
    one.live(6)
    assert stages(tmp_path / "S01") == []
    os.utime(mine.file, (0, 0))  # it has not been renewed for long
    one.live(4)
    assert stages(tmp_path / "S01") == BOTH
    assert not list(folder.glob(".claim*"))


def test_a_trial_that_cannot_be_fitted_is_said_to_be_so(tmp_path, put, watched):
    one = watched(tmp_path)
    put(tmp_path / "S01", "bad")
    one.live(4)
    line = read_log(log_folder(tmp_path / "S01" / "results"))[-1]
    assert (line.stage, line.colour) == (Stage.VERDICT, "red")
    assert line.to_do == "Export it again, or repeat: no markers shared with the model"


def test_a_full_disk_is_told_once_and_tried_again(tmp_path, put, watched, small_disk):
    put(small_disk.folder / "S01", "walk")
    small_disk.fill()
    one = watched(small_disk.folder)
    one.live(8)
    assert len(one.complaints) == 1
    assert "No space left" in one.complaints[0]
    assert one.session.troubles
    small_disk.empty()
    one.live(5)
    assert stages(small_disk.folder / "S01") == BOTH
    assert not one.session.troubles


def test_a_disk_that_is_full_at_the_verdict_loses_nothing(tmp_path, put, watched, monkeypatch):
    def refused(log, line):
        Path(log).write_bytes(line[:20])  # as much as there is room for
        raise OSError(28, "No space left on device")

    put(tmp_path / "S01", "walk")
    one = watched(tmp_path)
    with monkeypatch.context() as full:
        full.setattr(verdict_log, "_write", refused)
        full.setattr(disk_errors, "free_space", lambda _: time.time_ns())
        one.live(6)
        assert (stages(tmp_path / "S01"), len(one.complaints)) == ([], 1)
    one.live(4)
    assert stages(tmp_path / "S01") == BOTH


def test_the_fit_speaks_alone_where_the_diagnosis_takes_long(tmp_path, put, watched, monkeypatch):
    one = watched(tmp_path)
    put(tmp_path / "S01", "walk")
    one.live(1.25)
    judging = one.session._judging[0]
    judging.diagnosis = type("Running", (), {"done": lambda _: False, "exception": lambda _: None})()
    one.live(0.8 * FIT_ALONE_S)
    assert stages(tmp_path / "S01") == BOTH[:1]
    one.live(0.5 * FIT_ALONE_S)
    assert stages(tmp_path / "S01") == [*BOTH[:1], ("walk", "fit")]


def test_what_cannot_be_opened_is_said_once_and_a_plan_is_counted(tmp_path, put, watched):
    put(tmp_path / "S01", "walk")
    (tmp_path / "S01" / "subject.toml").write_text("[plan]\njumps = 2\n")
    one = watched(tmp_path)
    one.live(9)
    assert len(one.complaints) == 1
    assert "plan.jumps = 2: nothing of that name can be counted" in one.complaints[0]
    (tmp_path / "S01" / "subject.toml").write_text("[plan]\nwalks = 2\n")
    one.live(5)
    assert one.session.plan_of("S01") == [("1 of 2 good walks", False)]
