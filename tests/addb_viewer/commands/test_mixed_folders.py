"""Recordings of several people in one folder or file: told, and described as one subject each."""

import shutil
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.jobs.root_folder import open_root
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.subject.subject import SharedFolderError, open_subject, subjects_in
from solver.capture.trial import read_trial

FOUR, SIX = "opencap_subject4", "opencap_subject6"
SOURCES = {  # of whom, what, from where
    ("4", "walk", ".trc"): f"{FOUR}/MarkerData/walking1.trc",
    ("4", "walk", "_grf.mot"): f"{FOUR}/ForceData/walking1_grf.mot",
    ("4", "jump", ".trc"): f"{FOUR}/MarkerData/DJ1.trc",
    ("4", "jump", "_grf.mot"): f"{FOUR}/ForceData/DJ1_grf.mot",
    ("4", "static", ".trc"): f"{FOUR}/MarkerData/static1.trc",
    ("6", "walk", ".trc"): f"{SIX}/walking1.trc",
    ("6", "walk", "_grf.mot"): f"{SIX}/walking1_forces.mot",
    ("6", "static", ".trc"): f"{SIX}/static1.trc",
}
NAMES = {  # how a laboratory calls them, and the folders of the two
    "numbered": (lambda who, what: f"S0{who}_{what}", ("S04", "S06")),
    "numbered behind": (lambda who, what: f"{what}-sub0{who}", ("sub04", "sub06")),
    "by first name": (lambda who, what: f"{'anna' if who == '4' else 'bea'}_{what}", ("anna", "bea")),
    "silent": (lambda who, what: f"{what}{'7' if who == '4' else '9'}", ("person_1", "person_2")),
}
PLAYERS = "wild/two_players_one_c3d/tennis_serve_2players.c3d"


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(params=NAMES)
def mixed(request, real_data, tmp_path):
    """A folder of two people's files, how they are called, and what folders they should get."""
    called, folders = NAMES[request.param]
    for (who, what, ending), source in SOURCES.items():
        shutil.copyfile(real_data / source, tmp_path / f"{called(who, what)}{ending}")
    return tmp_path, called, folders


def test_a_mixture_is_described_as_one_subject_each_and_files_stay(mixed):
    folder, called, folders = mixed
    before = {path: path.read_bytes() for path in folder.iterdir()}
    done = run("init", folder)
    assert done.exit_code == 0, done.output
    assert done.stdout.count("two people") == 1
    assert {path: path.read_bytes() for path in before} == before
    by_static = {}
    for name in folders:
        subject = open_subject(folder / name)
        assert subject.static is not None
        by_static[subject.static.name] = {
            (trial.markers.name, trial.forces and trial.forces.name) for trial in subject.trials
        }

    def pair(who, what):
        return f"{called(who, what)}.trc", f"{called(who, what)}_grf.mot"

    assert by_static == {
        f"{called('4', 'static')}.trc": {pair("4", "walk"), pair("4", "jump")},
        f"{called('6', 'static')}.trc": {pair("6", "walk")},
    }


def test_then_the_folder_is_one_of_several_subjects(mixed):
    folder, _, folders = mixed
    assert run("init", folder).exit_code == 0
    with pytest.raises(SharedFolderError, match=f"those of {folders[0]}, {folders[1]}"):
        open_subject(folder)
    assert open_root(folder).names == folders
    assert open_root(folder / folders[0]).names == (".",)
    shutil.copyfile(next(folder.glob("*walk*.trc")), folder / "new.trc")
    subjects, notes = subjects_in(folder)
    assert len(subjects) == 2
    assert any("in no subject.toml: new.trc" in note for note in notes)


def test_a_fit_of_a_mixture_stops_and_says_how_to_go_on(mixed):
    folder, _, _ = mixed
    done = run("fit", folder, "--quick")
    assert done.exit_code == 1
    assert "two people" in done.stderr
    assert "addb-viewer init" in done.stderr
    assert not (folder / "results").exists()


def test_numbers_of_sessions_of_one_person_make_no_mixture(real_data, tmp_path):
    for name in ("walking1", "DJ1", "squats1"):
        for session in ("S1", "S2"):
            if (session, name) != ("S2", "squats1"):
                shutil.copyfile(
                    real_data / f"{FOUR}/MarkerData/{name}.trc", tmp_path / f"{session}_{name}.trc"
                )
    done = run("init", tmp_path)
    assert done.exit_code == 0, done.output
    assert "5 trials" in done.stdout
    assert (tmp_path / "subject.toml").is_file()


def test_each_person_of_one_file_is_named_and_can_be_taken(real_data, tmp_path):
    file = tmp_path / "serve.c3d"
    shutil.copyfile(real_data / PLAYERS, file)
    (trial,) = open_subject(tmp_path).trials
    notes = " ".join(read_trial(trial).notes)
    assert "2 people in one file: PlayerA (39 markers) is taken, PlayrB (39 markers" in notes
    assert 'prefix = "PlayrB"' in notes
    done = run("init", tmp_path)
    assert done.exit_code == 0, done.output
    places = {}
    for name in ("PlayerA", "PlayrB"):
        (trial,) = open_subject(tmp_path / name).trials
        assert trial.markers == file
        capture = read_trial(trial)
        assert capture.prefix == name
        places[name] = capture.markers.positions_ground[0, capture.markers.names.index("C7")]
    assert abs(places["PlayerA"] - places["PlayrB"]).max() > 1.0


def test_folders_of_kinds_of_trials_are_shared_by_the_people_in_each(real_data, tmp_path):
    for (who, what, ending), source in SOURCES.items():
        (tmp_path / what).mkdir(exist_ok=True)
        shutil.copyfile(real_data / source, tmp_path / what / f"S0{who}{ending}")
    (tmp_path / "jump").rename(tmp_path / "walk" / "more")
    done = run("init", tmp_path)
    assert done.exit_code == 0, done.output
    assert open_root(tmp_path).names == ("S04", "S06")
    for name in ("S04", "S06"):
        subject = open_subject(tmp_path / name)
        assert subject.static == tmp_path / "static" / f"{name}.trc"
        assert all(trial.forces is not None for trial in subject.trials)
    assert len(open_subject(tmp_path / "S04").trials) == 2


def test_numbers_tell_people_apart_whose_labels_cannot_be_compared(real_data, tmp_path):
    shutil.copyfile(real_data / "walk_gait2354_subject01/subject01_walk1.trc", tmp_path / "P1_walk.trc")
    shutil.copyfile(real_data / f"{FOUR}/MarkerData/walking1.trc", tmp_path / "P2_walk.trc")
    assert run("fit", tmp_path, "--quick").exit_code == 1
    assert run("init", tmp_path).exit_code == 0
    assert open_root(tmp_path).names == ("P1", "P2")


def test_numbers_are_no_people_where_unknown_labels_keep_their_distances(real_data, tmp_path):
    for session, name in (("S1", "walking1"), ("S2", "DJ1")):
        markers = read_trc(real_data / f"{FOUR}/MarkerData/{name}.trc").markers
        unknown = tuple(f"Q{'xyzw'[k % 4]}{k}" for k in range(len(markers.names)))
        write_trc(tmp_path / f"{session}_{name}.trc", replace(markers, names=unknown))
    assert run("init", tmp_path).exit_code == 0
    assert (tmp_path / "subject.toml").is_file()


def test_a_model_called_after_a_person_is_theirs_and_what_nobody_uses_is_told(real_data, tmp_path):
    for (who, what, ending), source in SOURCES.items():
        shutil.copyfile(real_data / source, tmp_path / f"S0{who}_{what}{ending}")
    for name in ("S04_scaled.osim", "S06_scaled.osim"):
        shutil.copyfile(real_data / f"{FOUR}/unscaled_generic.osim", tmp_path / name)
    shutil.copyfile(real_data / f"{FOUR}/ForceData/squats1_grf.mot", tmp_path / "bench.mot")
    assert run("init", tmp_path).exit_code == 0
    for name in ("S04", "S06"):
        assert open_subject(tmp_path / name).model == tmp_path / f"{name}_scaled.osim"
        assert "# - ../bench.mot: forces" in (tmp_path / name / "subject.toml").read_text(encoding="utf-8")
