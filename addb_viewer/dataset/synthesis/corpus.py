"""A corpus of synthetic people: folders as laboratories would hand them over, the truth kept aside."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.synthesis.movements import LABORATORIES, Actors, Laboratory, Wearer, drawn_person
from addb_viewer.dataset.synthesis.synthetic_subject import (
    FEET,
    MadeSubject,
    MadeTrial,
    RecordedTrial,
    recorded,
    said_of,
    write_subject_folder,
    write_truth,
)
from annotations.activities import ERRONEOUS
from annotations.events import Event, FlagRange, SetActivity, SetStatus, Status, Unusable
from solver.capture.atomic import write_whole

FEW_COUNTING = 10  # frames; a fit to the forces needs 20
SHORT_S = 0.045  # 10 frames at 200 Hz, fewer in slower recordings; 5 on a release's grid
STUB_S = 0.06  # what an erroneous stretch leaves at a trial's end
FEW_MARKERS = ("C7", "CLAV", "STRN")


@dataclass(frozen=True)
class Expected:
    """A row that `left_out.parquet` has to hold."""

    level: str
    id: str
    reason: str
    trap: str


def static_rows(subject: MadeSubject) -> list[Expected]:
    """Of its static trial, which is left out of every release."""
    return [Expected("trial", f"{subject.subject_id}/{subject.static.name}", "static", "static")]


Told = Callable[[RecordedTrial], Sequence[Event]]


@dataclass(frozen=True)
class TrialTrap:
    """One more trial of a good subject."""

    name: str
    reason: str
    said: Told
    seconds: float | None = 0.6
    without_forces: bool = False
    level: str = "trial"

    def made(self, trial: RecordedTrial) -> MadeTrial:
        """The trial as reviewers and files have it."""
        if self.without_forces:
            trial = replace(trial, capture=replace(trial.capture, plates=()))
        return MadeTrial(trial, tuple(self.said(trial)), trap=self.name)

    def rows(self, subject: MadeSubject, trial: str) -> list[Expected]:
        """What a release has to say of it."""
        return [Expected(self.level, f"{subject.subject_id}/{trial}", self.reason, self.name)]


def _finished(trial: RecordedTrial) -> Sequence[Event]:
    return said_of(trial, labelled=False)


def _unusable(trial: RecordedTrial) -> Sequence[Event]:
    return [SetStatus(Status.FINISHED, "the trunk's markers came off", unusable=Unusable.ANGLES)]


def _nothing_counts(trial: RecordedTrial) -> Sequence[Event]:
    return [FlagRange(0, trial.capture.markers.frames, "manualReview"), SetStatus(Status.FINISHED)]


def _little_counts(trial: RecordedTrial) -> Sequence[Event]:
    after = trial.capture.markers.frames
    return [FlagRange(FEW_COUNTING, after, "manualReview"), SetStatus(Status.FINISHED)]


def _stub(trial: RecordedTrial) -> Sequence[Event]:
    frames = trial.capture.markers.frames
    end = frames - round(STUB_S * trial.rate)
    return [SetActivity(frames // 2, end, ERRONEOUS), *said_of(trial, labelled=False)]


TRIAL_TRAPS = (
    TrialTrap("not_reviewed", "not_reviewed", lambda _: [SetStatus(Status.IN_WORK)]),
    TrialTrap("unusable", "unusable", _unusable),
    TrialTrap("no_forces", "no_forces", _finished, without_forces=True),
    TrialTrap("short", "too_short", _finished, seconds=SHORT_S),
    TrialTrap("nothing_counts", "no_counting_frames", _nothing_counts),
    TrialTrap("little_counts", "no_dynamics", _little_counts),
    TrialTrap("stub", "too_short", _stub, seconds=None, level="segment"),
)
"""Trials beside good ones; a stub stays, but for its erroneous stretch and what is too short behind it."""


@dataclass(frozen=True)
class SubjectTrap:
    """A folder of its own."""

    name: str
    reason: str
    spoiled: Callable[[MadeSubject], MadeSubject] = lambda subject: subject
    broken: Callable[[Path], None] | None = None  # a file, after it was written
    level: str = "subject"

    def rows(self, subject: MadeSubject, root: str) -> list[Expected]:
        """What a release has to say of it.

        Args:
            subject: as it was made.
            root: name of the corpus' folder.
        """
        if self.name == "broken_description":
            return [Expected("subject", f"{root}/{subject.subject_id}", self.reason, self.name)]
        if self.level == "trial":
            trials = [
                Expected("trial", f"{subject.subject_id}/{made.recorded.name}", self.reason, self.name)
                for made in subject.trials
            ]
            gone = Expected("subject", subject.subject_id, "no_trials", self.name)
            return [*static_rows(subject), *trials, gone]
        asked_later = self.reason == "fit_failed"
        own = Expected("subject", subject.subject_id, self.reason, self.name)
        return [*static_rows(subject), own] if asked_later else [own]


def _cut_off(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2].rstrip(b'"\n]'))


def _break_markers(folder: Path) -> None:
    for path in folder.glob("*.trc"):
        if path.stem != "static":
            path.write_bytes(path.read_bytes()[:400])


def _with_few_markers(subject: MadeSubject) -> MadeSubject:
    def bare(trial: RecordedTrial) -> RecordedTrial:
        markers = trial.capture.markers
        kept = [k for k, name in enumerate(markers.names) if name.rsplit(":", 1)[-1] in FEW_MARKERS]
        return replace(trial, capture=replace(trial.capture, markers=markers.chosen(kept)))

    trials = tuple(replace(made, recorded=bare(made.recorded)) for made in subject.trials)
    return replace(subject, static=bare(subject.static), trials=trials)


SUBJECT_TRAPS = (
    SubjectTrap("no_licence", "no_licence", lambda subject: replace(subject, licence="")),
    SubjectTrap("restricted", "no_consent", lambda subject: replace(subject, consent="restricted")),
    SubjectTrap("nobody_asked", "no_consent", lambda subject: replace(subject, consent=None)),
    SubjectTrap(
        "three_bodies",
        "not_two_contact_bodies",
        lambda subject: replace(subject, feet=(*FEET, "hand_r")),
    ),
    SubjectTrap("broken_description", "unreadable", broken=lambda folder: _cut_off(folder / "subject.toml")),
    SubjectTrap("broken_markers", "unreadable", broken=_break_markers, level="trial"),
    SubjectTrap("few_markers", "fit_failed", _with_few_markers),
)
"""Folders beside those of good subjects; copies of subjects and of trials are made by the corpus itself."""

REASON_OF: Mapping[str, str] = {
    **{trap.name: trap.reason for trap in TRIAL_TRAPS},
    **{trap.name: trap.reason for trap in SUBJECT_TRAPS},
    "copied_subject": "duplicate_subject",
    "copied_trial": "duplicate_trial",
}


TRUTH = "truth.json"
FAULTS: tuple[tuple[str, ...], ...] = (
    ("off_plate",),
    (),
    (),
    ("late_clock",),
    ("noise",),
    (),
    ("wrong_mass",),
)
WRONG_MASS = 1.12  # entered over true
SECOND_FOLDER_EVERY = 6  # of so many folders one is a second session of the person before
LABELLED_SHARE = 0.7


@dataclass(frozen=True)
class CorpusOptions:
    """What a corpus holds."""

    subjects: int  # good folders; traps come on top
    seed: int = 0
    traps: bool = True
    actors: int | None = 4  # people whose movements are simulated, all others move in similarity; None: all
    activities: tuple[str, ...] = ("walk", "run", "squat", "stand", "landing")
    longest_s: float | None = None  # of a movement; None: as long as it takes
    takes: int = 1  # of an activity: other steps, speeds and squats
    faults: bool = True  # of plates, clocks, markers and entered masses, and second sessions


def truth_folder(root: Path) -> Path:
    """Where the truth about a corpus lies: beside it, so that no build reads it."""
    return root.with_name(f"{root.name}.truth")


def synthesize(
    root: Path, options: CorpusOptions, told: Callable[[str], None] = lambda _: None
) -> list[Expected]:
    """Write a corpus and the truth about it.

    Args:
        root: its folder; must not exist or be empty. The truth goes to `ROOT.truth`.
        options: of the corpus.
        told: whose folder is written.

    Returns:
        What a release of it has to leave out.

    Raises:
        ReleaseError: there is something in the folder, or in that of the truth.
    """
    for place in (root, truth_folder(root)):
        if place.exists() and (not place.is_dir() or any(place.iterdir())):
            raise ReleaseError(f"{place}: is not empty; a corpus is made in a folder of its own.")
    corpus = _Corpus(root, options, told)
    corpus.good()
    if options.traps:
        corpus.traps()
    corpus.finish()
    return corpus.expected


class _Corpus:
    """What has been written so far."""

    def __init__(self, root: Path, options: CorpusOptions, told: Callable[[str], None]) -> None:
        self.root, self.options, self._told = root, options, told
        self.expected: list[Expected] = []
        few = options.actors and min(options.actors, max(options.subjects, 1))
        self._actors = Actors(few, options.seed, options.longest_s)
        self._subjects: list[MadeSubject] = []
        self._wearers: dict[str, Wearer] = {}
        self._about: list[dict[str, object]] = []
        self._numbers: dict[str, int] = {}

    def good(self) -> None:
        """Subjects that a release takes."""
        for k in range(self.options.subjects):
            second = self.options.faults and k % SECOND_FOLDER_EVERY == SECOND_FOLDER_EVERY - 1
            subject = self._made(k, self._subjects[k - 1] if second else None)
            if self.options.traps:
                subject = self._with_trial_traps(subject, k)
            self._subjects.append(subject)
            self._write(subject)
            self.expected += static_rows(subject)

    def traps(self) -> None:
        """Folders that it leaves out, and copies."""
        for number, trap in enumerate(SUBJECT_TRAPS, start=len(self._subjects)):
            made = self._made(number, None, only=("walk",), faults=())
            subject = trap.spoiled(replace(made, trap=trap.name))
            folder = self._write(subject)
            if trap.broken:
                trap.broken(folder)
            self.expected += trap.rows(subject, self.root.name)
        self._copied_subject()

    def finish(self) -> None:
        """The truth's own file."""
        path = truth_folder(self.root) / TRUTH
        path.parent.mkdir(parents=True, exist_ok=True)
        told = {
            "options": asdict(self.options),
            "subjects": self._about,
            "left_out": [asdict(row) for row in self.expected],
        }
        write_whole(path, json.dumps(told, indent=1, sort_keys=True) + "\n")

    def _made(
        self,
        number: int,
        again: MadeSubject | None,
        only: Sequence[str] | None = None,
        faults: Sequence[str] | None = None,
    ) -> MadeSubject:
        """A subject with a trial of every activity of its laboratory; or one more session of a person."""
        rng = np.random.default_rng((self.options.seed, 1000 + number))
        laboratory = again.laboratory if again else LABORATORIES[number % len(LABORATORIES)]
        person = again.person if again else drawn_person(rng)
        who = self._actors.wearer(person, rng, self._wearers[again.person_id] if again else None)
        usual = FAULTS[number % len(FAULTS)] if self.options.faults else ()
        own = usual if faults is None else tuple(faults)
        if laboratory.treadmill and "off_plate" in own:
            own = ("noise",)  # there is nothing beside a belt
        folder = self._next_folder(laboratory)
        subject = MadeSubject(
            laboratory=laboratory,
            person_name=again.person_name if again else folder.replace("S", "P"),
            folder=folder,
            person=person,
            mass_entered_kg=round(person.mass_kg * (WRONG_MASS if "wrong_mass" in own else 1.0), 1),
            static=recorded("static", self._actors.movement(who, "static"), laboratory, (), rng),
            trials=(),
            faults=own,
        )
        self._wearers[subject.person_id] = who
        asked = [one for one in laboratory.activities if one in self.options.activities]
        does = only or [one for one in asked if self._actors.can(who, one)] or ["walk"]
        trials = []
        for activity, take in product(does, range(self.options.takes)):
            name = f"{activity}_{take + 1}"
            movement = self._actors.movement(who, activity, take)
            trial = recorded(name, movement, laboratory, own, rng)
            labelled = bool(rng.random() < LABELLED_SHARE)
            trials.append(MadeTrial(trial, tuple(said_of(trial, labelled=labelled)), labelled=labelled))
        return replace(subject, trials=tuple(trials))

    def _with_trial_traps(self, subject: MadeSubject, number: int) -> MadeSubject:
        """Every trap of a trial once, one subject after the other."""
        rng = np.random.default_rng((self.options.seed, 2000 + number))
        more: list[MadeTrial] = []
        for k, trap in enumerate(TRIAL_TRAPS):
            if k % self.options.subjects != number:
                continue
            name = f"walk_{2 + len(more)}"
            long = trap.seconds is None  # so that the same steps would be a copy
            movement = self._actors.movement(self._wearers[subject.person_id], "walk", int(long))
            trial = recorded(name, movement, subject.laboratory, (), rng, seconds=trap.seconds)
            more.append(trap.made(trial))
            self.expected += trap.rows(subject, name)
            if trap.name == "stub":
                erroneous = Expected("range", f"{subject.subject_id}/{name}", "erroneous", trap.name)
                self.expected.append(erroneous)
        if number == 1:  # of the second source by name, so that the first keeps its recording
            name = f"walk_{2 + len(more)}"
            first = self._subjects[0].trials[0].recorded
            more.append(MadeTrial(replace(first, name=name), (SetStatus(Status.FINISHED),), "copied_trial"))
            row = Expected("trial", f"{subject.subject_id}/{name}", "duplicate_trial", "copied_trial")
            self.expected.append(row)
        return replace(subject, trials=(*subject.trials, *more))

    def _copied_subject(self) -> None:
        """The first person's recordings under another name."""
        of = self._subjects[0]
        folder = self._next_folder(of.laboratory)
        kept = tuple(made for made in of.trials if made.trap is None)
        who = folder.replace("S", "P")
        copy = replace(of, folder=folder, person_name=who, trials=kept, trap="copied_subject")
        self._write(copy)
        self.expected.append(Expected("subject", copy.subject_id, "duplicate_subject", "copied_subject"))

    def _write(self, subject: MadeSubject) -> Path:
        self._told(subject.subject_id)
        folder = write_subject_folder(self.root, subject)
        self._about.append(write_truth(truth_folder(self.root), subject))
        return folder

    def _next_folder(self, laboratory: Laboratory) -> str:
        self._numbers[laboratory.source] = self._numbers.get(laboratory.source, 0) + 1
        return f"S{self._numbers[laboratory.source]:03d}"
