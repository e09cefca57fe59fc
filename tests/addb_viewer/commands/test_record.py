"""`record` on the command line."""

import pytest
from mcap.reader import make_reader


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
