"""Simulated people as a markerless system sees them: keypoints that are centimetres off for many frames.

`python -m benchmarks.truth.keypoints` prints how often bands hold, and what the diagnosis finds of a late
video. Every keypoint sits 5 to 20 mm off its joint on the segment, as its system defines it, and moves by 10
to 30 mm (root mean square of the distance): a Gauss-Markov process of 0.1 to 0.3 s, low-passed at 6 Hz as
these systems write it. Heads nod and keep their gaze; one stance of gait has no plate.
"""

import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter

from benchmarks.truth.bands import SIDES_SD, band_figures
from benchmarks.truth.simulated import STEP_PLATE_M, WHO, true_time_history
from benchmarks.truth.ways import time_history_of
from solver.capture.capture import Capture, Markers
from solver.capture.subject.opened_subject import open_subject
from solver.common.filters import low_pass
from solver.diagnosis.diagnose_subject import diagnose
from solver.fitting.fit_result import Fit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under, standing_plates
from solver.simulate.person import body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.simulate.subject_folder import write_subject
from solver.skeleton.forward import body_poses

JOINTS = {
    "Hip": "femur",
    "Knee": "tibia",
    "Ankle": "talus",
    "Shoulder": "humerus",
    "Elbow": "ulna",
    "Wrist": "hand",
}
# [m] of a body 1.74 m tall, right side, in the segment's frame: on the skin, by our own measure of a foot
FOOT = {
    "BigToe": ("toes", (0.055, 0.0, -0.025)),
    "SmallToe": ("toes", (0.0, 0.0, 0.045)),
    "Heel": ("calcn", (-0.02, 0.005, 0.0)),
}
NECK_TORSO, NOSE_NECK, HEAD_NECK = (0.0, 0.40, 0.0), (0.11, 0.11, 0.0), (0.05, 0.25, 0.0)
GAZE = 0.7  # of the trunk's lean that the head does not take part in
NOD_RAD, NOD_S = 0.07, 0.5
DEFINED_M, SIZE_M, FORGETS_S = (0.005, 0.020), (0.010, 0.030), (0.1, 0.3)
LOW_PASS_HZ, LOW_PASS_ORDER, RATE_HZ = 6.0, 2, 60.0
SCENARIOS = {
    "walk": Scenario("walk", "walk", duration=4.0),
    "run": Scenario("run", "run", duration=2.4),
    "squat": Scenario("squat", "squat", duration=4.5),
}
LATE_S = 0.04
LEGS = ("hip", "knee", "ankle", "subtalar", "lumbar")
CASES = (("walk", 0), ("walk", 1), ("walk", 2), ("run", 1), ("squat", 0))
TEACHERS = tuple((activity, person) for activity in SCENARIOS for person in (3, 4, 5))  # judge nothing


@dataclass(frozen=True)
class Twin:
    """What happened, and its recording by video and plates."""

    trial: SyntheticTrial
    capture: Capture


def twin(activity: str, person: int, *, late_s: float = 0.0, size_m: tuple[float, float] = SIZE_M) -> Twin:
    """The same numbers give the same one; the video is `late_s` late against the plates."""
    body_rng, motion_rng, video_rng, plates_rng = np.random.default_rng(700 + person).spawn(4)
    body = body_of(replace(WHO[person], mass_scatter=0.0, com_scatter_m=0.0), body_rng)
    trial = simulate_trial(SCENARIOS[activity], body, motion_rng)
    plates = (
        standing_plates(trial.contacts)
        if activity == "squat"
        else plates_under(trial.contacts, (0.0, trial.scenario.duration), missed=(3,), size=STEP_PLATE_M)
    )
    laboratory = MeasurementSettings(marker_rate=RATE_HZ, force_delay_s=-late_s)
    capture = measure(trial, plates, ("C7",), laboratory, plates_rng)
    return Twin(trial, replace(capture, markers=keypoints(trial, video_rng, size_m)))


def keypoints(
    trial: SyntheticTrial, rng: np.random.Generator, size_m: tuple[float, float] = SIZE_M
) -> Markers:
    """What the video system writes."""
    motion, skeleton = trial.frames(RATE_HZ), trial.body.skeleton
    R, p = body_poses(skeleton, motion.q)

    def at(
        body: str, place: Sequence[float]
    ) -> tuple[Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"]]:
        i = skeleton.body_index(body)
        return R[:, i], p[:, i] + R[:, i] @ np.array(place)

    seen = {}
    for side, sign in (("r", 1.0), ("l", -1.0)):
        on = {name: (f"{body}_{side}", (0.0, 0.0, 0.0)) for name, body in JOINTS.items()}
        on |= {name: (f"{body}_{side}", (x, y, sign * z)) for name, (body, (x, y, z)) in FOOT.items()}
        seen |= {f"{side.upper()}{name}": at(*where) for name, where in on.items()}
    R_torso, neck = at("torso", NECK_TORSO)
    lean = (
        GAZE * np.arctan2(R_torso[:, 0, 1], R_torso[:, 1, 1])
        + NOD_RAD * _forgetful(rng, motion.frames, 1, NOD_S)[:, 0]
    )
    c, s, one = np.cos(lean), np.sin(lean), np.ones_like(lean)
    nod = np.stack(
        [np.stack([c, -s, 0 * one], 1), np.stack([s, c, 0 * one], 1), np.stack([0 * one, 0 * one, one], 1)], 1
    )
    head = nod @ R_torso
    seen |= {
        "Neck": (R_torso, neck),
        "Nose": (head, neck + head @ NOSE_NECK),
        "Head": (head, neck + head @ HEAD_NECK),
    }
    positions = []
    for R_body, point in seen.values():
        off, direction = rng.uniform(*DEFINED_M), rng.normal(size=3)
        error = _forgetful(rng, motion.frames, 3, rng.uniform(*FORGETS_S))
        error *= rng.uniform(*size_m) / np.sqrt((error**2).sum(axis=1).mean())
        positions.append(point + R_body @ (off * direction / np.linalg.norm(direction)) + error)
    written = low_pass(
        np.stack(positions, axis=1).reshape(motion.frames, -1), RATE_HZ, LOW_PASS_HZ, LOW_PASS_ORDER
    )
    return Markers(tuple(seen), written.reshape(motion.frames, -1, 3), RATE_HZ)


def _forgetful(
    rng: np.random.Generator, frames: int, count: int, forgets_s: float
) -> Float[np.ndarray, "frames count"]:
    """Gauss-Markov, of unit size."""
    kept, before = np.exp(-1 / (forgets_s * RATE_HZ)), round(10 * forgets_s * RATE_HZ)
    white = rng.normal(size=(before + frames, count))
    return lfilter([np.sqrt(1 - kept**2)], [1.0, -kept], white, axis=0)[before:]


def solved(of: Twin, person: int) -> Fit:
    """Written into a folder, and fitted."""
    with tempfile.TemporaryDirectory() as scratch:
        write_subject(Path(scratch), WHO[person], [of.capture])
        return solve(open_subject(Path(scratch)), Settings())


def figures(case: tuple[str, int]) -> str:
    """Shares that 95 % bands of legs and trunk hold, of predicted forces, and how far angles are off."""
    of = twin(*case)
    fit = solved(of, case[1])
    trial = fit.trials[0]
    assert trial.dynamics is not None
    ours = time_history_of(trial.motion.filled(), trial.dynamics.joint_torques)
    true = true_time_history(of.trial, RATE_HZ)
    held = band_figures(trial.std, fit.skeleton.dofs, ours, true, trial.dynamics.used)
    shares = {
        kind: f"{100 * np.mean([own[0] for name, own in by_joint.items() if name.startswith(LEGS)]):.0f} %"
        for kind, by_joint in held.items()
    }
    off = np.degrees(ours.angle - true.angle[:, [true.dofs.index(d) for d in ours.dofs]])
    mean = {d: off[:, k].mean().round(1) for k, d in enumerate(ours.dofs) if d.startswith(LEGS)}
    return f"{case}: {shares}, forces {force_figures(fit, of)}, mean angles off by {mean}"


def delay(case: tuple[str, int]) -> str:
    """What the diagnosis says of a video that is 40 ms late."""
    with tempfile.TemporaryDirectory() as scratch:
        write_subject(Path(scratch), WHO[case[1]], [twin(*case, late_s=LATE_S).capture])
        found = diagnose(open_subject(Path(scratch)), Settings())
    return f"{case}: {found.verdict}: {[(e.id, e.parameters) for e in found.effects]}"


def force_figures(fit: Fit, of: Twin) -> dict[str, float]:
    """Share of the components of predicted forces that their bands hold, their RMS error and half width."""
    trial = fit.trials[0]
    assert trial.dynamics is not None
    if trial.std is None or trial.std.predicted_force_ground is None:
        return {}
    truth = of.trial.reactions(trial.motion.times).wrench_ground[:, :, :3]
    half = SIDES_SD * trial.std.predicted_force_ground
    on = np.isfinite(half) & (half > 0)
    if not on.any():
        return {}
    assert trial.dynamics.wrench_predicted_ground is not None
    error = np.abs(trial.dynamics.wrench_predicted_ground[:, :, :3] - truth)[on]
    return {
        "held": float((error < half[on]).mean()),
        "rms": float(np.sqrt((error**2).mean())),
        "half": float(half[on].mean()),
        "frames": int(on.any(axis=(1, 2)).sum()),
    }


if __name__ == "__main__":
    cases = TEACHERS if "--teachers" in sys.argv else CASES
    with ProcessPoolExecutor(2) as pool:
        for line in (*pool.map(figures, cases), *pool.map(delay, cases)):
            sys.stdout.write(f"{line}\n")
