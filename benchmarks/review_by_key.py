"""A reviewer of twenty trials who knows the truth and has only keys: what they decide, and by how many keys.

Ten trials are real: eight of treadmills, on which every step is measured, and two of a walk whose unmeasured
steps its README names. Ten are synthetic, of five persons: a walk with one step beside the plates, and a run.
All are fitted by the solver. Then proposals are planted on steps that were measured, sure and unsure ones,
and in three walks the step beside the plates is hidden from detection. The keys go to a running app as its
page sends them, and are acted on as any others. Solves are stood in for (`stand_in_solve.py`): what they find
is not what is asked about. The decisions are read from the review logs afterwards.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from unittest import mock

import numpy as np
from jaxtyping import Bool

from addb_viewer.app.app import ReviewApp, start
from addb_viewer.app.queue.controller import READ_S
from addb_viewer.app.subjects.library import library_of
from addb_viewer.jobs.review_store import open_log
from addb_viewer.trial_view.forces_in_use import mask_now, stale
from addb_viewer.trial_view.frame_ranges import place_of
from addb_viewer.trial_view.proposals import State
from addb_viewer.trial_view.replay import Replay
from annotations.events import Status
from benchmarks.recordings import data_folder
from solver.capture.subject.subject import open_subject
from solver.contact.contact_phases import ContactPhase
from solver.contact.proposals import NOT_OVER_FORCE_PLATE, Proposal
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.results.store import has_fit, save_fit
from solver.fitting.settings import Settings
from solver.simulate.demo import write_demo_subject
from tests.addb_viewer.app.paper_browser import PaperBrowser
from tests.addb_viewer.app.ten_trials import RECORDINGS, write_windows

Ranges = tuple[tuple[str, float, float], ...]  # foot, from, until [s]

REAL = {
    "walks": RECORDINGS["walks"].windows,
    "runs": (*RECORDINGS["runs"].windows, (2.5, 3.2)),
    "belt": (*RECORDINGS["belt"].windows, (3.4, 4.3)),
    "gait": RECORDINGS["gait"].windows,
}
UNMEASURED: dict[str, Ranges] = {
    "walks": (
        ("calcn_r", 0.01, 0.09), ("calcn_l", 0.16, 0.61), ("calcn_r", 1.72, 2.15), ("calcn_l", 2.24, 2.68),
        ("calcn_r", 2.73, 2.81),
    )
}  # by the data's README, from foot markers and plates alone  # fmt: skip
PERSONS = 5  # that are made up, with a walk and a run each
HIDDEN = (("person1", "walk"), ("person2", "walk"), ("person3", "walk"))  # steps that detection is to miss
SURE, UNSURE = 0.9, 0.6  # certainties of planted proposals, to either side of what a fit obeys
PLANTED = {
    ("runs", "part1"): SURE, ("runs", "part2"): UNSURE, ("belt", "part1"): SURE, ("belt", "part2"): UNSURE,
    ("gait", "part1"): SURE, ("person4", "run"): UNSURE, ("person5", "run"): SURE,
}  # proposals on a step that was measured, by trial  # fmt: skip
HALF = 0.5  # of a step's frames: what is said of more of them is said of the step
MOST_KEYS = 60  # in a trial: a reviewer who needs more is lost
FEWEST_FRAMES = 8  # of a step that a proposal is planted on


@dataclass
class Count:
    """What one trial took."""

    place: tuple[str, str]
    proposals: int
    wrong: int  # of these
    missed: int  # steps without a proposal
    keys: list[str] = field(default_factory=list)

    @property
    def by_shift_t(self) -> bool:
        """Whether all proposals were right and were accepted at once."""
        return SHIFT_T in self.keys


ACCEPT, REJECT, NEXT = "Accept the proposal", "Reject the proposal", "Next proposal or flagged range"
WORST, FOOT, FLAG = "Worst frame that counts", "Foot: right, left, both", "Flag: foot contact but no force"
SOLVE, YES = "Solve again", "Yes, to the question"
T, SHIFT_T = "Finish the trial, go to the next", "Accept what is sure, finish, go to the next"


def make_root(root: Path) -> dict[tuple[str, str], Ranges]:
    """Write the subjects, unless that has been done.

    Returns:
        By subject and trial, the contacts that no plate measured.
    """
    kept = root / "truth.json"
    if kept.exists():
        rows = json.loads(kept.read_text())
        return {(subject, trial): tuple(tuple(s) for s in steps) for subject, trial, steps in rows}
    truth: dict[tuple[str, str], Ranges] = {}
    for name, windows in REAL.items():
        recording = replace(RECORDINGS[name], windows=windows)
        write_windows(recording, data_folder() / recording.folder, root / name)
        truth |= {(name, f"part{k + 1}"): UNMEASURED.get(name, ()) for k in range(len(windows))}
    for k in range(1, PERSONS + 1):
        made = write_demo_subject(root / f"person{k}", np.random.default_rng(100 + k), trials=("walk", "run"))
        truth |= {(f"person{k}", trial): made.off_plate[trial] for trial in ("walk", "run")}
    kept.write_text(json.dumps([(*place, steps) for place, steps in truth.items()]))
    return truth


def fit_subject(root: Path, name: str, truth: Mapping[tuple[str, str], Ranges]) -> None:
    """Fit one of them, unless that has been done, and plant what is to be planted."""
    if not has_fit(root / name / "results"):
        print("fitting", name, flush=True)
        fit = solve(open_subject(root / name), Settings())
        save_fit(_planted(name, fit, truth), root / name / "results")


def _planted(name: str, fit: Fit, truth: Mapping[tuple[str, str], Ranges]) -> Fit:
    """With proposals that are wrong, and without those of the steps that detection is to miss."""
    return replace(fit, trials=tuple(_planted_trial((name, t.capture.name), t, truth) for t in fit.trials))


def _planted_trial(
    place: tuple[str, str], trial: TrialFit, truth: Mapping[tuple[str, str], Ranges]
) -> TrialFit:
    assert trial.mask is not None
    assert trial.contacts is not None
    assert trial.dynamics is not None
    counts, proposals, feet = trial.mask.counts.copy(), trial.proposals, trial.contacts.foot_bodies
    times = trial.capture.markers.times
    missing = missing_frames(times, feet, truth[place])
    reasons = trial.mask.reasons
    if place in HIDDEN:
        about = [(p, missing[slice(*p.range), feet.index(str(p.foot))]) for p in proposals]
        hidden = [p for p, frames in about if frames.mean() > HALF]
        proposals = tuple(p for p in proposals if p not in hidden)
        for p in hidden:
            counts[slice(*p.range), feet.index(str(p.foot))] = True
        gone = {(*p.range, p.foot) for p in hidden}
        reasons = tuple(r for r in reasons if r[:3] not in gone)
    if place in PLANTED:
        start, end, foot = _measured_step(trial.contacts.in_contact & ~missing & counts, feet)
        proposals = (*proposals, Proposal((start, end), foot, NOT_OVER_FORCE_PLATE, PLANTED[place], {}))
        if PLANTED[place] == SURE:
            counts[start:end, feet.index(foot)] = False
            reasons = (*reasons, (start, end, foot, NOT_OVER_FORCE_PLATE))
    mask = replace(trial.mask, counts=counts, reasons=reasons, decided_by=None, sources=())
    dynamics = replace(trial.dynamics, used=trial.contacts.observed & mask.all_feet)
    return replace(trial, mask=mask, proposals=proposals, dynamics=dynamics)


def _measured_step(measured: Bool[np.ndarray, "frames feet"], feet: Sequence[str]) -> tuple[int, int, str]:
    """The first one that is long enough."""
    for k, foot in enumerate(feet):
        edges = np.flatnonzero(np.diff(np.r_[0, measured[:, k].astype(int), 0]))
        for first, last in edges.reshape(-1, 2):
            if last - first >= FEWEST_FRAMES:
                return int(first), int(last), foot
    raise ValueError("no step is measured long enough")


def missing_frames(times: np.ndarray, feet: Sequence[str], truth: Ranges) -> Bool[np.ndarray, "frames feet"]:
    """Where a foot's force is missing in truth.

    Args:
        times: of the frames [s].
        feet: bodies.
        truth: contacts that no plate measured.
    """
    missing = np.zeros((len(times), len(feet)), dtype=bool)
    for foot, since, until in truth:
        missing[(times >= since) & (times <= until), list(feet).index(foot)] = True
    return missing


class Reviewer:
    """Somebody who knows the truth, at a browser without a picture."""

    def __init__(self, app: ReviewApp, truth: Mapping[tuple[str, str], Ranges]) -> None:
        self.browser, self.truth = PaperBrowser(app.server.get_port(), name="Ada"), truth
        (self.session,) = self.browser.until(lambda: list(app.sessions.values()), "the page")
        self.browser.session = self.session  # whose notices are read
        self.browser.until(lambda: self.session.replay is not None, "the trial")
        self.session.notices._hand.submit(lambda: None).result()  # after all of the entrance
        self.browser.until(lambda: "worst first" in self.browser.html(), "the queue")
        self.count = Count(("", ""), 0, 0, 0)

    @property
    def place(self) -> tuple[str, str]:
        """Subject and trial on the screen."""
        replay = self.session.replay
        return self.session.shared.name, replay.name if replay else ""

    @property
    def replay(self) -> Replay:
        """The trial on the screen."""
        assert self.session.replay is not None
        return self.session.replay

    @property
    def missing(self) -> Bool[np.ndarray, "frames feet"]:
        """The truth about it."""
        return missing_frames(self.replay.times, self.replay.feet, self.truth[self.place])

    def press(self, label: str, until: Callable[[], object], what: str) -> None:
        """One key, and what is seen then."""
        self.count.keys.append(label)
        if len(self.count.keys) > MOST_KEYS:
            raise RuntimeError(f"lost in {self.place}: {self.count.keys}")
        self.browser.press(label)
        self.browser.until(until, f"{what} in {self.place}")
        self.session.notices._hand.submit(lambda: None).result()  # what the app does by itself after it

    def review(self) -> Count:
        """The trial on the screen, up to the next one."""
        session, place = self.session, self.place
        waiting = [p for p in session.review.proposals if p.state is State.OPEN]
        right = [self.is_right(*place_of(p)) for p in waiting]
        missed = list(self.missed())
        self.count = Count(place, len(waiting), right.count(False), len(missed))
        sure = all(p.proposal.confidence >= self.replay.forces.confidence for p in waiting)
        if waiting:
            self.press(NEXT, lambda: session.review.current, "the first proposal")
        if waiting and all(right) and sure and not missed:
            self.finish(SHIFT_T)
            return self.count
        while (current := session.review.current) is not None and waiting:
            edits = session.review.recorded
            label = ACCEPT if self.is_right(*place_of(current)) else REJECT
            self.press(label, lambda edits=edits: session.review.recorded > edits, "the decision")
        for phase in missed:
            self.flag(phase)
        if stale(self.replay, session.review.review):
            self.press(SOLVE, lambda: session.shared.fits.new is not None, "the solve")
            self.press(YES, lambda: session.shared.fits.new is None, "the fit")
        self.finish(T)
        return self.count

    def flag(self, phase: ContactPhase) -> None:
        """A step that detection missed is where the residual is largest."""
        session, foot = self.session, self.replay.feet[phase.foot]
        told = len(self.browser.notices)
        self.press(WORST, lambda: len(self.browser.notices) > told, "the worst frame")
        if not phase.start <= session.frame < phase.end:
            raise RuntimeError(f"the worst frame of {self.place}, {session.frame}, is not in {phase}")
        others = [p for p in self.replay.forces.contacts if p.start <= session.frame < p.end]
        while len(others) > 1 and session.review.about != foot:
            about = session.review.about
            self.press(FOOT, lambda about=about: session.review.about != about, "the foot")
        edits = session.review.recorded
        self.press(FLAG, lambda: session.review.recorded > edits, "the flag")

    def finish(self, label: str) -> None:
        """T or Shift T, and again where it says something first."""
        place, session = self.place, self.session
        gone = lambda: self.has_left(place) or session.finishing._told or self.is_all()  # noqa: E731
        self.press(label, gone, "the next trial")
        if session.finishing._told:
            time.sleep(READ_S)  # what is said has to be read
            self.press(label, lambda: self.has_left(place) or self.is_all(), "the next trial")

    def has_left(self, place: tuple[str, str]) -> bool:
        """Whether another trial is on the screen."""
        return self.session.replay is not None and self.place != place

    def is_all(self) -> bool:
        """Whether the app says that nothing is left."""
        return self.browser.told("Every trial of the queue has been reviewed")

    def is_right(self, start: int, end: int, foot: str | None) -> bool:
        """Whether most of a range's frames miss a force in truth."""
        which = slice(None) if foot is None else [self.replay.feet.index(foot)]
        return bool(self.missing[start:end, which].mean() > HALF)

    def missed(self) -> Iterator[ContactPhase]:
        """Steps without a force that no proposal is about."""
        proposed = np.zeros_like(self.missing)
        for p in self.session.review.proposals:
            start, end, foot = place_of(p)
            proposed[start:end, slice(None) if foot is None else self.replay.feet.index(foot)] = True
        for phase in self.replay.forces.contacts:
            frames = slice(phase.start, phase.end), phase.foot
            if self.missing[frames].mean() > HALF and proposed[frames].mean() <= HALF:
                yield phase


def right_decisions(root: Path, place: tuple[str, str], truth: Ranges) -> tuple[bool, int]:
    """Whether, of every step of a finished trial, the log says what is true; and of how many steps.

    Args:
        root: of the subjects.
        place: subject and trial.
        truth: contacts that no plate measured.
    """
    folder, trial = root / place[0], place[1]
    library = library_of(open_subject(folder))
    replay = library.replay(trial)
    with open_log(folder) as log:
        review = log.review(trial, library.subject.foot_bodies)
    mask = mask_now(replay, review)
    assert mask is not None
    assert review.status is Status.FINISHED
    missing = missing_frames(replay.times, replay.feet, truth)
    steps = [(slice(p.start, p.end), p.foot) for p in replay.forces.contacts]
    right = [(missing[s].mean() > HALF) == ((~mask.counts[s]).mean() > HALF) for s in steps]
    return all(right), len(steps)


def reviewed(root: Path, truth: Mapping[tuple[str, str], Ranges]) -> list[Count]:
    """All trials by key."""
    with (
        mock.patch("addb_viewer.app.subjects.shared_subject.SOLVE_WORKER", ("benchmarks.stand_in_solve",)),
        mock.patch("addb_viewer.app.subjects.shared_subject.SharedSubject.hold_out"),
        mock.patch("addb_viewer.app.jobs.what_if.WhatIf.warm"),
        mock.patch("addb_viewer.jobs.processes.give_way"),  # a stand-in has nothing to give way to
    ):
        app = start(root, port=0)
        try:
            reviewer = Reviewer(app, truth)
            counts = []
            while not reviewer.is_all():
                counts.append(reviewer.review())
                print(*counts[-1].place, len(counts[-1].keys), counts[-1].keys, flush=True)
            reviewer.browser.close()
        finally:
            app.close()
    return counts


def table(counts: Sequence[Count], right: Mapping[tuple[str, str], bool]) -> str:
    """What came of it, by kind of trial."""
    kinds = {
        "one proposal": [c for c in counts if c.proposals == 1 and not c.missed and not c.by_shift_t],
        "all right, Shift T": [c for c in counts if c.by_shift_t],
        "several proposals": [c for c in counts if c.proposals > 1 and not c.missed and not c.by_shift_t],
        "a step missed by detection": [c for c in counts if c.missed],
        "nothing to decide": [c for c in counts if not c.proposals and not c.missed],
        "all": list(counts),
    }
    rows = [
        f"| {kind} | {len(of)} | {sum(c.proposals for c in of)} | {sum(c.wrong for c in of)} | "
        f"{sum(c.missed for c in of)} | {sum(right[c.place] for c in of)} | "
        f"{np.mean([len(c.keys) for c in of]):.1f} | {max(len(c.keys) for c in of)} |"
        for kind, of in kinds.items()
        if of
    ]
    solved = sum(c.keys.count(SOLVE) + c.keys.count(YES) for c in counts)
    return "\n".join(
        [
            "| trials | of them | proposals | wrong | missed | decided as is true | keys, mean | most |",
            "|---|---|---|---|---|---|---|---|",
            *rows,
            "",
            f"No click. {solved} of the {sum(len(c.keys) for c in counts)} keys are for solving and keeping.",
        ]
    )


def main() -> None:
    """Make the trials, review them, and print what it took."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.review_by_key", description=__doc__)
    arguments.add_argument("root", type=Path, help="folder that the trials are made in, and kept")
    arguments.add_argument("--only-fit", action="store_true", help="review nothing yet")
    given = arguments.parse_args()
    root = given.root
    root.mkdir(parents=True, exist_ok=True)
    truth = make_root(root)
    for name in dict.fromkeys(subject for subject, _ in truth):
        fit_subject(root, name, truth)
    if given.only_fit:
        return
    for log in root.glob("*/annotations.sqlite*"):
        log.unlink()
    counts = reviewed(root, truth)
    judged = {place: right_decisions(root, place, truth[place]) for place in truth}
    print(table(counts, {place: right for place, (right, _) in judged.items()}))
    print(f"{sum(steps for _, steps in judged.values())} steps in all.")


if __name__ == "__main__":
    main()
