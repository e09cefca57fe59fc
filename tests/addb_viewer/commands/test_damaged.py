"""Small files of a subject, damaged at random: every command goes on or says why not, in a line."""

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

from addb_viewer.commands.cli import app
from addb_viewer.jobs.review_store import open_log
from annotations.events import FlagRange, SetActivity, Undo
from annotations.work import Comment
from solver.capture.capture import Markers
from solver.capture.formats.storage import write_storage
from solver.capture.formats.trc import write_trc
from solver.capture.trial import read_trial
from solver.fitting.provenance import provenance_of
from solver.fitting.settings import as_dict

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
    (folder / "settings.toml").write_text("[kinematics]\niterations = 30\n[cleaning]\nfarthest_m = 900.0\n")
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
