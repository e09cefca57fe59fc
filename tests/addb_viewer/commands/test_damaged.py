"""Folders as people have them: files that are damaged, not used, of several people, or not readable."""

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from addb_viewer.app.subjects.library import library_of
from addb_viewer.commands.cli import app
from addb_viewer.jobs.review_store import open_log
from addb_viewer.jobs.root_folder import open_root
from annotations.events import FlagRange, SetActivity, Undo
from annotations.work import Comment
from solver.capture.capture import Markers
from solver.capture.formats.storage import write_storage
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.subject.opened_subject import SharedFolderError, open_subject, subjects_in
from solver.capture.trial import read_trial
from solver.fitting.provenance import provenance_of
from solver.fitting.settings import as_dict
from tests.addb_viewer.shell import run

TOML = """mass_kg = 72.6
height_m = 1.8
tags = ["healthy"]
[trials.walk]
markers = "walk.trc"
forces = "walk_grf.mot"
review = ["review.json"]
up = "y"
[trials.walk.plates.ground_force]
reads = "person"
[release]
source = "S"
licence = "CC-BY-4.0"
consent = "public"
"""
COMMANDS = (
    ("fit", "SUBJECT"),
    ("flags", "SUBJECT"),
    ("flag", "SUBJECT", "walk", "1:3", "--reason", "other", "--author", "me"),
    ("report", "SUBJECT"),
    ("export", "SUBJECT", "--to", "csv"),
    ("init", "SUBJECT/.."),
    ("markers", "SUBJECT"),
    ("undo", "SUBJECT", "walk", "--author", "me"),
    ("settings", "SUBJECT"),
    ("convert", "SUBJECT/walk.trc", "SUBJECT/converted.csv"),
    ("convert", "SUBJECT/walk_grf.mot", "SUBJECT/converted.sto"),
)
OF_FILE = {  # which commands read it
    "subject.toml": (0, 1, 5, 6),
    "settings.toml": (0, 3, 8),
    "markers.toml": (0, 6),
    "_subject.json": (0, 1, 5),
    "review.json": (0, 2),
    "annotations.sqlite": (0, 1, 2, 3, 7),
    "walk.trc": (0, 6, 9),
    "walk_grf.mot": (0, 10),
    "results/fit.json": (4, 3, 0),
    "results/solve-1/skeleton.json": (4, 3, 0),
    "results/solve-1/subject.json": (4, 3, 0),
    "results/solve-1/trials/walk.npz": (4, 3, 0),
}


@pytest.fixture
def whole(small_fit, tmp_path, monkeypatch) -> Path:
    """A subject with all its small files, fitted by hand."""
    folder = tmp_path / "whole"
    folder.mkdir()
    positions = np.random.default_rng(0).uniform(0, 1.5, (4, 2, 3))
    write_trc(folder / "walk.trc", Markers(("ASIS", "PSIS"), positions, 100.0, 0.25))
    columns = [f"ground_force_{kind}{axis}" for kind in "vp" for axis in "xyz"]
    columns += [f"ground_torque_{axis}" for axis in "xyz"]
    rows = np.tile([0.0, 700.0, 0.0, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0], (40, 1))
    write_storage(folder / "walk_grf.mot", columns, 0.25 + np.arange(40) / 1000, rows)
    (folder / "subject.toml").write_text(TOML)
    (folder / "settings.toml").write_text("[kinematics]\niterations = 30\n[cleaning]\nspike_m = 0.3\n")
    (folder / "markers.toml").write_text('[markers]\nASIS = "asis_r"\n')
    (folder / "_subject.json").write_text('{"massKg": "70", "sex": "female", "subjectTags": ["x"]}')
    (folder / "review.json").write_text('{"missing_grf_data": [false, true, false, false]}')
    with open_log(folder) as log:
        first = log.append("walk", FlagRange(1, 2, "forceDiscrepancy", note="x"), "anna")
        log.append("walk", SetActivity(0, 3, "walk"), "ben")
        log.append("walk", Undo(first), "anna")
        log.work.append(["walk"], Comment("look", 2), "ben")

    def solve(subject, settings, *, trials=None, reviews=None, extension=None, **_):
        files = [one for one in subject.trials if trials is None or one.name in trials]
        fitted = [replace(small_fit.trials[0], capture=read_trial(one, settings.reading)) for one in files]
        made_from = provenance_of(subject, files, reviews, extension)
        members = {"trials": tuple(fitted), "settings": as_dict(settings), "provenance": made_from}
        return replace(small_fit, subject=subject, **members)

    monkeypatch.setattr("addb_viewer.jobs.solving.solve", solve)
    ran = CliRunner().invoke(app, ["fit", str(folder)])
    assert ran.exit_code == 0, ran.output
    return folder


PIECES = (
    b"\0",
    b"\xff",
    b"null",
    b"-1",
    b"1e999",
    b"NaN",
    b"[",
    b"}",
    b'"',
    b"\n",
    b"true",
    b'"\\ud800"',
    b"9" * 30,
)
VALUES = (None, True, -1, 1e300, 10**30, "", "x\0", "\ud800", "../../x", [], {}, [[None]], {"type": "Body"})


def bytes_changed(data: bytes, draw: st.DataObject) -> bytes:
    """Cut, or with some bytes in place of others."""
    at = draw.draw(st.integers(0, len(data)), "at")
    instead = draw.draw(
        st.one_of(st.none(), st.sampled_from(PIECES), st.binary(min_size=1, max_size=4)), "instead"
    )
    removed = draw.draw(st.integers(0, 6), "removed")
    return data[:at] if instead is None else data[:at] + instead + data[at + removed :]


def value_changed(data: bytes, draw: st.DataObject) -> bytes:
    """JSON in which one value, however deep, is another or gone."""
    tree = json.loads(data)
    place, parents = tree, []
    while isinstance(place, dict | list) and place:
        key = draw.draw(
            st.sampled_from(sorted(place) if isinstance(place, dict) else range(len(place))), "key"
        )
        parents.append((place, key))
        place = place[key]
    holder, key = parents[draw.draw(st.integers(0, len(parents) - 1), "depth")]
    if draw.draw(st.booleans(), "gone"):
        del holder[key]
    else:
        holder[key] = draw.draw(st.sampled_from(VALUES), "value")
    return json.dumps(tree).encode()


def damaged(file: Path, draw: st.DataObject) -> None:
    """Change bytes of a file, or a value where it is JSON."""
    is_json = file.suffix == ".json" and draw.draw(st.booleans(), "as JSON")
    file.write_bytes((value_changed if is_json else bytes_changed)(file.read_bytes(), draw))


def said_in_a_line(folder: Path, command: int) -> str:
    """Run a command; it succeeds or says in a line why not."""
    words = [word.replace("SUBJECT", str(folder)) for word in COMMANDS[command]]
    ran = CliRunner().invoke(app, words)
    assert ran.exception is None or isinstance(ran.exception, SystemExit), (words, ran.exception)
    assert "--debug for the traceback" not in ran.stderr, (words, ran.stderr)
    if ran.exit_code:
        assert ran.stderr.strip(), words
    return ran.stderr


@settings(
    max_examples=int(os.environ.get("DAMAGES", "25")),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(draw=st.data())
def test_every_command_goes_on_or_says_why_not(whole, tmp_path, draw):
    name = draw.draw(st.sampled_from(sorted(OF_FILE)), "file")
    folder = tmp_path / "damaged"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(whole, folder)
    damaged(folder / name, draw)
    for command in OF_FILE[name]:
        said_in_a_line(folder, command)


NO_DYNAMICS = "[trajectory]\nenabled = false\n"


@pytest.fixture
def fitted(real_data, tmp_path):
    """A walk of opencap's subject 4, fitted beside a drop jump whose file is cut off inside a row."""
    markers = real_data / "opencap_subject4/MarkerData"
    shutil.copyfile(markers / "walking1.trc", tmp_path / "walk.trc")
    whole = (markers / "DJ1.trc").read_bytes()
    (tmp_path / "jump.trc").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "settings.toml").write_text(NO_DYNAMICS)
    return tmp_path, CliRunner().invoke(app, ["fit", str(tmp_path)])


def test_the_fit_is_kept_the_broken_trial_told_and_the_status_is_one(fitted):
    folder, done = fitted
    assert done.exit_code == 1
    assert "jump.trc: line" in done.stderr
    assert "fitted without 1 of 2 trials" in done.stderr
    figures = json.loads((folder / "results/fit.json").read_text())
    assert [trial["name"] for trial in figures["trials"]] == ["walk"]
    assert figures["unused"][0]["file"] == "jump.trc"
    left_out = "jump: left out, jump.trc cannot be used: line"
    assert any(note["text"].startswith(left_out) for note in figures["notes"])
    assert "1 file of the folder not used: jump.trc" in done.stdout
    notes = library_of(open_subject(folder)).notes
    assert any(note.startswith("Not used: jump.trc: line") for note in notes)

    again = CliRunner().invoke(app, ["fit", str(folder)])
    assert "unchanged: kept fit" in again.stdout
    assert again.exit_code == 1
    assert "fitted without 1 of 2 trials" in again.stderr


FILES = {
    "walk.trc": "opencap_subject4/MarkerData/walking1.trc",
    "walk_grf.mot": "opencap_subject4/ForceData/walking1_grf.mot",
    "jump plates.mot": "opencap_subject4/ForceData/DJ1_grf.mot",
    "walk_ik.mot": "opencap_subject4/reference/walking1_ik.mot",
}


@pytest.fixture
def folder(real_data, tmp_path):
    place = tmp_path / "Zoë"
    place.mkdir()
    for name, source in FILES.items():
        shutil.copyfile(real_data / source, place / name)
    (place / "notes.xlsx").write_text("x")
    (place / "settings.toml").write_text("[trajectory]\nenabled = false\n")
    return place


def test_fit_counts_them_names_the_worst_and_lists_all_when_asked(folder):
    run = CliRunner().invoke(app, ["fit", str(folder)])
    assert run.exit_code == 0, run.output
    (line,) = [line for line in run.stdout.splitlines() if "not used" in line]
    assert (
        line == "3 files of the folder not used: jump plates.mot, walk_ik.mot, notes.xlsx; --notes says why"
    )
    kept = json.loads((folder / "results" / "fit.json").read_text(encoding="utf-8"))["unused"]
    assert [file["file"] for file in kept] == ["jump plates.mot", "walk_ik.mot", "notes.xlsx"]
    assert all(file["reason"] for file in kept)

    (folder / "found later.csv").write_text("x")  # the kept fit stands; what is said is of now
    again = CliRunner().invoke(app, ["fit", str(folder), "--notes"])
    assert "unchanged: kept fit" in again.stdout
    assert "4 files of the folder not used:\n" in again.stdout
    assert "  walk_ik.mot: no columns of ground forces" in again.stdout
    assert "  found later.csv: text of a kind that is not read here" in again.stdout

    told = [note for note in library_of(open_subject(folder)).notes if note.startswith("Not used: ")]
    assert [note.split(": ")[1] for note in told] == [
        "jump plates.mot",
        "walk_ik.mot",
        "found later.csv",
        "notes.xlsx",
    ]


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
    done = run("fit", folder)
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
    assert run("fit", tmp_path).exit_code == 1
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
