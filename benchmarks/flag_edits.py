"""Torques after random edits of the flags, against a fit of all frames to the tight optimum.

`python -m benchmarks.flag_edits` prints a row an edit, and a table. An edit flags a stretch of forces that
count, or takes back the one before: as the app does it, beginning at the kept fit. Compared are joint torques
of frames whose forces count before and after.
"""

import argparse
import time
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, replace

import numpy as np
from jaxtyping import Float

from benchmarks.markdown import table
from benchmarks.recordings import data_folder
from solver.capture.subject.opened_subject import open_subject
from solver.contact.force_review import ForceLabel, ForceReview
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import resolve, solve
from solver.fitting.settings import Settings, as_dict, settings_for
from solver.kinematics.frame_solver import root_dofs

TRIALS = (
    ("anomalies/tiziana2019_lencioni", "trial"),
    ("exo_apo_gordon", "NE21"),
    ("opencap_subject4", "walking1"),
    ("opencap_subject6", "walking1"),
    ("walk_rajagopal2015", "walk"),
    ("run_treadmill_hamner2013_subject04", "run400"),
    ("overground_falisse_AdDB", "Gait_7"),
    ("sprint_overground_dorn2012_JA1_9ms", "run0900cms"),
    ("walk_gait2354_subject01", "walk1"),
    ("opencap_subject4", "walkingTO1"),
    ("c3d_lab_trials/lasem_FAILT01", "Walk01"),
    ("walk_treadmill_stepwidth", "example1"),
    ("overground_camargo2021_AB06", "levelground_ccw_fast_01_01"),
)
RUNS = {"run400", "run0900cms"}
HEAD = ["recording", "edits", "s", "effect", "off the optimum", "worst frame", "effect's error", "within"]
EDITS, LENGTHS_S = 17, (0.03, 0.5)  # of each recording; of a flagged stretch


@dataclass(frozen=True)
class Row:
    """What one edit gave."""

    trial: str
    what: str
    seconds: float  # CPU, for 500 frames
    effect_Nm: float  # of the edit on torques that count before and after: root mean square
    short_Nm: float  # of the tight optimum: root mean square
    worst_Nm: float  # likewise, the joint and frame that is farthest from it
    effect_short_Nm: float  # of the edit's effect there, root mean square


def rows(folder: str, trial: str) -> Iterator[Row]:
    """Of random edits of one trial, every second of which takes back the one before it."""
    subject = open_subject(data_folder() / folder)
    settings = settings_for(subject.folder)
    kept = solve(subject, settings, trials=[trial])
    tight_kept = _tight(kept, {}, settings)
    rng = np.random.default_rng(len(trial))
    for k in range(EDITS):
        if k % 2 == 0:
            before, tight_before, said = kept, tight_kept, {trial: _random_flag(kept.trials[0], rng)}
        else:
            before, tight_before, said = after, tight, {}
        began = time.process_time()
        after = resolve(before, said, settings, with_std=False)
        taken = time.process_time() - began
        tight = _tight(after, said, settings) if said else tight_kept
        away, moved, should = (_apart(after, tight), _apart(after, before), _apart(tight, tight_before))
        if np.isnan(away).all():  # no frame counts any more
            continue
        yield Row(
            trial,
            "flagged" if said else "taken back",
            500 * taken / kept.trials[0].motion.frames,
            _rms(should),
            _rms(away),
            float(np.nanmax(np.abs(away))),
            _rms(moved - should),
        )


def _random_flag(trial: TrialFit, rng: np.random.Generator) -> ForceReview:
    """Of one foot or both, from a frame on whose force is known."""
    assert trial.contacts is not None
    start = int(rng.choice(np.flatnonzero(trial.forces_known)))
    length = max(1, round(rng.uniform(*LENGTHS_S) * trial.motion.rate))
    foot = rng.choice([None, *trial.contacts.foot_bodies])
    return ForceReview((ForceLabel(start, min(start + length, trial.motion.frames), foot, "manualReview"),))


def _tight(fit: Fit, said: Mapping[str, ForceReview], settings: Settings) -> Fit:
    """All frames, to where nothing is left to gain."""
    of_all = replace(settings.trajectory, tolerance=1e-7, iterations=60, edits_last=-1.0)
    tight = replace(settings, trajectory=of_all)
    return resolve(replace(fit, settings=as_dict(tight)), said, tight, with_std=False)


def _apart(one: Fit, other: Fit) -> Float[np.ndarray, "frames joints"]:
    """By how much torques differ where forces count in both [N·m]."""
    (a,), (b,) = ([trial.dynamics for trial in fit.trials] for fit in (one, other))
    assert a is not None
    assert b is not None
    apart = a.joint_torques - b.joint_torques
    apart[~(a.used & b.used)] = np.nan
    return apart[:, ~root_dofs(one.skeleton)]


def _rms(of: Float[np.ndarray, "frames joints"]) -> float:
    return float(np.sqrt(np.nanmean(of**2)))


def main() -> None:
    """Print rows as they are made, then the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flag_edits", description=__doc__)
    parser.add_argument("--only", nargs="*", default=[""], help="parts of recordings' folder names")
    given, cells = parser.parse_args(), []
    for folder, trial in TRIALS:
        if not any(part in folder for part in given.only):
            continue
        found = []
        for row in rows(folder, trial):
            found.append(row)
            print(row, flush=True)
        figures = np.array([astuple(row)[2:] for row in found])
        worst, middle = figures.max(axis=0), np.median(figures, axis=0)
        told = [f"{a:.3g} ({b:.3g})" for a, b in zip(middle, worst, strict=True)]
        cells.append(
            [folder, len(found), *told, f"{(figures[:, 2] <= (0.2 if trial in RUNS else 0.05)).sum()}"]
        )
    print(table(HEAD, cells))


if __name__ == "__main__":
    main()
