"""How large the errors behind the bands are, learnt from simulated people who judge nothing.

`python -m benchmarks.truth.band_sizes` prints `ErrorSizes` (20 minutes of CPU).
"""

import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import astuple, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from benchmarks.truth import simulated
from benchmarks.truth.bands import KINDS, SIDES_SD, errors_of, inner
from benchmarks.truth.ways import bench_settings, time_history_of
from solver.dynamics.dynamics import TrialStd
from solver.dynamics.trajectory.uncertainty import ErrorSizes, trial_std
from solver.fitting.fit_result import Fit
from solver.fitting.trajectory_stage import before_forces, trial_data

TEACHERS = (3, 4, 5)  # people of `simulated`
LEARNT_ON = ("walk", "run", "squat", "landing")
WANTED, LEAST = 0.955, 0.88  # share of the frames that bands hold, on average and at any joint
UNITS = tuple(ErrorSizes(*row) for row in np.diag([1.0, 1.0, 1.0, 1.0]))


@dataclass(frozen=True)
class _Lesson:
    """One simulated person's variances by errors of unit size, and what was really wrong."""

    group: tuple[str, float]
    own_model: bool
    names: list[str]
    variances: dict[str, Float[np.ndarray, "errors frames joints"]]
    errors: dict[str, Float[np.ndarray, "frames joints"]]


def _lesson(case: tuple[str, bool, float, int]) -> _Lesson:
    activity, own_model, skin_mm, person = case
    truth = simulated.made(activity, person)
    with tempfile.TemporaryDirectory() as scratch:
        fit = simulated.solved(truth, activity, person, Path(scratch) / "s", own=own_model, skin_mm=skin_mm)
    trial = fit.trials[0]
    assert trial.dynamics is not None
    ours = time_history_of(trial.motion, trial.dynamics.joint_torques)
    true = simulated.true_time_history(truth.trial, trial.motion.rate)
    stds = [std_of(fit, sizes) for sizes in UNITS]
    on, dofs = inner(len(true.angle), true.rate), list(fit.skeleton.dofs)
    errors = {kind: errors_of(ours, true, kind) for kind in KINDS}
    names = sorted(n for n in errors["torque"] if np.isfinite(stds[0].torque[:, dofs.index(n)]).all())
    at = [dofs.index(name) for name in names]
    return _Lesson(
        (activity, skin_mm),
        own_model,
        names,
        {kind: np.stack([getattr(s, kind)[on][:, at] ** 2 for s in stds]) for kind in KINDS},
        {kind: np.stack([errors[kind][n][on] for n in names], axis=1) for kind in KINDS},
    )


def std_of(fit: Fit, sizes: ErrorSizes) -> TrialStd:
    """Of the first trial, whose forces all count."""
    trial, work = fit.trials[0], fit.groundwork
    assert work is not None
    assert work.settled is not None
    assert trial.contacts is not None
    assert trial.spline is not None
    data = trial_data(before_forces(trial), work.match, work.settled.gains[trial.capture.name])
    wrenches = trial.contacts.wrench_ground.transpose(1, 0, 2)
    loads = list(zip(trial.contacts.foot_bodies, wrenches, strict=True))
    return trial_std(fit.skeleton, data, trial.spline, loads, bench_settings().trajectory, sizes=sizes)


def learnt_sizes(lessons: Sequence[_Lesson]) -> ErrorSizes:
    """Bands of speeds and torques hold what they should, on average and at each joint, and are not wide."""

    def of(logs: Float[np.ndarray, "4"]) -> ErrorSizes:
        return ErrorSizes(*np.exp(logs))

    def loss(logs: Float[np.ndarray, "4"]) -> float:
        return sum(
            _loss([s for s in lessons if s.own_model is own], of(logs), kind)
            for own in (True, False)
            for kind in ("speed", "torque")
        )

    begun = np.log([0.7, 1.0, 0.003, 0.6])
    return of(minimize(loss, begun, method="Nelder-Mead", options={"xatol": 0.03, "fatol": 5e-4}).x)


def _loss(lessons: Sequence[_Lesson], sizes: ErrorSizes, kind: str) -> float:
    covered: dict[tuple[str, float], dict[str, list[float]]] = {}
    widths = []
    for one in lessons:
        used = replace(sizes, landmarks_m=0.0) if one.own_model else sizes
        half = SIDES_SD * np.sqrt(np.tensordot(np.square(astuple(used)), one.variances[kind], 1))
        for name, share in zip(one.names, (one.errors[kind] < half).mean(axis=0), strict=True):
            joint = name.removesuffix("_r").removesuffix("_l")
            covered.setdefault(one.group, {}).setdefault(joint, []).append(float(share))
        largest = np.maximum(np.quantile(one.errors[kind], 0.95, axis=0), 1e-9)
        widths.append(np.abs(np.log(half.mean(axis=0) / (1.1 * largest))).mean())
    means = [[float(np.mean(each)) for each in joints.values()] for joints in covered.values()]
    off = np.mean([abs(np.mean(of_group) - WANTED) for of_group in means])
    low = np.mean([max(0.0, LEAST - share) for of_group in means for share in of_group])
    return float(4 * off + 4 * low + 0.1 * np.mean(widths))


if __name__ == "__main__":
    models = [(True, skin) for skin in (3.0, 5.0, 10.0)] + [(False, skin) for skin in (3.0, 10.0)]
    cases = [(a, own, skin, p) for a, (own, skin), p in product(LEARNT_ON, models, TEACHERS)]
    with ProcessPoolExecutor(2) as pool:
        sys.stdout.write(f"{learnt_sizes(list(pool.map(_lesson, cases)))}\n")
