"""`record`, `recover` and `restore` on the command line."""

import shutil

import numpy as np
import pytest
from mcap.reader import make_reader

from addb_viewer.jobs.review_store import has_log, open_log
from annotations.events import FlagRange
from solver.capture.capture import Capture, Markers


def topics(file):
    with file.open("rb") as stream:
        return {channel.topic for channel in make_reader(stream).get_summary().channels.values()}


def test_record_writes_what_is_asked_for_and_says_where(command_line, tmp_path):
    folder = command_line.subject.folder
    done = command_line("record", folder, "--rrd", tmp_path / "a.rrd", "--mcap", tmp_path / "a.mcap")
    assert done.exit_code == 0, done.output
    assert done.output.splitlines() == [str(tmp_path / "a.mcap"), str(tmp_path / "a.rrd")]
    assert (tmp_path / "a.rrd").stat().st_size > 1000
    assert {"/walk/markers", "/no%2fforces/markers", "/walk/residual"} <= topics(tmp_path / "a.mcap")
    assert command_line.solves == [None], "there was no current fit"


def test_one_trial_of_a_fit_that_is_current_is_recorded_without_a_solve(command_line, tmp_path):
    folder = command_line.subject.folder
    command_line("fit", folder)
    done = command_line("record", folder, "--mcap", tmp_path / "a.mcap", "--trial", "walk")
    assert done.exit_code == 0, done.output
    assert len(command_line.solves) == 1
    assert not any(topic.startswith("/no") for topic in topics(tmp_path / "a.mcap"))


def test_record_needs_somewhere_to_write_to(command_line):
    done = command_line("record", command_line.subject.folder)
    assert done.exit_code == 2
    assert "--mcap" in done.output


@pytest.mark.parametrize(
    ("options", "said"),
    [(("--trial", "wlak"), "walk"), (("--mcap", "missing/a.mcap"), "missing/a.mcap")],
)
def test_what_is_wrong_is_one_line(command_line, tmp_path, options, said):
    given = options if "--mcap" in options else (*options, "--mcap", tmp_path / "a.mcap")
    done = command_line("record", command_line.subject.folder, *given)
    assert done.exit_code == 1
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_cut_file_is_recovered_beside_it_and_never_over_another(command_line, tmp_path):
    command_line("record", command_line.subject.folder, "--mcap", tmp_path / "a.mcap")
    data = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "a.mcap").write_bytes(data[:-100])
    done = command_line("recover", tmp_path / "a.mcap")
    assert done.exit_code == 0, done.output
    assert "a.mcap: cut; " in done.output
    assert done.output.splitlines()[-1] == str(tmp_path / "a.recovered.mcap")
    assert "/walk/markers" in topics(tmp_path / "a.recovered.mcap")
    again = command_line("recover", tmp_path / "a.mcap")
    assert again.exit_code == 1
    assert "--out" in again.stderr


def test_edits_come_back_into_a_store_that_was_lost(command_line, tmp_path):
    folder = command_line.subject.folder
    with open_log(folder) as log:
        log.append("walk", FlagRange(1, 2, "forceDiscrepancy"), "anna")
    command_line("record", folder, "--mcap", tmp_path / "a.mcap")
    for file in folder.glob("annotations.sqlite*"):
        file.unlink()
    done = command_line("restore", tmp_path / "a.mcap", folder)
    assert done.exit_code == 0, done.output
    assert done.output == "edits restored: 1; there already: 0\n"
    with open_log(folder) as log:
        (edit,) = log.history()
    assert (edit.author, edit.event) == ("anna", FlagRange(1, 2, "forceDiscrepancy"))
    again = command_line("restore", tmp_path / "a.mcap", folder)
    assert again.output == "edits restored: 0; there already: 1\n"


def test_edits_of_trials_that_the_subject_lacks_are_refused(command_line, tmp_path):
    folder = command_line.subject.folder
    with open_log(folder) as log:
        log.append("jump", FlagRange(1, 2, "forceDiscrepancy"), "anna")
    command_line("record", folder, "--mcap", tmp_path / "a.mcap")
    done = command_line("restore", tmp_path / "a.mcap", folder)
    assert done.exit_code == 1
    assert "no trial 'jump'" in done.stderr


def test_edits_of_another_subject_or_a_longer_recording_are_refused(command_line, tmp_path, monkeypatch):
    folder, file = command_line.subject.folder, tmp_path / "a.mcap"
    with open_log(folder) as log:
        log.append("walk", FlagRange(1, 4, "forceDiscrepancy"), "anna")
    command_line("record", folder, "--mcap", file)
    others = tmp_path / "another person"
    shutil.copytree(folder, others, ignore=shutil.ignore_patterns("annotations.sqlite*"))
    done = command_line("restore", file, others)
    assert done.exit_code == 1
    assert "are of the subject 'Zoë Ørsted', and this one is 'another person'" in done.stderr
    markers = Markers(("ASIS", "PSIS"), np.arange(18.0).reshape(3, 2, 3) % 2, 100.0)
    monkeypatch.setattr("addb_viewer.commands.recover.capture_of", lambda *_: Capture("walk", markers))
    done = command_line("restore", file, folder)
    assert done.exit_code == 1
    assert "edit 1 is about 4 frames of walk, which has 3 here" in done.stderr
    assert not has_log(others)


def test_a_file_without_edits_says_so(command_line, tmp_path):
    command_line("record", command_line.subject.folder, "--mcap", tmp_path / "a.mcap")
    done = command_line("restore", tmp_path / "a.mcap", command_line.subject.folder)
    assert done.exit_code == 1
    assert "holds no edits" in done.stderr
