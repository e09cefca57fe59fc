"""Detection of missing force, against forces hidden at random and against people's labels; into DETECTION.md.

    python -m benchmarks.detection [--only NAME] [--seeds 10]

Forces are hidden in the plates as recorded: whole stances; one of two feet in double support; the late half
of a stance (a foot that leaves a plate's edge); a stance scaled down by 30 to 60 % (a foot half on the
plate). Truth: frames on which more than 20 N was removed; two frames beside its borders do not count.
What differs from people's labels, and why: [contact](../docs/explanation/contact.md#how-good-it-is).
"""

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.markdown import write_section
from benchmarks.recordings import data_folder
from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import ConditionedPlate, condition
from solver.capture.subject.opened_subject import open_subject
from solver.contact.assignment import assign
from solver.contact.detected_ranges import Proposal, missing_force
from solver.contact.detection import detect
from solver.contact.mask import frame_mask
from solver.contact.wrenches import ContactWrenches
from solver.dynamics.com_trajectory import com_data
from solver.dynamics.mass import mass_from_forces
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.skeleton.forward import body_poses
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

REMOVED_N = 20.0  # more than this on a plate: it carries somebody; taken away: the frame's force is missing
SHORTEST_STANCE_S = 0.1
SHORTEST_DOUBLE_S = 0.03
HIDDEN_SHARE = 1 / 3  # of a trial's stances or double supports, and at least one
SCALED_DOWN = (0.3, 0.6)  # share removed


@dataclass(frozen=True)
class Stretch:
    """A time during which one plate's force is multiplied by what is kept of it."""

    plate: int
    start: float  # [s]
    end: float  # [s]
    kept: float = 0.0


Hider = Callable[[Sequence[Stretch], np.random.Generator], list[Stretch]]


def stances(plates: Sequence[ForcePlate]) -> list[Stretch]:
    """When each plate carries more than 20 N."""
    found = []
    for k, plate in enumerate(plates):
        pressed = np.concatenate([[False], plate.force_ground[:, 1] > REMOVED_N, [False]])
        edges = np.flatnonzero(pressed[1:] != pressed[:-1]).reshape(-1, 2)
        found += [
            Stretch(k, plate.start_time + a / plate.rate, plate.start_time + b / plate.rate)
            for a, b in edges
            if b - a > SHORTEST_STANCE_S * plate.rate
        ]
    return found


def whole_stances(measured: Sequence[Stretch], rng: np.random.Generator) -> list[Stretch]:
    return _some(measured, rng)


def one_of_two_feet(measured: Sequence[Stretch], rng: np.random.Generator) -> list[Stretch]:
    doubles = []
    for i, one in enumerate(measured):
        for other in measured[i + 1 :]:
            start, end = max(one.start, other.start), min(one.end, other.end)
            if other.plate != one.plate and end - start > SHORTEST_DOUBLE_S:
                doubles.append((Stretch(one.plate, start, end), Stretch(other.plate, start, end)))
    return [pair[rng.integers(2)] for pair in _some(doubles, rng)]


def late_halves(measured: Sequence[Stretch], rng: np.random.Generator) -> list[Stretch]:
    return [replace(s, start=(s.start + s.end) / 2) for s in _some(measured, rng)]


def scaled_down(measured: Sequence[Stretch], rng: np.random.Generator) -> list[Stretch]:
    return [replace(s, kept=1.0 - rng.uniform(*SCALED_DOWN)) for s in _some(measured, rng)]


def _some(items: Sequence, rng: np.random.Generator) -> list:
    chosen = rng.random(len(items)) < HIDDEN_SHARE
    if len(items) and not chosen.any():
        chosen[rng.integers(len(items))] = True
    return [item for item, wanted in zip(items, chosen, strict=True) if wanted]


KINDS: dict[str, Hider] = {
    "whole stances": whole_stances,
    "one of two feet": one_of_two_feet,
    "late halves": late_halves,
    "scaled down": scaled_down,
}


def hide(plates: Sequence[ForcePlate], hidden: Iterable[Stretch]) -> tuple[ForcePlate, ...]:
    """The recording as if those forces had not been measured, or not all of them."""
    kept = [np.ones(plate.samples) for plate in plates]
    for stretch in hidden:
        times = plates[stretch.plate].times
        kept[stretch.plate][(times >= stretch.start - 1e-9) & (times <= stretch.end + 1e-9)] = stretch.kept
    return tuple(
        replace(
            plate,
            force_ground=plate.force_ground * share[:, None],
            moment_ground=plate.moment_ground * share[:, None],
            cop_ground=np.where(share[:, None] > 0, plate.cop_ground, np.nan),
        )
        for plate, share in zip(plates, kept, strict=True)
    )


PAGE = Path(__file__).parent / "DETECTION.md"
BORDER = 2  # frames on either side of a border that are not counted


@dataclass(frozen=True)
class Recording:
    """A trial, and the frames on which all its forces were measured."""

    folder: str
    trial: str
    start: int = 0
    end: int | None = None


# Before a start given here the other foot still pushes off beside the plates; the Rajagopal walk's is its
# reviewer's window.
WHOLE = (
    Recording("run_treadmill_hamner2013_subject04", "run400"),
    Recording("walk_treadmill_stepwidth", "example1"),
    Recording("walk_gait2354_subject01", "walk1"),
    Recording("opencap_subject4", "squats1"),
    Recording("opencap_subject4", "walking1", 14),
    Recording("opencap_subject6", "walking1", 17),
    Recording("walk_rajagopal2015", "walk", 61, 175),
    Recording("exo_apo_gordon", "NE21"),
)
# Harder: between two steps beside the plates, landings, an unmodelled device, neither trunk nor arms seen.
PARTS = (
    Recording("exo_apo_gordon", "ET21"),
    Recording("opencap_subject4", "walkingTO1", 18),
    Recording("opencap_subject4", "DJ1", 112),
    Recording("opencap_reviewed", "DJ1", 78),
    Recording("synthetic_arnold2013_subject01", "trial"),
    Recording("sprint_overground_dorn2012_JA1_9ms", "JA1Gait35", 70, 295),
    Recording("overground_camargo2021_AB06", "levelground_ccw_fast_01_01", 22, 1080),
    Recording("c3d_lab_trials/lasem_FAILT01", "Walk01", 418, 498),
)
LABELLED = (Recording("walk_rajagopal2015", "walk"), Recording("opencap_reviewed", "DJ1"))


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
        return self.found / (self.found + self.missed) if self.found + self.missed else float("nan")

    @property
    def precision(self) -> float:
        """Share of the proposed frames that were hidden."""
        return self.found / (self.found + self.false) if self.found + self.false else float("nan")


@dataclass(frozen=True)
class Case:
    """One trial whose markers are fitted, to be judged with one set of forces after another."""

    fit: Fit
    trial: TrialFit
    counted: Bool[np.ndarray, " frames"]

    @property
    def plates(self) -> tuple[ForcePlate, ...]:
        """As recorded."""
        return self.trial.capture.plates

    def proposed(self, plates: Sequence[ForcePlate]) -> Bool[np.ndarray, "frames feet"]:
        """Per foot: frames that detection is sure enough of."""
        contacts = self.assigned(plates)
        proposals = self.proposals(plates, contacts)
        sure = Settings().detection.confidence
        return missing_force(proposals, contacts.foot_bodies, contacts.frames, sure)

    def proposals(
        self, plates: Sequence[ForcePlate], contacts: ContactWrenches | None = None
    ) -> tuple[Proposal, ...]:
        """What detection says of other forces."""
        contacts = contacts or self.assigned(plates)
        skeleton = self.with_mass_from(contacts)
        return detect(
            skeleton, self.trial.motion, contacts, plates, tracked=self.tracked, settings=Settings().detection
        )

    def removed(self, plates: Sequence[ForcePlate]) -> Bool[np.ndarray, "frames feet"]:
        """Per foot: frames on which more than 20 N was taken away."""
        whole, rest = self._conditioned(self.plates), self._conditioned(plates)
        taken = np.column_stack([_distance(a, b) for a, b in zip(whole, rest, strict=True)])
        contacts = self._assigned(whole)
        feet = range(len(contacts.foot_bodies))
        return np.column_stack([((taken > REMOVED_N) & (contacts.plate == f)).any(axis=1) for f in feet])

    def _conditioned(self, plates: Sequence[ForcePlate]) -> list[ConditionedPlate]:
        return [condition(plate, self.trial.motion.times) for plate in plates]

    def assigned(self, plates: Sequence[ForcePlate]) -> ContactWrenches:
        """Forces by feet."""
        return self._assigned(self._conditioned(plates))

    def _assigned(self, conditioned: list[ConditionedPlate]) -> ContactWrenches:
        return assign(
            conditioned,
            *body_poses(self.fit.skeleton, self.trial.motion.q),
            skeleton=self.fit.skeleton,
            foot_bodies=self.fit.subject.foot_bodies,
            times=self.trial.motion.times,
            settings=Settings().contact,
        )

    def with_mass_from(self, contacts: ContactWrenches) -> Skeleton:
        """With the mass that a fit of these forces would use."""
        skeleton = self.fit.skeleton
        if self.fit.subject.mass_kg is not None:
            return skeleton
        mask = frame_mask(contacts, self.tracked)
        data = com_data(skeleton, self.trial.motion, contacts, mask)
        estimate = mass_from_forces([data], Settings().com)
        return skeleton if estimate is None else with_mass(skeleton, estimate.mass_kg)

    @property
    def tracked(self) -> Bool[np.ndarray, " frames"]:
        """Frames that show enough markers."""
        return self.trial.marker_errors.seen_share >= Settings().kinematics.fewest_seen_share


def _distance(a: ConditionedPlate, b: ConditionedPlate) -> Float[np.ndarray, " frames"]:
    return np.linalg.norm(np.nan_to_num(a.force_raw_ground - b.force_raw_ground), axis=1)


def case_of(recording: Recording) -> Case:
    """Fit the markers of a recording."""
    settings = replace(Settings(), trajectory=replace(Settings().trajectory, enabled=False))
    subject = open_subject(data_folder() / recording.folder)
    fit = solve(subject, settings, trials=[recording.trial])
    trial = fit.trials[0]
    frames = np.arange(trial.motion.frames)
    end = trial.motion.frames if recording.end is None else recording.end
    return Case(fit, trial, (frames >= recording.start) & (frames < end))


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
        found=int((truth & proposed & counted).sum()),
        missed=int((truth & ~proposed & counted).sum()),
        false=int((~truth & proposed & counted).sum()),
    )


def evaluate(case: Case, hider: Hider, seed: int) -> tuple[Score, Score]:
    """Hide, detect, count: frames on which any foot misses force, and frames of each foot."""
    hidden = hide(case.plates, hider(stances(case.plates), np.random.default_rng(seed)))
    truth, proposed = case.removed(hidden), case.proposed(hidden)
    feet = (score(t, p, case.counted) for t, p in zip(truth.T, proposed.T, strict=True))
    return score(truth.any(axis=1), proposed.any(axis=1), case.counted), sum(feet, Score())


def hidden_table(recordings: Iterable[Recording], seeds: int) -> Iterator[str]:
    """Recall and precision, a row for each recording and one for all; false frames of the unchanged one."""
    totals = {kind: (Score(), Score()) for kind in KINDS}
    yield "| recording | false frames, nothing hidden | " + " | ".join(KINDS) + " |"
    yield "|---" * (len(KINDS) + 2) + "|"
    for recording in recordings:
        case = case_of(recording)
        false = int(case.proposed(case.plates).any(axis=1)[case.counted].sum())
        cells = []
        for kind, hider in KINDS.items():
            scores = [evaluate(case, hider, seed) for seed in range(seeds)]
            here = tuple(sum(of, Score()) for of in zip(*scores, strict=True))
            totals[kind] = (totals[kind][0] + here[0], totals[kind][1] + here[1])
            cells.append(_cell(*here))
        yield f"| {recording.folder} {recording.trial} | {false} | {' | '.join(cells)} |"
    yield f"| all | | {' | '.join(_cell(*totals[kind]) for kind in KINDS)} |"


def _cell(frames: Score, feet: Score) -> str:
    if not frames.found + frames.missed:
        return "–"
    return (
        f"{100 * frames.recall:.1f} / {100 * frames.precision:.1f} "
        f"({100 * feet.recall:.1f} / {100 * feet.precision:.1f})"
    )


def label_table(recordings: Iterable[Recording]) -> Iterator[str]:
    """Agreement with people's labels: Cohen's κ, and the frames on which only one says 'missing'."""
    yield "| recording | frames | missing: both | neither | only the person | only detection | κ |"
    yield "|---|---|---|---|---|---|---|"
    for recording in recordings:
        case = case_of(recording)
        person = case.trial.capture.imported_missing_force
        assert person is not None
        ours = case.proposed(case.plates).any(axis=1)
        both, neither = int((person & ours).sum()), int((~person & ~ours).sum())
        agreed = (both + neither) / len(ours)
        chance = person.mean() * ours.mean() + (1 - person.mean()) * (1 - ours.mean())
        kappa = (agreed - chance) / (1 - chance)
        yield (
            f"| {recording.folder} {recording.trial} | {len(ours)} | {both} | {neither} "
            f"| {_listed(person & ~ours)} | {_listed(ours & ~person)} | {kappa:.2f} |"
        )


def _listed(flags: Bool[np.ndarray, " frames"]) -> str:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int))).reshape(-1, 2)
    return f"{int(flags.sum())}" + "".join(f" [{a}:{b}]" for a, b in edges)


INTRODUCTION = """## Forces hidden at random

{date}, `python -m benchmarks.detection --seeds {seeds}`

Recall / precision in % of frames on which any foot misses force (in brackets: of each foot). Forces are
hidden in the plates as recorded, {seeds} times per recording and kind: whole stances; one of two feet in
double support; the late half of a stance; a stance scaled down by 30 to 60 %. Truth: frames on which more
than {removed:g} N was removed; {border} frames beside its borders do not count.
"""


def tables(only: str, seeds: int) -> Iterator[str]:
    """The page's lines.

    Args:
        only: part of a recording's folder name; empty for all.
        seeds: of the hidden forces, per recording and kind.
    """
    yield INTRODUCTION.format(date=date.today(), seeds=seeds, removed=REMOVED_N, border=BORDER)
    for title, recordings in (("Measured whole", WHOLE), ("Parts of others", PARTS)):
        yield from (f"### {title}", "")
        yield from hidden_table([r for r in recordings if only in r.folder], seeds)
        yield ""
    yield from ("### People's labels", "")
    yield from label_table([r for r in LABELLED if only in r.folder])


def main() -> None:
    """Print the tables, and write the page unless only some recordings were asked for."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.detection", description=__doc__)
    arguments.add_argument("--only", default="", help="part of a recording's folder name; no page is written")
    arguments.add_argument("--seeds", type=int, default=10)
    chosen = arguments.parse_args()
    lines = []
    for line in tables(chosen.only, chosen.seeds):
        print(line, flush=True)
        lines.append(line)
    if not chosen.only:
        write_section(PAGE, "detection", "\n".join(lines))


if __name__ == "__main__":
    main()
