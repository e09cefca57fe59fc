"""rerun's program runs with its analytics off, whatever the user has set."""

import subprocess

from addb_viewer.recordings.rerun_program import rerun_command, rerun_environment


def test_its_analytics_are_off_and_it_greets_nobody(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "user"))
    own = tmp_path / "own"
    own.mkdir()
    done = subprocess.run(
        [*rerun_command(), "analytics", "config"],
        env=rerun_environment(own), capture_output=True, text=True, check=False,
    )  # fmt: skip
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    assert "analytics_enabled: false" in said or '"analytics_enabled":false' in said.replace(" ", "")
    assert "Welcome to Rerun" not in said
    assert not (tmp_path / "user").exists()
