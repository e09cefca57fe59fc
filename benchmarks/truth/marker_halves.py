"""Bands against real recordings: two halves of a trial's markers, each fitted alone, differ by no more.

`python -m benchmarks.truth.marker_halves SUBJECT...` prints a row a trial. Segments of fewer than four
markers keep all of them in both fits. Plates are the same, and so are scaling and masses where they come from
a static trial and the plates: what differs is noise and skin.

With `--strides`: whether strides of a trial, whose forces all count, spread by no less than the noise that
bands say. People vary as well, so the ratio is above 1 unless bands of noise are too wide.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.truth.band_sizes import std_of
from solver.capture.subject.opened_subject import open_subject
from solver.dynamics.trajectory.uncertainty import ErrorSizes
from solver.export.gait_tables import trial_gait
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.gait.stride_curves import stride_curves
from solver.kinematics.frame_solver import root_dofs

FEWEST = 4  # markers of a segment that is split
FEWEST_STRIDES = 3
KINDS = ("angle", "speed", "torque")


def halves(fit: Fit, trial: TrialFit, rng: np.random.Generator) -> tuple[set[str], set[str]]:
    """Labels that either fit goes without; none of those that the file calls otherwise than the model."""
    labels = [n for n in trial.marker_errors.names if n in trial.capture.markers.names]
    body_of = {marker.name: marker.body for marker in fit.skeleton.markers}
    out: tuple[set[str], set[str]] = (set(), set())
    for body in sorted(set(body_of.values())):
        own = rng.permutation([label for label in labels if body_of[label] == body])
        if len(own) >= FEWEST:
            for half, names in zip(out, np.array_split(own, 2), strict=True):
                half.update(names.tolist())
    return out


def without(trial: TrialFit, labels: set[str], fit: Fit) -> TrialFit:
    """The trial as fitted without some of its markers."""
    capture = trial.capture
    seen = capture.markers.positions_ground.copy()
    seen[:, [name in labels for name in capture.markers.names]] = np.nan
    fewer = replace(capture, markers=replace(capture.markers, positions_ground=seen))
    again = solve(fit.subject, Settings(), captures={capture.name: fewer}, held_out=False)
    return next(one for one in again.trials if one.capture.name == capture.name)


def values_of(trial: TrialFit, kind: str) -> Float[np.ndarray, "frames dofs"]:
    """What the bands of a kind are about."""
    assert trial.dynamics is not None
    motion = trial.dynamics.motion
    return {"angle": motion.q, "speed": motion.velocity, "torque": trial.dynamics.joint_torques}[kind]


def rows(folder: Path) -> Iterator[str]:
    """A row a trial with bands: the share of frames within them, and the difference in terms of them."""
    subject = open_subject(folder)
    fit = solve(subject, Settings(), held_out=False)
    joints = ~root_dofs(fit.skeleton)
    for trial in fit.trials:
        if trial.std is None:
            continue
        hidden = halves(fit, trial, np.random.default_rng(1))
        if not hidden[0]:
            continue
        one, other = (without(trial, labels, fit) for labels in hidden)
        assert one.dynamics is not None
        assert other.dynamics is not None
        used = one.dynamics.used & other.dynamics.used
        cells = []
        for kind in KINDS:
            apart = (values_of(one, kind) - values_of(other, kind))[used][:, joints]
            apart -= apart.mean(axis=0) if kind == "angle" else 0.0
            std = np.hypot(getattr(one.std, kind), getattr(other.std, kind))[used][:, joints]
            told = np.isfinite(std) & (std > 0)
            within = (np.abs(apart) < 1.96 * std)[told].mean()
            size = np.sqrt((apart[told] ** 2).mean() / (std[told] ** 2).mean())
            cells.append(f"{kind} {100 * within:.0f} %, {size:.2f} σ")
        yield f"{subject.name}/{trial.capture.name}: {'; '.join(cells)}"


def stride_rows(folder: Path) -> Iterator[str]:
    """By kind, the spread between strides over the noise: over all joints, and the least."""
    fit = solve(open_subject(folder), Settings(), held_out=False)
    trial = fit.trials[0]
    gait = trial_gait(fit, trial)
    noise = std_of(fit, ErrorSizes(skin=0.0, landmarks_m=0.0, tables=0.0))
    assert gait is not None
    assert trial.dynamics is not None
    motion, cells, strides = trial.dynamics.motion, [], 0
    for kind in KINDS:
        counts = trial.dynamics.used if kind == "torque" else None
        ratios = {}
        for column, name in enumerate(fit.skeleton.dofs):
            foot = next((k for k, foot in enumerate(gait.feet) if foot[-2:] == name[-2:]), None)
            own = [cycle for cycle in gait.cycles if cycle.foot == foot]
            of_noise = getattr(noise, kind)[:, column]
            curves = stride_curves(own, motion.times, values_of(trial, kind)[:, column], counts, of_noise)
            if len(curves.cycles) >= FEWEST_STRIDES and np.isfinite(of_noise).all():
                assert curves.std is not None
                assert curves.within is not None
                strides = max(strides, len(curves.cycles))
                ratios[name] = float(np.sqrt((curves.std**2).mean() / (curves.within**2).mean()))
        if not ratios:
            continue
        least = min(ratios, key=lambda name: ratios[name])
        middle = np.sqrt(np.mean(np.square(list(ratios.values()))))
        cells.append(f"{kind} {middle:.2f}, least {ratios[least]:.2f} ({least})")
    yield f"{folder.name}/{trial.capture.name}, {strides} strides: {'; '.join(cells)}"


if __name__ == "__main__":
    *paths, last = sys.argv[1:]
    asked, folders = (stride_rows, paths) if last == "--strides" else (rows, sys.argv[1:])
    for path in folders:
        for row in asked(Path(path)):
            print(row, flush=True)
