"""Commands that have nothing to write beside a recording work where nothing can be written."""

import shutil

import pytest

from tests.addb_viewer.shell import run

WITHOUT_FORCES = "[trajectory]\nenabled = false\n"


@pytest.fixture
def reviewed(real_data, tmp_path):
    """A recording with two people's flags, and its fit in a folder of its own."""
    subject = tmp_path / "walk"
    shutil.copytree(real_data / "anomalies" / "tiziana2019_lencioni", subject)
    subject.chmod(0o755)
    (subject / "settings.toml").write_text(WITHOUT_FORCES)
    for author, frames in (("anna", "50:70"), ("ben", "60:80")):
        flagged = run(
            "flag", subject, "trial", frames, "--foot", "both", "--reason", "manualReview", "--author", author
        )
        assert flagged.exit_code == 0, flagged.output
    return subject


@pytest.mark.slow
@pytest.mark.parametrize("place", ["read-only", "full"])
def test_what_only_reads_works_where_nothing_can_be_written(reviewed, tmp_path, read_only, small_disk, place):
    if place == "full":
        shutil.copytree(reviewed, small_disk.folder / "walk")
    subject = small_disk.folder / "walk" if place == "full" else reviewed
    assert run("fit", subject).exit_code == 0
    if place == "full":
        small_disk.fill()
    else:
        subject = read_only(reviewed)
    reading = {
        ("fit", subject, "--notes"): "unchanged: kept fit",
        ("flags", subject): "60:80  both  manualReview  person (ben, edit 2)",
        ("agreement", subject, "anna", "ben"): "differ on 50:60, 70:80",
        ("detect", subject): "trial",
        ("markers", subject, "--no-write"): "label",
        ("report", subject, "--out", tmp_path / "report.html"): "report.html",
        ("record", subject, "--mcap", tmp_path / "walk.mcap"): "walk.mcap",
    }
    for command, said in reading.items():
        done = run(*command)
        assert (done.exit_code, done.stderr) == (0, ""), (command, done.output)
        assert said in done.output
    refused = run("report", subject)
    assert refused.exit_code == 1
    assert "report.html: cannot write here" in refused.stderr
    recording = run("undo", subject, "trial", "--author", "anna")
    assert recording.exit_code == 1
    assert "annotations.sqlite: nothing was recorded: it " in recording.stderr
