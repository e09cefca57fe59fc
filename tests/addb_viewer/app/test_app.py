"""From a folder on the disk to the app, without a picture."""

import json

import numpy as np
import pytest

from addb_viewer.app import app as app_module
from addb_viewer.app.app import serve, start
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import library_of
from addb_viewer.jobs.root_folder import open_root
from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from solver.common.errors import CaptureError, SolverError
from solver.fitting.results.store import save_fit


def write_subject(folder):
    """Two trials of someone with four markers; nothing fitted."""
    folder.mkdir()
    (folder / "_subject.json").write_text(json.dumps({"massKg": 70, "heightM": "1.8"}))
    corners = np.array([[0, 0.1, 0], [0, 1.0, 0.2], [0.2, 1.7, 0], [0.1, 1.0, -0.2]])
    positions = np.repeat(corners[None], 50, axis=0) + np.linspace(0, 1, 50)[:, None, None] * [1.0, 0, 0]
    for name in ("first", "second"):
        (folder / "trials" / name).mkdir(parents=True)
        write_trc(folder / "trials" / name / "markers.trc", Markers(("A", "B", "C", "D"), positions, 100.0))
    return folder


@pytest.fixture
def subject(tmp_path):
    return write_subject(tmp_path / "Zoë Ørsted")


@pytest.fixture
def opened():
    apps = []

    def open_(*arguments, **options):
        apps.append(start(*arguments, port=0, **options))
        return apps[-1]

    yield open_
    for app in apps:
        app.close()


def test_a_subject_without_a_fit_opens(subject, opened, enter):
    browser = enter(opened(subject))
    session = browser.session
    assert session.shown == "first"
    assert session.shared.fits.shown.trials == ("first", "second")
    assert session.replay.bodies is None
    browser.until(lambda: "70.0 kg" in browser.html())
    browser.until(lambda: "Not fitted yet" in browser.html())
    assert not browser.notices


def test_a_broken_trial_is_told_and_the_next_one_opens(subject, opened, enter):
    (subject / "trials" / "first" / "markers.trc").write_text("PathFileType\t4\n")
    browser = enter(opened(subject))
    assert browser.session.shown == "second"
    browser.until(lambda: browser.told("Opening first failed"))
    browser.until(lambda: browser.told("markers.trc"))


def test_half_a_fit_is_one_clear_error(subject):
    (subject / "results").mkdir()
    (subject / "results" / "fit.json").write_text('{"format": 1, "solve": "solve-9"}')
    with pytest.raises(SolverError):
        start(subject, port=0)


def test_nothing_is_written_into_the_subjects_folder(subject, opened, enter):
    before = sorted(subject.rglob("*"))
    browser = enter(opened(subject))
    browser.press("One frame on")
    browser.until(lambda: browser.session.frame == 1)
    assert sorted(subject.rglob("*")) == before


def test_a_root_shows_the_queue_of_all_subjects_and_goes_from_one_to_the_next(tmp_path, opened, enter):
    for name in ("A", "B"):
        write_subject(tmp_path / name)
    browser = enter(opened(tmp_path))
    browser.until(lambda: browser.bar["of"] == "1 of 4")
    assert (browser.session.shared.name, browser.session.shown) == ("A", "first")
    for name in ("first", "second"):
        browser.until(lambda name=name: browser.session.shown == name)
        browser.finish("Nothing has been fitted to this trial yet")
    browser.until(lambda: browser.session.shared.name == "B" and browser.session.shown == "first")
    browser.press("Choose a trial")
    browser.until(lambda: browser.asked("2 of 4 trials are finished"))
    assert (tmp_path / "A" / "annotations.sqlite").exists()
    assert not (tmp_path / "B" / "annotations.sqlite").exists()


def test_rooms_that_nobody_is_in_are_closed_but_for_the_last(tmp_path, opened, enter):
    for name in "ABCD":
        write_subject(tmp_path / name)
    app = opened(tmp_path)
    browser = enter(app)
    for name in "BCDAB":
        browser.session.notices.do("Opening", lambda name=name: browser.session.open(name, "second"))
    browser.until(lambda: browser.session.shared.name == "B" and browser.session.shown == "second")
    browser.until(lambda: len(app.subjects.loaded) == 2)


def test_a_subject_that_breaks_is_told_and_the_present_one_stays(tmp_path, opened, enter):
    for name in "AB":
        write_subject(tmp_path / name)
    browser = enter(opened(tmp_path))
    (tmp_path / "B" / "_subject.json").write_text("{")
    browser.session.notices.do("Opening", lambda: browser.session.open("B", "first"))
    browser.until(lambda: browser.told("_subject.json"))
    assert browser.session.shared.name == "A"


def test_files_outside_the_root_are_refused(tmp_path):
    write_subject(tmp_path / "outside")
    (tmp_path / "root").mkdir()
    inside = write_subject(tmp_path / "root" / "S1")
    (inside / "trials" / "first" / "markers.trc").unlink()
    (inside / "trials" / "first" / "markers.trc").symlink_to(
        tmp_path / "outside" / "trials" / "first" / "markers.trc"
    )
    with pytest.raises(CaptureError, match="leads out of"):
        start(inside, port=0)
    (tmp_path / "root" / "linked").symlink_to(tmp_path / "outside")
    write_subject(tmp_path / "root" / "S2")
    app = start(tmp_path / "root", port=0)
    try:
        assert app.subjects.root.names == ("S2",)
        for name in ("..", "../outside", "linked", "S1", "/etc"):
            with pytest.raises(CaptureError, match="has no subject"):
                app.subjects.subject(name)
    finally:
        app.close()


@pytest.mark.parametrize(
    "place",
    [
        "results",
        "results/recordings",
        "results/recordings/notes.html",
        "results/solves/3",
        "results/diagnosis.json",
        "results/solve-1/trials/first.npz",
        "annotations.sqlite",
        "settings.toml",
        "markers.toml",
        "Geometry",
        "trials/first/notes.txt",
        "trials/third",
    ],
)
def test_a_subject_with_a_link_out_of_the_folder_is_refused(tmp_path, place):
    (tmp_path / "outside").mkdir()
    inside = write_subject(tmp_path / "S1")
    (inside / place).parent.mkdir(parents=True, exist_ok=True)
    (inside / place).symlink_to(tmp_path / "outside")
    with pytest.raises(CaptureError, match=f"{place}: leads out of"):
        start(inside, port=0)


def test_links_within_the_opened_folder_are_followed(tmp_path, opened, enter):
    root = tmp_path / "root"
    root.mkdir()
    for name in ("A", "B"):
        write_subject(root / name)
    (root / "disk").mkdir()
    (root / "A" / "results").symlink_to(root / "disk")
    (root / "B" / "trials" / "first" / "itself").symlink_to("itself")
    app = opened(root)
    assert app.subjects.root.names == ("A", "B")


def test_a_results_folder_elsewhere_is_read_where_the_user_names_it(tmp_path, opened, enter):
    (tmp_path / "elsewhere").mkdir()
    app = opened(write_subject(tmp_path / "S1"), results=tmp_path / "elsewhere")
    assert enter(app).session.shown == "first"


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


def test_on_the_network_the_printed_address_holds_the_token_and_nobody_is_anybody(subject, opened):
    app = opened(subject, host="0.0.0.0")
    assert app.access.token
    assert app._login == ""


@pytest.mark.parametrize("place", ["../outside.osim", "/etc/passwd"])
def test_a_fit_made_of_files_elsewhere_is_refused(small_fit, place):
    folder = small_fit.subject.folder
    save_fit(small_fit, folder / "results")
    library_of(small_fit.subject)
    (about,) = (folder / "results").glob("solve-*/subject.json")
    content = json.loads(about.read_text())
    content["subject"]["fields"]["model"] = {"path": place}
    about.write_text(json.dumps(content))
    head = json.loads((folder / "results" / "fit.json").read_text())
    (folder / "results" / "fit.json").write_text(json.dumps({**head, "sha256": {}}))
    with pytest.raises(CaptureError, match="outside the folder"):
        library_of(small_fit.subject)


def test_nothing_is_read_of_a_subject_before_its_links_are_looked_at(tmp_path):
    """A description that leads out of the root: an error in it would tell what stands there."""
    outside = tmp_path / "outside.toml"
    outside.write_text('mass_kg = "a secret"')
    root = tmp_path / "root"
    for name in ("S1", "S2"):
        (root / name).mkdir(parents=True)
        (root / name / "walk.trc").write_text("markers")
    (root / "S1/subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
    (root / "S2/subject.toml").symlink_to(outside)
    opened = open_root(root)
    assert opened.names == ("S1",)
    assert "leads out of" in opened.notes[0]
    assert "secret" not in opened.notes[0]
    with pytest.raises(CaptureError, match="leads out of") as refused:
        open_root(root / "S2")
    assert "secret" not in str(refused.value)
