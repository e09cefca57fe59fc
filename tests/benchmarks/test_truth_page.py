"""The page shows what the files hold: the best filter, faults, figures of other code."""

import numpy as np

from benchmarks.truth.figures import figures, gains
from benchmarks.truth.page import section
from benchmarks.truth.ways import CUTOFFS_HZ, LABORATORY, MARKER_FIT, OURS, at_cutoff, time_history_of
from solver.common.filters import low_pass
from solver.kinematics.motion import Motion

DOFS = ("hip_flexion_r", "knee_angle_r", "ankle_angle_r", "lumbar_extension")
RATE = 100.0
VERSION = "abc"


def case(activity="walk", version="abc", error=None):
    times = np.arange(300) / RATE
    angle = 0.4 * np.sin(2 * np.pi * times[:, None] + np.arange(4))
    noisy = angle + 0.01 * np.random.default_rng(1).standard_normal(angle.shape)
    truth = time_history_of(Motion(DOFS, angle, RATE), 50 * angle)
    ways = {OURS: 1.2 * angle, MARKER_FIT: noisy, LABORATORY: low_pass(noisy, RATE, 6.0)}
    ways |= {at_cutoff(hz): low_pass(noisy, RATE, hz) for hz in CUTOFFS_HZ}
    time_histories = {name: time_history_of(Motion(DOFS, q, RATE), 50 * q) for name, q in ways.items()}
    counts = np.ones(300, dtype=bool)
    run = {
        "activity": activity,
        "model": "own",
        "skin_mm": 5.0,
        "person": 0,
        "ways": {name: figures(time_history, truth, counts) for name, time_history in time_histories.items()},
        "gains": {OURS: gains(time_histories[OURS], truth), "truth": gains(truth, truth)},
        "mass_ratios": {"thigh": 1.07, "body": 1.0},
        "length_errors_mm": {"hip width": -12.0},
    }
    return {
        "part": "simulated",
        "of": activity,
        "version": version,
        "cpu_seconds": 60.0,
        "runs": [run],
        "error": error,
    }


def test_ours_stands_beside_the_best_filter():
    text = section([case()], VERSION)
    row = next(line for line in text.splitlines() if line.startswith("| walk | own | 5 |"))
    angles = row.split("|")[4]
    ours, _, _, best = (part.strip() for part in angles.split("/"))
    assert float(ours) > 2.0  # a fifth of 16° RMS
    assert "Hz" in best
    assert float(best.split()[0]) < 0.5
    assert "peak +20 %" in text
    assert "| walk | own | 5 |  | 1.07 |" in text
    assert "-12" in text


def test_faults_and_figures_of_other_code_are_told():
    text = section([case(version="old", error="no frame shows three markers")], VERSION)
    assert "1 of 1 files of figures are of other code" in text
    assert "no frame shows three markers" in text
    whole = section([case()], VERSION)
    assert "other code" not in whole
    assert "Not measured" not in whole
