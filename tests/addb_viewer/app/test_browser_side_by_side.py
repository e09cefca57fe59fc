"""Two people review six trials of real recordings side by side; the disk is held against their keys."""

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
import pytest

from addb_viewer.app.app import start
from addb_viewer.jobs.review_store import open_log
from addb_viewer.jobs.solving import job_for, solved
from addb_viewer.trial_view.proposals import State
from annotations.events import AcceptProposal, ClearRange, FlagRange, RejectProposal, SetStatus, Status, Undo
from annotations.reasons import REASON_KEYS
from solver.contact.wrenches import RECORDING
from solver.fitting.results.store import load_fit
from solver.fitting.settings import Settings
from tests.addb_viewer.app.ten_trials import write_trials
from tests.patience import PATIENCE_S

pytestmark = [pytest.mark.browser, pytest.mark.real, pytest.mark.timeout(900)]

FEET = ("calcn_r", "calcn_l")
NAMES = ("Zoë", "Bo")
ROUNDS, MOST = 24, 200  # acts of both; on until every trial has been touched
SURE = Settings().detection.confidence
REASONS = {key.key: key.reason for key in REASON_KEYS}


@dataclass
class Ledger:
    """What was pressed by whom, as somebody beside them writes it down."""

    lines: dict = field(default_factory=lambda: defaultdict(list))  # by (subject, trial): (author, what)
    undone: set = field(default_factory=set)
    finished: dict = field(default_factory=dict)  # by (subject, trial): who finished it last

    def write(self, place, author, what):
        self.lines[place].append((author, what))

    def undo(self, place, author):
        """The author's last line that is not undone; False where there is none."""
        lines = self.lines[place]
        for number in reversed(range(len(lines))):
            who, what = lines[number]
            if who == author and what[0] != "undo" and (place, number) not in self.undone:
                self.undone.add((place, number))
                lines.append((author, ("undo", number)))
                return True
        return False

    def in_force(self, place):
        return [
            line
            for number, line in enumerate(self.lines[place])
            if (place, number) not in self.undone and line[1][0] != "undo"
        ]

    def status(self, place):
        kept = self.in_force(place)
        last = next((line for line in reversed(kept) if line[1][0] == "finish"), None)
        return (
            (Status.FINISHED, last[0]) if last else (Status.IN_WORK, None) if kept else (Status.UNSEEN, None)
        )

    def decisions(self, place, frames):
        """1 where a person says that the force counts, −1 where that it does not, 0 where nobody does."""
        said = np.zeros((frames, len(FEET)), dtype=int)
        for _, (kind, *where) in self.in_force(place):
            if kind == "finish":
                continue
            start, end, foot = where[:3]
            part = (slice(start, end), slice(None) if foot is None else FEET.index(foot))
            if kind == "reject":  # what somebody has flagged stays so
                said[part] = np.where(said[part] == -1, -1, 1)
            else:
                said[part] = 1 if kind == "clear" else -1
        return said


class Person:
    """Somebody at a page of their own browser."""

    def __init__(self, name, page, until, ledger, rng):
        self.name, self.page, self.until, self.ledger, self.rng = name, page, until, ledger, rng
        self.just_finished = None  # the trial, until something else has been recorded: U takes it back

    @property
    def session(self):
        return self.page.session

    @property
    def place(self):
        return self.session.shared.name, self.session.shown

    def settle(self):
        """Until all that was pressed has been done."""
        self.session.notices._hand.submit(lambda: None).result(PATIENCE_S)

    def press(self, key, awaited, what):
        self.page.keyboard.press(key)
        self.until(awaited, f"{what} of {self.name} in {self.place}")
        self.settle()

    def edits(self, place):
        shared = next(shared for shared in self.session.trials.subjects.loaded if shared.name == place[0])
        return len(shared.reviews.history(place[1]))

    def write(self, place, what):
        self.ledger.write(place, self.name, what)
        self.just_finished = None

    def act(self):
        kinds = (self.decide, self.paint, self.undo, self.finish)
        kinds[self.rng.choice(4, p=(0.35, 0.35, 0.12, 0.18))]()

    def decide(self):
        """N, and Enter or Backspace, where a proposal is open."""
        self.page.keyboard.press("Home")
        self.until(lambda: self.session.frame == 0, "the first frame")
        review = self.session.review
        if not any(p.state is State.OPEN for p in review.proposals):
            return self.paint()
        presses = 0
        while not (
            review.current and review.chosen == (review.current.proposal.start, review.current.proposal.end)
        ):
            before = (review.chosen, self.session.frame)
            self.press(
                "n", lambda before=before: (review.chosen, self.session.frame) != before, "the next one"
            )
            presses += 1
            if presses > 12:
                return None
        place, proposal, count = self.place, review.current.proposal, self.edits(self.place)
        key, kind = (("Enter", "accept"), ("Backspace", "reject"))[self.rng.integers(2)]
        self.press(key, lambda: self.edits(place) > count, kind)
        self.write(place, (kind, proposal.start, proposal.end, proposal.foot))
        return None

    def paint(self):
        """Home, to a frame, I, on, O, a number key."""
        replay, page = self.session.replay, self.page
        tenth, last = max(1, round(0.1 * replay.rate)), replay.frames - 1
        start, length = (int(n) for n in (self.rng.integers(0, 5), self.rng.integers(1, 3)))
        self.press("Home", lambda: self.session.frame == 0, "the first frame")
        for k in range(1, start + 1):
            self.press("Shift+PageDown", lambda k=k: self.session.frame == k * tenth, "a tenth on")
        page.keyboard.press("i")
        for k in range(start + 1, start + length + 1):
            self.press("Shift+PageDown", lambda k=k: self.session.frame == min(k * tenth, last), "a tenth on")
        page.keyboard.press("o")
        frames = (start * tenth, min((start + length) * tenth, last) + 1)
        self.until(lambda: self.session.review.chosen == frames, f"{frames} of {self.name}")
        self.settle()
        about = self.session.review.about
        place, count = self.place, self.edits(self.place)
        key = str(self.rng.integers(0, 10))
        self.press(key, lambda: self.edits(place) > count, f"key {key}")
        what = ("clear", *frames, about) if key == "0" else ("flag", *frames, about, REASONS[key])
        self.write(place, what)

    def undo(self):
        place, self.just_finished = self.just_finished or self.place, None
        count = self.edits(place)
        if self.ledger.undo(place, self.name):
            self.press("u", lambda: self.edits(place) > count, "the undo")
        else:
            self.page.keyboard.press("u")
            self.settle()

    def finish(self):
        """T; where it says something first, T again or Esc by chance."""
        place, questions = self.place, self.session.questions
        count = self.edits(place)
        self.press("t", lambda: questions.waits or self.edits(place) > count, "the end, or a question")
        if questions.waits and self.edits(place) == count:
            if self.rng.integers(2):
                self.press("Escape", lambda: not questions.waits, "no")
                self.settle()
                return
            self.press("t", lambda: self.edits(place) > count, "the end")
        self.write(place, ("finish",))
        self.just_finished = place
        self.settle()
        if questions.waits:  # it was the last one
            self.press("Escape", lambda: not questions.waits, "the end of the list")


@pytest.mark.slow
def test_what_two_people_press_is_on_the_disk_under_their_names_and_nothing_else(
    real_data, tmp_path, open_page, until
):
    root = tmp_path / "root"
    for name in ("belt", "gait", "runs"):
        write_trials(real_data, root / name, name)
    trials = {(s.name, f"part{n}") for s in root.iterdir() for n in (1, 2)}
    detected = {place: proposals_of(root, place) for place in trials}
    ledger, rng = Ledger(), np.random.default_rng(26)
    app = start(root, port=0)
    people = []
    try:
        people += [Person(name, open_page(app, name=name), until, ledger, rng) for name in NAMES]
        for done in range(MOST):
            if done >= ROUNDS and len(ledger.lines) == len(trials):
                break
            first, second = people
            assert first.place != second.place, "both were offered one trial"
            people[rng.integers(2)].act()
        visit_together(people, ledger, until)
        assert all(person.page.errors == [] for person in people)
    finally:
        for person in people:
            person.page.close()
        app.close()

    assert set(ledger.lines) == trials
    assert len(trials) == 6
    assert {author for lines in ledger.lines.values() for author, _ in lines} == set(NAMES)
    for place in sorted(trials):
        with open_log(root / place[0]) as log:
            history, review = log.history(place[1]), log.review(place[1], FEET)
        assert [(edit.author, told(edit, history)) for edit in history] == ledger.lines[place], place
        status, author = ledger.status(place)
        assert review.status is status, place
        assert status is not Status.FINISHED or review.status_author == author

    for subject in sorted({name for name, _ in trials}):
        for trial in solved(job_for(root / subject)).fit.trials:
            place = (subject, trial.capture.name)
            check_mask(trial, ledger, place, detected[place])


def visit_together(people, ledger, until):
    """Both at one trial, labelling the same frames: the later label counts, both labels are on the disk."""
    first, second = people
    second.page.locator("#addb-place").click()
    second.page.locator("[data-addb-go-to]", has_text=" · ".join(first.place)).click()
    until(lambda: second.place == first.place, "the same trial")
    first.page.get_by_text("Bo is on this trial too.").wait_for()
    for person in (first, second):
        person.settle()
        person.paint()


def told(edit, history):
    """An edit in the ledger's words; an undo names the place of the line that it takes back."""
    match edit.event:
        case FlagRange(start, end, reason, foot):
            return ("flag", start, end, foot, reason)
        case ClearRange(start, end, foot):
            return ("clear", start, end, foot)
        case AcceptProposal(proposal):
            return ("accept", proposal.start, proposal.end, proposal.foot)
        case RejectProposal(proposal):
            return ("reject", proposal.start, proposal.end, proposal.foot)
        case SetStatus(Status.FINISHED):
            return ("finish",)
        case Undo(number):
            return ("undo", [edit.number for edit in history].index(number))
    return edit.event


def proposals_of(root, place):
    fit = load_fit(root / place[0] / "results", root / place[0])
    trial = next(trial for trial in fit.trials if trial.capture.name == place[1])
    return trial.proposals


def check_mask(trial, ledger, place, before):
    """A person's decision where there is one, else detection's; the recording's own gaps in any case."""
    frames = trial.motion.frames
    said = ledger.decisions(place, frames)
    finished = ledger.status(place)[0] is Status.FINISHED
    expected = np.ones((frames, len(FEET)), dtype=bool)
    for found in before if finished else trial.proposals:
        if found.confidence >= SURE:
            lane = slice(None) if found.foot is None else FEET.index(found.foot)
            expected[slice(*found.range), lane] = False
    expected = np.where(said == 0, expected, said == 1)
    for (first, end, foot, _), source in zip(trial.mask.reasons, trial.mask.sources, strict=True):
        if source == RECORDING:
            expected[first:end, slice(None) if foot is None else FEET.index(foot)] = False
    np.testing.assert_array_equal(trial.mask.counts, expected, err_msg=str(place))
