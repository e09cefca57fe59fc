"""A real browser, one for all tests of the app and the report, and a fit of two trials: seconds."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from addb_viewer import Subject
from addb_viewer.jobs import review_store
from addb_viewer.jobs.environment import ROOT, STORE
from addb_viewer.trial_view.replay import (
    BodyReplay,
    ForceUse,
    JointReplay,
    MarkerReplay,
    PlateReplay,
    Replay,
    ResidualReplay,
)
from solver.common.notes import Kind, noted
from solver.contact.contact_phases import ContactPhase
from solver.contact.detected_ranges import Proposal
from solver.diagnosis.diagnosis import Remaining
from solver.diagnosis.diagnosis_report import DiagnosisReport
from tests.addb_viewer.app.ten_trials import write_trials
from tests.addb_viewer.chromium import FLAGS, installed
from tests.addb_viewer.synthetic_residual import residual, size, trial
from tests.addb_viewer.told_diagnosis import told

MARKERS_ALONE = "[trajectory]\nenabled = false\n"
CLEAN = DiagnosisReport("clean", (), (), {}, Remaining(9.0, 9.8), ("walk",), rates_Hz={"walk": 100.0})


@pytest.fixture(scope="session")
def fit_of_two(tmp_path_factory):
    """A folder with a walk, flagged on frames of it, and a squat, fitted by the markers alone."""
    subject = Subject.demo(tmp_path_factory.mktemp("demo") / "subject", trials=("walk", "squat"))
    (subject.folder / "settings.toml").write_text(MARKERS_ALONE)
    subject.flag("walk", 100, 140, author="anna")
    assert subject.fit().trials == ("squat", "walk")
    return subject.folder


@pytest.fixture(scope="session")
def two_walks(real_data, tmp_path_factory):
    """One subject, two seconds of a real walk as trials `part1` and `part2`, fitted; to be copied."""
    folder = tmp_path_factory.mktemp("two walks") / "walks"
    write_trials(real_data, folder, "walks")
    return folder


@pytest.fixture
def folder(fit_of_two, tmp_path, monkeypatch):
    """A copy of it; diagnoses and the demo cost nothing, and the app ends at once."""
    monkeypatch.setattr("addb_viewer.jobs.diagnosing.diagnosis_of", lambda *_, **__: CLEAN)
    for module in ("jobs.demo", "commands.open"):
        monkeypatch.setattr(f"addb_viewer.{module}.make_demo", lambda *_, **__: None)
    monkeypatch.setattr("addb_viewer.app.app._until_interrupted", _interrupt)
    (tmp_path / "beside").mkdir()
    return Path(shutil.copytree(fit_of_two, tmp_path / "subject"))


def _interrupt():
    raise KeyboardInterrupt


@pytest.fixture(scope="session")
def browser():
    """Debian's Chromium, headless, software rendering."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = installed()
    if chromium is None:
        pytest.skip("no Chromium on PATH (Debian: apt install chromium)")
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, headless=True, args=FLAGS)
        yield browser
        browser.close()


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
        notes=noted(Kind.PLATES, "plate 2 was not tared"),
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
    return told(
        {
            "verdict": verdict,
            "effects": list(effects),
            "alternatives": list(alternatives),
            "gain": {"held_out_linear_residual_N": linear} if effects else {},
            "remaining": {"linear_residual_N": 12.2, "noise_floor_N": 9.8, "location": location},
            "trials": ["walk"],
            "rates_Hz": {"walk": 100.0},
            "notes": [],
            "residual": residual(
                trial("walk", (120, 170), _time_history(), force=90.0),
                phases=[("single_support", "calcn_r", size()), ("no_load", None, size(90.0))],
            ),
        }
    )


def _time_history():
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


@pytest.fixture
def own_files(monkeypatch):
    """Whatever the tests' own environment says."""
    monkeypatch.setenv(STORE, "")
    monkeypatch.delenv(ROOT, raising=False)
    yield
    review_store._shared.cache_clear()
