"""`addb-viewer init`: what it writes is what was understood, and nothing is ever written over."""

import shutil
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.jobs.root_folder import open_root
from solver.capture.subject.subject import open_subject


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def bare(real_data, tmp_path):
    """Copies of real folders without their subject.toml."""

    def copied(*names):
        for name in names:
            shutil.copytree(
                real_data / name, tmp_path / "Labor Süd" / name, ignore=shutil.ignore_patterns("subject.toml")
            )
        return tmp_path / "Labor Süd"

    return copied


@pytest.mark.parametrize(
    "name",
    [
        "opencap_subject4",
        "opencap_reviewed",
        "exo_apo_gordon",
        "run_treadmill_hamner2013_subject04",
        "sprint_overground_dorn2012_JA1_9ms",
        "walk_rajagopal2015",
        "c3d_lab_trials/lasem_FAILT01",
    ],
)
def test_what_is_written_reads_as_what_was_understood(bare, name):
    folder = bare(name) / name
    understood = open_subject(folder)
    done = run("init", folder)
    assert done.exit_code == 0, done.output
    assert f"{len(understood.trials)} trial" in done.stdout
    text = (folder / "subject.toml").read_text(encoding="utf-8")
    for file in understood.unused:
        assert f"# - {file.file}: {file.reason}" in text
    described = open_subject(folder)
    told = {"notes": (), "unused": (), "other_statics": (), "is_described": True}
    assert replace(described, **told) == replace(understood, **told)
    assert {file.file for file in described.unused} == {file.file for file in understood.unused}


def test_an_existing_description_is_never_written_over(bare):
    folder = bare("opencap_subject6") / "opencap_subject6"
    (folder / "subject.toml").write_text("mass_kg = 59.0\n")
    done = run("init", folder)
    assert done.exit_code == 1
    assert "never written over" in done.stderr
    assert (folder / "subject.toml").read_text() == "mass_kg = 59.0\n"


def test_awkward_names_survive(bare, real_data):
    folder = bare("opencap_subject6") / "opencap_subject6"
    (folder / "walking1.trc").rename(folder / 'Gang "schnell" #1.trc')
    (folder / "walking1_forces.mot").rename(folder / 'Gang "schnell" #1_forces.mot')
    understood = open_subject(folder)
    assert run("init", folder).exit_code == 0
    assert open_subject(folder).trials == understood.trials


def test_recursive_describes_every_subject_that_the_app_opens(bare):
    root = bare("anomalies", "opencap_subject4", "opencap_subject6", "exo_apo_gordon", "models")
    shown = open_root(root).names
    assert set(shown) == {
        "anomalies/UpsideDownData",
        "anomalies/tiziana2019_lencioni",
        "exo_apo_gordon",
        "opencap_subject4",
        "opencap_subject6",
    }
    (root / "opencap_subject6" / "subject.toml").write_text("mass_kg = 59.0\n")
    done = run("init", "--recursive", root)
    assert done.exit_code == 0, done.output
    assert "opencap_subject6/subject.toml: there already" in done.stdout
    assert "models is left out" in done.stdout
    written = {
        path.parent.relative_to(root.resolve()).as_posix() for path in root.resolve().rglob("subject.toml")
    }
    assert written == set(shown)
    assert open_root(root).names == shown


def test_the_only_subject_in_a_folder_is_described_as_if_it_were_given(bare):
    root = bare("opencap_subject6")
    (root / "opencap_subject6").rename(root / "2012-10-17")
    done = run("init", root)
    assert done.exit_code == 0, done.output
    assert (root / "2012-10-17" / "subject.toml").is_file()
    assert not (root / "subject.toml").exists()


def test_of_several_subjects_all_are_named_and_none_is_described(bare):
    root = bare("opencap_subject4", "opencap_subject6")
    done = run("init", root)
    assert done.exit_code == 1
    assert (
        "2 subjects: opencap_subject4, opencap_subject6. Give one of them, or add --recursive" in done.stderr
    )
    assert not list(root.rglob("subject.toml"))


def test_a_trial_that_cannot_be_read_is_told_where_the_folder_is_described(bare):
    folder = bare("c3d_lab_trials/lasem_FAILT01") / "c3d_lab_trials/lasem_FAILT01"
    whole = folder / "FAILT01_Walk01.c3d"
    (folder / "cut.c3d").write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    done = run("init", folder)
    assert done.exit_code == 0, done.output
    assert "; cannot be read: cut" in done.stdout
    reason = "cut: a fit will leave it out: "
    assert reason in done.stdout
    assert reason in (folder / "subject.toml").read_text(encoding="utf-8")
    assert "cut off in frame" in done.stdout
