"""Replays and diagnoses made by hand, without any solver; and the app in a browser."""

import shutil
import time
from weakref import WeakSet

import numpy as np
import pytest
import trimesh

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.app import start as start_app
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import Library
from addb_viewer.jobs.review_store import open_log
from addb_viewer.jobs.solving import job_for, solved
from addb_viewer.trial_view.trial_curves import TrialCurves
from solver.capture.capture import Capture, Markers, Subject, TrialFiles
from solver.simulate.demo_subject import write_demo_subject
from tests.addb_viewer.app.paper_browser import PaperBrowser, let_finish
from tests.addb_viewer.app.ten_trials import NO_HELD_OUT
from tests.addb_viewer.chromium import remembering
from tests.patience import PATIENCE_MS, PATIENCE_S

FEET = ("calcn_r", "calcn_l")
EVAL_PROBE = "Evaluating a string as JavaScript"  # by viser's sorter of splats, which the app does not draw
SOFTWARE_RENDERED = """() => {
    const gl = document.createElement("canvas").getContext("webgl2");
    const names = gl.getExtension("WEBGL_debug_renderer_info");
    return /swiftshader|llvmpipe|softpipe|software/i.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL));
}"""


class HandMadeLibrary(Library):
    """A library that gives these replays."""

    def __init__(self, folder, replays):
        files = tuple(TrialFiles(replay.name, folder / f"{replay.name}.trc") for replay in replays)
        for file in files:
            file.markers.touch()
        super().__init__(Subject(folder, files), meshes={"pelvis": trimesh.creation.box((0.2, 0.2, 0.3))})
        self.replays = {replay.name: replay for replay in replays}
        self.broken, self.strides, self.recorded = {}, {}, {}

    @property
    def trials(self):
        return (*self.replays, *self.broken)

    def replay(self, name):
        if name in self.broken:
            raise self.broken[name]
        return self.replays[name]

    def is_fitted(self, name):
        return name in self.replays and self.replays[name].joints is not None

    def curves(self, name):
        replay = self.replays[name]
        return TrialCurves(name, replay.rate, replay.times, replay.joints, replay.residual.used)

    def gait(self, name):
        self.gaits[name] = self.strides.get(name)
        return self.gaits[name]

    def capture(self, name):
        replay = self.replays[name]
        markers = Markers(replay.markers.names, replay.markers.measured, replay.rate)
        return Capture(name, markers, files=self.recorded.get(name, ()))


@pytest.fixture(autouse=True)
def read_at_once(monkeypatch):
    """Nobody has to wait before a second T counts."""
    for pause in ("READ_S", "SEEN_S"):
        monkeypatch.setattr(f"addb_viewer.app.queue.queue_controller.{pause}", 0.0)


@pytest.fixture(scope="session")
def make_library():
    return HandMadeLibrary


@pytest.fixture(scope="session")
def make_app(make_library):
    """Makes an app on replays; closing is the test's."""

    def made(folder, replays, **options):
        return ReviewApp(open_server(port=0), TrialQueue.of(make_library(folder, replays)), **options)

    return made


@pytest.fixture
def folder(tmp_path):
    """The subject's of `app`."""
    return tmp_path


@pytest.fixture
def app(folder, make_replay, make_app):
    """Open on two walks."""
    app = make_app(folder, [make_replay(), make_replay("run", 180)], login="Zoë")
    yield app
    app.close()


def read_review(folder, trial):
    """Of a trial, as the store has it."""
    with open_log(folder) as log:
        return log.review(trial, FEET)


@pytest.fixture
def stored(folder):
    """Reads the review of the walk."""
    return lambda trial="walk": read_review(folder, trial)


@pytest.fixture
def page(open_page, app):
    """A page of the app, whose scripts went without an error."""
    page = open_page(app)
    yield page
    assert page.errors == []
    page.close()


@pytest.fixture
def enter():
    """Opens an app in a browser without a picture, which carries its session; left at the end."""
    browsers = []

    def entered(app, trial=True, name="Zoë", at=None):
        before = set(app.sessions)
        browser = PaperBrowser(app.server.get_port(), name=name, at=at and [".", at])
        browsers.append(browser)
        (client,) = browser.until(lambda: set(app.sessions) - before, "the session")
        browser.session = app.sessions[client]
        if trial:
            browser.until(lambda: browser.session.replay is not None, "the trial")
            browser.session.notices._hand.submit(lambda: None).result(PATIENCE_S)  # after all of the entrance
            browser.until(lambda: browser.verdict, "the verdict")
        return browser

    yield entered
    for browser in browsers:
        browser.close()


@pytest.fixture(scope="session")
def open_page(browser):
    """Opens an app in a page ready for clicks; errors of its scripts and refusals gather in `errors`."""

    def opened(app, size=(1280, 800), name="Zoë"):
        before = set(app.sessions)
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})  # a browser of its own
        page.set_default_timeout(PATIENCE_MS)
        if name is not None:
            page.add_init_script(remembering(name))
        page.errors = []
        page.on("pageerror", lambda error: EVAL_PROBE not in str(error) and page.errors.append(str(error)))
        page.on("console", lambda said: _is_error(said) and page.errors.append(said.text))
        page.goto(f"http://127.0.0.1:{app.server.get_port()}")
        page.wait_for_selector("#root canvas")
        if page.evaluate(SOFTWARE_RENDERED):  # viser's word on that lies over the scene until it is read
            said = page.get_by_role("alert").filter(has_text="Software WebGL")
            said.get_by_role("button").evaluate("(close) => close.click()")
        (client,) = _until(lambda: set(app.sessions) - before, "the session")
        page.session = app.sessions[client]
        _SESSIONS.add(page.session)
        _until(lambda: page.session.replay is not None, "the trial")
        _until(page.locator("#addb-place b").text_content, "the head")
        page.evaluate("new Promise((done) => window.addb.on('keys', () => done(true)))")
        return page

    return opened


def _is_error(said):
    return said.type == "error" and EVAL_PROBE not in said.text


@pytest.fixture(scope="session")
def fitted_squat(tmp_path_factory):
    """The demo's static trial and squat, fitted; to be copied."""
    folder = tmp_path_factory.mktemp("squat") / "demo"
    write_demo_subject(folder, np.random.default_rng(1), trials=("static", "squat"))
    (folder / "settings.toml").write_text(NO_HELD_OUT)
    solved(job_for(folder))
    return folder


@pytest.fixture
def walks_folder(two_walks, tmp_path):
    """The two walks, to be changed."""
    return shutil.copytree(two_walks, tmp_path / "walks")


@pytest.fixture
def walks_app(walks_folder):
    """Open on them."""
    app = start_app(walks_folder, port=0)
    yield app
    app.close()


@pytest.fixture
def walks_review(walks_folder):
    """Reads what the log says of one of them."""
    return lambda trial="part1": read_review(walks_folder, trial)


@pytest.fixture(scope="session")
def until():
    """Waits for a condition, and for the end of what brought it about."""
    return _until


_SESSIONS: WeakSet = WeakSet()  # of all pages that were opened


def _until(condition, what="the browser to follow"):
    end = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.02)
    for session in list(_SESSIONS):
        let_finish(session)
    return value
