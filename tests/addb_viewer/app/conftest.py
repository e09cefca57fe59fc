"""Replays and diagnoses made by hand, without any solver; and the app in a browser."""

import shutil
import time

import numpy as np
import pytest
import trimesh

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.app import start as start_app
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import Library
from addb_viewer.jobs.review_store import open_log
from addb_viewer.trial_view.replay import (
    BodyReplay,
    ForceUse,
    JointReplay,
    MarkerReplay,
    PlateReplay,
    Replay,
    ResidualReplay,
)
from addb_viewer.trial_view.trial_curves import TrialCurves
from solver.capture.capture import Capture, Markers, Subject, TrialFiles
from solver.contact.contact_phases import ContactPhase
from solver.contact.proposals import Proposal
from tests.addb_viewer.app.paper_browser import PaperBrowser
from tests.addb_viewer.app.ten_trials import write_ten_trials, write_trials
from tests.addb_viewer.chromium import remembering
from tests.addb_viewer.made_up_residual import residual, size, trial
from tests.patience import PATIENCE_MS, PATIENCE_S

EVAL_PROBE = "Evaluating a string as JavaScript"  # by viser's sorter of splats, which the app does not draw
SOFTWARE_RENDERED = """() => {
    const gl = document.createElement("canvas").getContext("webgl2");
    const names = gl.getExtension("WEBGL_debug_renderer_info");
    return /swiftshader|llvmpipe|softpipe|software/i.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL));
}"""


@pytest.fixture(scope="session")
def make_replay():
    return _replay


def _replay(name="walk", frames=200, rate=100.0, *, fitted=True, plates=2):
    """Someone gliding along x at 1 m/s over plates; marker 2 is lost on frames 50 to 59."""
    times = 2.0 + np.arange(frames) / rate
    x = np.arange(frames) / rate
    offsets = np.array([[0, 1.7, 0], [0, 1.0, 0.1], [0, 1.0, -0.1], [0.1, 0.05, 0.1], [0.1, 0.05, -0.1]])
    measured = offsets[None] + np.stack([x, 0 * x, 0 * x], axis=1)[:, None]
    measured[50:60, 2] = np.nan
    model = measured + np.array([0.03, 0.0, 0.0]) if fitted else np.full_like(measured, np.nan)
    model[:, 0] = np.nan
    position = np.stack([x, np.full(frames, 1.0), 0 * x], axis=1)[:, None]
    still = np.tile([1.0, 0, 0, 0], (frames, 1, 1))
    forward = np.tile([1.0, 0, 0], (frames, 1))
    return Replay(
        name=name,
        times=times,
        rate=rate,
        markers=MarkerReplay(("HEAD", "R", "L", "RTOE", "LTOE"), measured, model),
        plates=tuple(_plate(i, frames, x) for i in range(plates)),
        feet=("calcn_r", "calcn_l") if fitted else (),
        bodies=BodyReplay(("pelvis",), still, position, forward=forward) if fitted else None,
        residual=_residual(frames, position[:, 0]) if fitted else None,
        joints=_joints(x) if fitted else None,
        forces=_forces(frames) if fitted else ForceUse(),
        notes=("plate 2 was not tared",),
    )


def _joints(x):
    """Both knees swing, the left one half a swing later; their torques are in step with their speeds."""
    right, left = 0.5 * np.sin(6 * x), -0.5 * np.sin(6 * x)
    torque = np.stack([0 * x, 40 * np.cos(6 * x), -40 * np.cos(6 * x)], axis=1)
    speed = np.stack([0 * x + 1.0, 3.0 * np.cos(6 * x), -3.0 * np.cos(6 * x)], axis=1)
    return JointReplay(
        ("pelvis_tx", "knee_angle_r", "knee_angle_l"),
        (False, True, True),
        np.stack([x, right, left], axis=1),
        torque,
        speed=speed,
        power=torque * speed,
        limits=((-5.0, 5.0), (0.0, 2.0), (0.0, 2.0)),
        of_root=frozenset({"pelvis_tx"}),
        mass_kg=80.0,
    )


def _plate(i, frames, x):
    force, cop = np.zeros((frames, 3)), np.full((frames, 3), np.nan)
    loaded = slice(i * 60, i * 60 + 60)
    force[loaded, 1] = 700.0
    cop[loaded] = np.stack([x[loaded], 0 * x[loaded], 0 * x[loaded] + 0.1], axis=1)
    foot = np.where(np.arange(frames) < 150, i % 2, -1)
    corners = np.array([[0, 0, -0.3], [0.6, 0, -0.3], [0.6, 0, 0.3], [0, 0, 0.3]])
    corners += np.array([0.6 * i, 0, 0])
    return PlateReplay(f"plate {i + 1}", force, cop, foot, corners)


def _forces(frames):
    """Right on the ground on frames 0 to 59, left on 60 to 119; three proposals, one sure enough."""
    missing = ((60, 80, "calcn_l", "footContactDetectedButNoForce"),) if frames > 150 else ()
    counts = np.ones((frames, 2), dtype=bool)
    for start, end, *_ in missing:
        counts[start:end, 1] = False
    return ForceUse(
        contacts=(ContactPhase(0, 0, 60, 1.0), ContactPhase(1, 60, 120, 0.2)),
        missing=missing,
        source="proposals",
        proposals=(
            Proposal((60, 80), "calcn_l", "footContactDetectedButNoForce", 0.9, {"missing_N": 512.0}),
            Proposal((20, 30), None, "hasInputOutliers", 0.4, {}),
            Proposal((100, 110), "calcn_r", "notOverForcePlate", 0.7, {"slip_m_s": 0.02}),
        )
        if frames > 150
        else (),
        sources=("proposals",) * len(missing),
        counts=counts,
        confidence=0.8,
    )


def _residual(frames, com):
    force = np.zeros((frames, 3))
    force[:, 0] = np.linspace(0, 100, frames)
    return ResidualReplay(force, 0.1 * force, com, np.arange(frames) >= 20, 35.0, 12.0)


class HandMadeLibrary(Library):
    """A library that gives these replays."""

    def __init__(self, folder, replays):
        files = tuple(TrialFiles(replay.name, folder / f"{replay.name}.trc") for replay in replays)
        for file in files:
            file.markers.touch()
        super().__init__(Subject(folder, files), meshes={"pelvis": trimesh.creation.box((0.2, 0.2, 0.3))})
        self.replays = {replay.name: replay for replay in replays}
        self.broken, self.strides = {}, {}

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
        return Capture(name, Markers(replay.markers.names, replay.markers.measured, replay.rate))


@pytest.fixture(autouse=True)
def read_at_once(monkeypatch):
    """Nobody has to wait before a second T counts."""
    monkeypatch.setattr("addb_viewer.app.queue.finishing.READ_S", 0.0)


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
            browser.until(lambda: "worst first" in browser.html(), "the queue")
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
        (client,) = _until(lambda: set(app.sessions) - before, "the session")
        page.session = app.sessions[client]
        _until(lambda: page.session.replay is not None, "the trial")
        _until(page.locator("#addb-bar b").first.text_content, "the bar")
        page.evaluate("new Promise((done) => window.addb.on('keys', () => done(true)))")
        return page

    return opened


def _is_error(said):
    return said.type == "error" and EVAL_PROBE not in said.text


@pytest.fixture(scope="session")
def ten_trials(real_data, tmp_path_factory):
    """A folder of five subjects, ten short fitted trials of real recordings in all; to be copied."""
    root = tmp_path_factory.mktemp("ten trials")
    write_ten_trials(real_data, root)
    return root


@pytest.fixture(scope="session")
def two_walks(real_data, tmp_path_factory):
    """One subject, two seconds of a real walk as trials `part1` and `part2`, fitted; to be copied."""
    folder = tmp_path_factory.mktemp("two walks") / "walks"
    write_trials(real_data, folder, "walks")
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
    """What the log says of one of them."""

    def read(trial="part1"):
        with open_log(walks_folder) as log:
            return log.review(trial, ("calcn_r", "calcn_l"))

    return read


@pytest.fixture(scope="session")
def until():
    """Waits for a condition."""
    return _until


def _until(condition, what="the browser to follow"):
    end = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.05)
    return value


@pytest.fixture(scope="session")
def effect():
    """Makes a cause in the shape of `diagnose --json`."""
    return _effect


@pytest.fixture(scope="session")
def figures():
    """Makes a diagnosis in the shape of `diagnose --json`."""
    return _figures


def _effect(id_, target, frames=((0, 200),), **parameters):
    return {
        "id": id_,
        "target": target,
        "parameters": {name: {"value": value, "std": 0.1 * abs(value)} for name, value in parameters.items()},
        "confidence": 0.97,
        "trial": "walk",
        "frames": [list(r) for r in frames],
        "sentence": f"Something about {target}.",
        "remedy": "Do something about it.",
    }


def _figures(*effects, verdict="explained", location=None, alternatives=()):
    linear = {"before": 41.0, "after": 12.2, "interval": [11.0, 13.9]}
    return {
        "verdict": verdict,
        "effects": list(effects),
        "alternatives": list(alternatives),
        "gain": {"heldout_linear_residual_N": linear} if effects else {},
        "remaining": {"linear_residual_N": 12.2, "noise_floor_N": 9.8, "location": location},
        "trials": ["walk"],
        "rates_Hz": {"walk": 100.0},
        "notes": [],
        "residual": residual(
            trial("walk", (120, 170), _course(), force=90.0),
            phases=[("single_support", "calcn_r", size()), ("no_load", None, size(90.0))],
        ),
    }


def _course():
    """Windows every 30 ms, none between 1.0 and 1.2 s."""
    time_s = np.round(np.arange(0.1, 1.9, 0.03), 2)
    time_s = time_s[(time_s <= 1.0) | (time_s >= 1.2)]
    force = 40.0 + 40.0 * np.sin(4 * time_s)
    names = {"force_N": 1.0, "force_after_N": 0.3, "force_floor_N": 0.0}
    names |= {"moment_Nm": 0.5, "moment_after_Nm": 0.2, "moment_floor_Nm": 0.0}
    floor = {"force_floor_N": 10.0, "moment_floor_Nm": 5.0}
    return {"time_s": time_s.tolist()} | {
        name: (share * force + floor.get(name, 0.0)).tolist() for name, share in names.items()
    }
