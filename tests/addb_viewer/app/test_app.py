"""From a folder on the disk to the app, without a browser."""

import json
import time

import numpy as np
import pytest

from addb_viewer.app import app as app_module
from addb_viewer.app.app import serve, start
from addb_viewer.app.server import open_server
from solver.capture.capture import Markers
from solver.capture.trc import write_trc
from solver.errors import SolverError


@pytest.fixture
def subject(tmp_path):
    """Two trials of someone with four markers; nothing fitted."""
    folder = tmp_path / "Zoë Ørsted"
    folder.mkdir()
    (folder / "_subject.json").write_text(json.dumps({"massKg": 70, "heightM": "1.8"}))
    corners = np.array([[0, 0.1, 0], [0, 1.0, 0.2], [0.2, 1.7, 0], [0.1, 1.0, -0.2]])
    positions = np.repeat(corners[None], 50, axis=0) + np.linspace(0, 1, 50)[:, None, None] * [1.0, 0, 0]
    for name in ("first", "second"):
        (folder / "trials" / name).mkdir(parents=True)
        write_trc(folder / "trials" / name / "markers.trc", Markers(("A", "B", "C", "D"), positions, 100.0))
    return folder


@pytest.fixture
def opened():
    apps = []
    yield apps.append
    for app in apps:
        app.close()


def test_a_subject_without_a_fit_opens(subject, opened):
    app = start(subject, port=0)
    opened(app)
    assert app.shown == "first"
    assert app.library.trials == ("first", "second")
    assert app.replay.bodies is None
    assert "70.0 kg" in app.controls.summary.content
    assert "Not fitted yet" in app.controls.notes.content
    assert not app.notices.waiting


def test_a_broken_trial_is_told_and_the_next_one_opens(subject, opened):
    (subject / "trials" / "first" / "markers.trc").write_text("PathFileType\t4\n")
    app = start(subject, port=0)
    opened(app)
    assert app.shown == "second"
    ((title, body),) = app.notices.waiting
    assert title == "Opening first failed"
    assert "markers.trc" in body


def test_half_a_fit_is_one_clear_error(subject):
    (subject / "results").mkdir()
    (subject / "results" / "fit.json").write_text('{"format": 1, "solve": "solve-9"}')
    with pytest.raises(SolverError):
        start(subject, port=0)


def test_nothing_is_written_into_the_subjects_folder(subject, opened):
    before = sorted(subject.rglob("*"))
    opened(start(subject, port=0))
    assert sorted(subject.rglob("*")) == before


def test_drawing_survives_its_own_errors(subject, opened, monkeypatch):
    app = start(subject, port=0)
    opened(app)
    monkeypatch.setattr(app.scene, "draw", lambda frame: 1 / 0)
    app.playback.seek(3)
    end = time.monotonic() + 5
    while not app.notices.waiting and time.monotonic() < end:
        time.sleep(0.02)
    assert app.notices.waiting[0] == ("Drawing failed", "division by zero")
    monkeypatch.undo()
    app.playback.seek(7)
    while app.controls.frame.value != 7 and time.monotonic() < end:
        time.sleep(0.02)
    assert app.controls.frame.value == 7


def test_serving_prints_the_real_address_and_ends_with_ctrl_c(subject, capsys, monkeypatch):
    monkeypatch.setattr(app_module, "_has_display", lambda: False)

    def ctrl_c():
        raise KeyboardInterrupt

    monkeypatch.setattr(app_module, "_until_interrupted", ctrl_c)
    other = open_server(port=0)
    try:
        serve(subject, port=other.get_port())
    finally:
        other.stop()
    printed = capsys.readouterr().out
    assert f"Port {other.get_port()} is taken. " in printed
    assert "http://127.0.0.1:" in printed
    assert f"http://127.0.0.1:{other.get_port()} " not in printed
