"""Detection of missing force against ground truth: forces hidden at random from recordings that have them all.

    python -m benchmarks.detection [--only NAME] [--seeds 10]

Hidden in the plates as recorded: whole stances; one of two feet in double support; the late half of a stance (as
when a foot leaves a plate's edge); a stance's force scaled down by 30 to 60 % (a foot half on the plate). Truth: frames
on which more than 20 N was removed; the two frames on either side of a border of the truth are not counted.
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from benchmarks.recordings import data_folder
from solver.capture.capture import ForcePlate
from solver.capture.conditioning import ConditionedPlate, condition
from solver.capture.subject import open_subject
from solver.contact.assignment import assign
from solver.contact.detection import detect
from solver.contact.mask import frame_mask
from solver.contact.proposals import missing_force
from solver.contact.wrenches import ContactWrenches
from solver.dynamics.com_data import com_data
from solver.dynamics.mass import mass_from_forces
from solver.fit import Fit, TrialFit
from solver.pipeline import solve
from solver.settings import Settings
from solver.skeleton.forward import body_poses
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

REMOVED_N = 20.0  # more than this taken away: the frame's force is missing
BORDER = 2  # frames on either side of a border that are not counted
SHORTEST_STANCE_S = 0.1
HIDDEN_SHARE = 1 / 3  # of the stances (or double supports) of a trial, and at least one
SCALED_DOWN = (0.3, 0.6)  # share removed

# Folder, trial, and which frames were measured whole: before the first one given, the other foot still pushes off
# beside the plates (walking: the plate's foot has only just landed); the Rajagopal walk's is its reviewer's window.
RECORDINGS = (
    ("run_treadmill_hamner2013_subject04", "run400", 0, None),
    ("walk_treadmill_stepwidth", "example1", 0, None),
    ("walk_gait2354_subject01", "walk1", 0, None),
    ("opencap_subject4", "squats1", 0, None),
    ("opencap_subject4", "walking1", 14, None),
    ("opencap_subject6", "walking1", 17, None),
    ("walk_rajagopal2015", "walk", 61, 175),
    ("exo_apo_gordon", "NE21", 0, None),
)


@dataclass(frozen=True)
class Score:
    """Counts of frames."""

    found: int = 0
    missed: int = 0
    false: int = 0

    def __add__(self, other: "Score") -> "Score":
        return Score(self.found + other.found, self.missed + other.missed, self.false + other.false)

    @property
    def recall(self) -> float:
        """Share of the hidden frames that were found."""
        return self.found / max(1, self.found + self.missed)

    @property
    def precision(self) -> float:
        """Share of the proposed frames that were hidden."""
        return self.found / max(1, self.found + self.false)


Stretch = tuple[int, float, float]  # plate, start and end [s]
Hider = Callable[
    [list[list[Stretch]], np.random.Generator], list[tuple[Stretch, float]]
]  # with the share kept


def stances(plates: tuple[ForcePlate, ...]) -> list[Stretch]:
    """When each plate carries more than 20 N."""
    found = []
    for k, plate in enumerate(plates):
        up = np.concatenate([[False], plate.force_ground[:, 1] > REMOVED_N, [False]])
        edges = np.flatnonzero(up[1:] != up[:-1]).reshape(-1, 2)
        found += [
            (k, plate.start_time + a / plate.rate, plate.start_time + b / plate.rate)
            for a, b in edges
            if b - a > SHORTEST_STANCE_S * plate.rate
        ]
    return found


def _some(items: list, rng: np.random.Generator) -> list:
    chosen = rng.random(len(items)) < HIDDEN_SHARE
    if items and not chosen.any():
        chosen[rng.integers(len(items))] = True
    return [item for item, wanted in zip(items, chosen, strict=True) if wanted]


def whole_stances(all_stances: list[Stretch], rng: np.random.Generator) -> list[tuple[Stretch, float]]:
    return [(s, 0.0) for s in _some(all_stances, rng)]


def one_of_two_feet(all_stances: list[Stretch], rng: np.random.Generator) -> list[tuple[Stretch, float]]:
    doubles = []
    for i, (k, a, b) in enumerate(all_stances):
        for other, c, d in all_stances[i + 1 :]:
            if other != k and min(b, d) - max(a, c) > 0.03:
                doubles.append(((k, other), max(a, c), min(b, d)))
    return [((int(rng.choice(pair)), a, b), 0.0) for pair, a, b in _some(doubles, rng)]


def late_halves(all_stances: list[Stretch], rng: np.random.Generator) -> list[tuple[Stretch, float]]:
    return [((k, (a + b) / 2, b), 0.0) for k, a, b in _some(all_stances, rng)]


def scaled_down(all_stances: list[Stretch], rng: np.random.Generator) -> list[tuple[Stretch, float]]:
    return [(s, 1.0 - rng.uniform(*SCALED_DOWN)) for s in _some(all_stances, rng)]


KINDS = {
    "whole stances": whole_stances,
    "one of two feet": one_of_two_feet,
    "late halves": late_halves,
    "scaled down": scaled_down,
}


def hide(plates: tuple[ForcePlate, ...], stretches: list[tuple[Stretch, float]]) -> tuple[ForcePlate, ...]:
    """The recording as if those forces had not been measured, or not all of them."""
    keep = [np.ones(p.samples) for p in plates]
    for (k, start, end), share in stretches:
        times = plates[k].times
        keep[k][(times >= start - 1e-9) & (times <= end + 1e-9)] = share
    return tuple(
        replace(
            p,
            force_ground=p.force_ground * w[:, None],
            moment_ground=p.moment_ground * w[:, None],
            cop_ground=np.where(w[:, None] > 0, p.cop_ground, np.nan),
        )
        for p, w in zip(plates, keep, strict=True)
    )


@dataclass(frozen=True)
class Case:
    """One fitted trial, to be run with other forces."""

    fit: Fit
    trial: TrialFit
    start: int
    end: int

    def conditioned(self, plates: tuple[ForcePlate, ...]) -> list[ConditionedPlate]:
        return [condition(p, self.trial.motion.times) for p in plates]

    def assigned(self, conditioned: list[ConditionedPlate]) -> ContactWrenches:
        return assign(
            conditioned,
            *body_poses(self.fit.skeleton, self.trial.motion.q),
            skeleton=self.fit.skeleton,
            foot_bodies=self.fit.subject.foot_bodies,
            times=self.trial.motion.times,
            settings=Settings().contact,
        )

    def skeleton(self, contacts: ContactWrenches) -> Skeleton:
        """With the mass that a fit of these forces would use."""
        if self.fit.subject.mass_kg is not None:
            return self.fit.skeleton
        mask = frame_mask(contacts, self.tracked, None)
        data = com_data(self.fit.skeleton, self.trial.motion, contacts, mask)
        mass = mass_from_forces([data], Settings().com)
        return self.fit.skeleton if mass is None else with_mass(self.fit.skeleton, mass.mass_kg)

    @property
    def tracked(self) -> Bool[np.ndarray, " frames"]:
        return self.trial.marker_errors.seen_share >= Settings().kinematics.fewest_seen_share

    def proposed(self, plates: tuple[ForcePlate, ...]) -> Bool[np.ndarray, "frames feet"]:
        contacts = self.assigned(self.conditioned(plates))
        skeleton = self.skeleton(contacts)
        proposals = detect(skeleton, self.trial.motion, contacts, plates, tracked=self.tracked)
        return missing_force(
            proposals, contacts.foot_bodies, contacts.frames, Settings().detection.confidence
        )

    def removed(self, plates: tuple[ForcePlate, ...]) -> Bool[np.ndarray, "frames feet"]:
        """Per foot: whether more than 20 N was taken away."""
        whole, rest = self.conditioned(self.trial.capture.plates), self.conditioned(plates)
        taken = np.column_stack(
            [
                np.linalg.norm(np.nan_to_num(a.force_raw_ground - b.force_raw_ground), axis=1)
                for a, b in zip(whole, rest, strict=True)
            ]
        )
        owners = self.assigned(whole).plate
        feet = range(len(self.fit.subject.foot_bodies))
        return np.column_stack([((taken > REMOVED_N) & (owners == f)).any(axis=1) for f in feet])


def score(
    truth: Bool[np.ndarray, " frames"],
    proposed: Bool[np.ndarray, " frames"],
    counted: Bool[np.ndarray, " frames"],
) -> Score:
    """Frames found, missed and falsely proposed, those at the truth's borders left out."""
    counted = counted.copy()
    for edge in np.flatnonzero(truth[1:] != truth[:-1]) + 1:
        counted[max(0, edge - BORDER) : edge + BORDER] = False
    return Score(
        int((truth & proposed & counted).sum()),
        int((truth & ~proposed & counted).sum()),
        int((~truth & proposed & counted).sum()),
    )


def cases(only: str = "") -> Iterator[tuple[str, Case]]:
    for folder, name, start, end in RECORDINGS:
        if only in folder:
            settings = replace(Settings(), trajectory=replace(Settings().trajectory, enabled=False))
            fit = solve(open_subject(data_folder() / folder), settings, trials=[name])
            trial = fit.trials[0]
            yield f"{folder} {name}", Case(fit, trial, start, end or trial.motion.frames)


def evaluate(case: Case, kind: Callable, seed: int) -> tuple[Score, Score]:
    """Hide, detect, count: frames of which any foot is missing, and frames of each foot."""
    plates = case.trial.capture.plates
    hidden = hide(plates, kind(stances(plates), np.random.default_rng(seed)))
    truth, proposed = case.removed(hidden), case.proposed(hidden)
    counted = np.zeros(len(truth), dtype=bool)
    counted[case.start : case.end] = True
    feet = [score(truth[:, f], proposed[:, f], counted) for f in range(truth.shape[1])]
    return score(truth.any(axis=1), proposed.any(axis=1), counted), sum(feet, Score())


def main() -> None:
    """Print the table."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.detection", description=__doc__)
    arguments.add_argument("--only", default="", help="part of a recording's folder name")
    arguments.add_argument("--seeds", type=int, default=10)
    chosen = arguments.parse_args()
    totals = {kind: (Score(), Score()) for kind in KINDS}
    print("| recording | false frames as measured | " + " | ".join(KINDS) + " |")
    print("|---" * (len(KINDS) + 2) + "|")
    for name, case in cases(chosen.only):
        clean = case.proposed(case.trial.capture.plates)[case.start : case.end].any(axis=1).sum()
        cells = []
        for label, kind in KINDS.items():
            frames, feet = Score(), Score()
            for seed in range(chosen.seeds):
                a, b = evaluate(case, kind, seed)
                frames, feet = frames + a, feet + b
            totals[label] = (totals[label][0] + frames, totals[label][1] + feet)
            cells.append(_cell(frames, feet))
        print(f"| {name} | {clean} | " + " | ".join(cells) + " |", flush=True)
    print("| all | | " + " | ".join(_cell(*totals[k]) for k in KINDS) + " |")


def _cell(frames: Score, feet: Score) -> str:
    return (
        f"{100 * frames.recall:.1f} / {100 * frames.precision:.1f} % "
        f"(per foot {100 * feet.recall:.1f} / {100 * feet.precision:.1f})"
    )


if __name__ == "__main__":
    main()
