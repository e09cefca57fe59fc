"""`addb-viewer settings`: a TOML file to start from."""

import tomllib

from solver.fitting.settings import Settings, as_toml


def test_the_defaults(command_line):
    run = command_line("settings")
    assert run.exit_code == 0
    assert run.stdout == as_toml(Settings())
    assert tomllib.loads(run.stdout)["kinematics"]["iterations"] == Settings().kinematics.iterations


def test_a_subjects_own(command_line):
    (command_line.subject.folder / "settings.toml").write_text("[kinematics]\niterations = 3\n")
    run = command_line("settings", command_line.subject.folder)
    assert tomllib.loads(run.stdout)["kinematics"]["iterations"] == 3


def test_of_a_file_with_a_slip(command_line, tmp_path):
    (tmp_path / "mine.toml").write_text("[kinematik]\n")
    run = command_line("settings", "--settings", tmp_path / "mine.toml")
    assert run.exit_code == 1
    assert "nearest: kinematics" in run.stderr
