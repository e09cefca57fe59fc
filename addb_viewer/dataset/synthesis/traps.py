"""Recordings that a release has to leave out, each for one reason: it is the truth about them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from addb_viewer.dataset.synthesis.made_subject import MadeSubject, MadeTrial
from addb_viewer.dataset.synthesis.recording import FEET, RecordedTrial
from addb_viewer.dataset.synthesis.reviewing import said_of
from annotations.activities import ERRONEOUS
from annotations.events import Event, FlagRange, SetActivity, SetStatus, Status

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


def _in_work(trial: RecordedTrial) -> Sequence[Event]:
    return [SetStatus(Status.IN_WORK)]


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
    TrialTrap("not_reviewed", "not_reviewed", _in_work),
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
            return [Expected("subject", f"{root}/{subject.place}", self.reason, self.name)]
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
