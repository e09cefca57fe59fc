"""`addb-viewer export`: solves only where the kept fit is no longer that of the files."""

import pytest


@pytest.fixture
def exported(monkeypatch):
    """What reached the exporter: (fit, folder)."""
    calls = []

    def export_opensim(fit, folder):
        calls.append((fit, folder))
        return [folder / "model.osim"]

    monkeypatch.setattr("addb_viewer.commands.export.export_opensim", export_opensim)
    return calls


def test_without_a_fit_it_solves_keeps_and_exports(command_line, exported):
    folder = command_line.subject.folder
    run = command_line("export", folder, "--to", "opensim")
    assert run.exit_code == 0
    assert run.stdout == f"{folder / 'results' / 'opensim' / 'model.osim'}\n"
    assert (folder / "results" / "fit.json").is_file()
    assert exported[0][0].mass_kg == 100.0


def test_a_current_fit_is_not_solved_again(command_line, exported):
    folder = command_line.subject.folder
    command_line("fit", folder)
    command_line("export", folder, "--to", "opensim")
    assert len(command_line.solves) == 1
    assert len(exported) == 1


def test_edited_markers_settings_or_another_choice_of_trials_are_solved_again(command_line, exported):
    folder = command_line.subject.folder
    command_line("fit", folder)
    command_line.subject.trials[0].markers.write_text("edited")
    command_line("export", folder, "--to", "opensim")
    assert len(command_line.solves) == 2
    (folder / "settings.toml").write_text("[kinematics]\niterations = 3\n")
    command_line("export", folder, "--to", "opensim")
    assert len(command_line.solves) == 3
    command_line("export", folder, "--to", "opensim", "--trial", "walk")
    assert command_line.solves[3:] == [("walk",)]


def test_a_broken_fit_is_solved_again(command_line, exported):
    folder = command_line.subject.folder
    command_line("fit", folder)
    (folder / "results" / "solve-1" / "skeleton.json").write_text("{")
    assert command_line("export", folder, "--to", "opensim").exit_code == 0
    assert len(command_line.solves) == 2
