"""The trials of a subject and their fit, loaded when first looked at."""

import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import trimesh

from addb_viewer.jobs.root_folder import check_recorded
from addb_viewer.trial_view.joint_loads import large_joint_load
from addb_viewer.trial_view.proposals import Pending, pending
from addb_viewer.trial_view.replay import BodySize, Replay
from addb_viewer.trial_view.replay_of_fit import fitted_replay, unfitted_replay
from addb_viewer.trial_view.trial_curves import TrialCurves, trial_curves
from annotations.trial_review import TrialReview
from solver.capture.capture import Capture, Subject, UnusedFile
from solver.capture.formats.analog_channels import AnalogChannels, channels_listed, read_analog
from solver.capture.trial import read_trial
from solver.common.notes import Kind, Note, noted
from solver.export.export_places import file_stem, trial_stems
from solver.export.gait_tables import trial_gait
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.fit_summary import FitSummary, TrialFigures
from solver.fitting.results.store import default_folder, has_fit, load_fit
from solver.fitting.settings import settings_for
from solver.fitting.summary import summary
from solver.gait.trial_gait import Gait
from solver.skeleton.bones import body_meshes

KEPT = 4  # replays in memory: the one on the screen and those one goes back to


@dataclass
class Library:
    """One subject. A trial that the fit lacks is shown as measured."""

    subject: Subject
    fit: Fit | None = None
    meshes: dict[str, trimesh.Trimesh] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()  # of the subject; a trial's own are in its replay
    kept: OrderedDict[str, Replay] = field(default_factory=OrderedDict)
    captures: dict[str, Capture] = field(default_factory=dict)  # of trials without a fit
    gaits: dict[str, Gait | None] = field(default_factory=dict)  # of trials that somebody asked about
    analog_kept: tuple[tuple[str, tuple[str, ...]], AnalogChannels | None] | None = None
    results_folder: Path | None = None  # None: the default
    fit_folder: Path | None = None  # where the fit was read; None without one
    fit_time_ns: int = 0  # when it was written there: with the folder, which fit it is
    summarized: tuple[Fit, FitSummary] | None = None
    lock: threading.RLock = field(default_factory=threading.RLock)  # several browsers share one library

    @property
    def results(self) -> Path:
        """Where fit, diagnosis and decisions lie."""
        return self.results_folder or default_folder(self.subject.folder)

    @property
    def is_current(self) -> bool:
        """Whether the kept fit is still the one that was read, or there still is none."""
        try:
            written_ns = (self.results / "fit.json").stat().st_mtime_ns
        except OSError:
            written_ns = 0
        return written_ns == self.fit_time_ns

    @property
    def trials(self) -> tuple[str, ...]:
        """Names of the trials, those of the fit first."""
        fitted = [trial.capture.name for trial in self.fit.trials] if self.fit else []
        return tuple(dict.fromkeys([*fitted, *(trial.name for trial in self.subject.trials)]))

    def replay(self, name: str) -> Replay:
        """One trial, ready to be drawn.

        Raises:
            CaptureError: its files cannot be read.
        """
        with self.lock:
            if name not in self.kept:
                self.kept[name] = self._load(name)
                while len(self.kept) > KEPT:
                    self.kept.popitem(last=False)
            self.kept.move_to_end(name)
            return self.kept[name]

    def capture(self, name: str) -> Capture:
        """One trial as it was measured.

        Raises:
            CaptureError: its files cannot be read.
        """
        trial = self.fitted(name)
        if trial is not None:
            return trial.capture
        if name not in self.captures:
            files = next(t for t in self.subject.trials if t.name == name)
            reading = settings_for(self.subject.folder).reading
            self.captures[name] = read_trial(files, reading, mass_kg=self.subject.mass_kg)
        return self.captures[name]

    def fitted(self, name: str) -> TrialFit | None:
        """One trial of the fit; None where it has none."""
        trials = () if self.fit is None else self.fit.trials
        return next((trial for trial in trials if trial.capture.name == name), None)

    def stem(self, name: str) -> str:
        """What files of a trial are called."""
        return file_stem(name) if self.fit is None else trial_stems(self.fit)[name]

    def is_fitted(self, name: str) -> bool:
        """Whether the fit has the trial."""
        return self.fitted(name) is not None

    def curves(self, name: str) -> TrialCurves | None:
        """What can be drawn of a trial as curves; None where it is not fitted."""
        trial = self.fitted(name)
        return None if self.fit is None or trial is None else trial_curves(trial, self.fit.skeleton)

    def channels(self, name: str) -> tuple[tuple[str, str], ...]:
        """Name and unit of a trial's analog channels that are no force plate's; no sample is read.

        Raises:
            CaptureError: its files cannot be read.
        """
        return channels_listed(self.capture(name).files)

    def analog(self, name: str, channels: Sequence[str]) -> AnalogChannels | None:
        """Some of these channels; those that were asked for last stay in memory.

        Raises:
            CaptureError: the file cannot be read.
        """
        with self.lock:
            wanted = (name, tuple(channels))
            if self.analog_kept is None or self.analog_kept[0] != wanted:
                self.analog_kept = wanted, read_analog(self.capture(name).files, channels)
            return self.analog_kept[1]

    def proposals(self, replay: Replay, review: TrialReview) -> tuple[Pending, ...]:
        """Of a trial, as detection made them, and what a review says of each."""
        return pending(replay.forces.proposals, review, self.fit.provenance if self.fit else {})

    def knows_gait(self, name: str) -> bool:
        """Whether `gait` tells it at once."""
        return name in self.gaits or not self.is_fitted(name)

    def gait(self, name: str) -> Gait | None:
        """What a trial shows of gait; None where it shows no stance, or is not fitted."""
        trial = self.fitted(name)
        if self.fit is None or trial is None:
            return None
        if name not in self.gaits:
            self.gaits[name] = trial_gait(self.fit, trial)
        return self.gaits[name]

    def figures(self, name: str) -> TrialFigures | None:
        """The trial's part of the fit's summary; None without a fit, and where it has no such trial."""
        if self.fit is None:
            return None
        with self.lock:
            if self.summarized is None or self.summarized[0] is not self.fit:
                self.summarized = self.fit, summary(self.fit)
            return self.summarized[1].trial(name)

    @cached_property
    def _large_torque(self) -> float | None:
        return None if self.fit is None else large_joint_load(self.fit.skeleton, self.fit.trials)

    def _load(self, name: str) -> Replay:
        trial = self.fitted(name)
        if self.fit is not None and trial is not None:
            person = BodySize(self.fit.mass_kg, self.fit.height_m)
            settings, large = self.fit.settings, self._large_torque
            return fitted_replay(trial, self.fit.skeleton, person, settings, large_torque=large)
        return unfitted_replay(self.capture(name), settings_for(self.subject.folder).conditioning)


def library_of(subject: Subject, results: Path | None = None, solve: Path | None = None) -> Library:
    """A subject and its fit, where there is one.

    Args:
        subject: opened.
        results: where fit, diagnosis and decisions lie; `results` inside the subject's folder by default.
        solve: folder of a fit to be shown in place of the kept one.

    Raises:
        ResultsError: there is half a fit, or one of another version.
        OutsideError: it was made of files outside the subject's folder.
    """
    folder = solve or results or default_folder(subject.folder)
    if not has_fit(folder):
        unfitted = noted(Kind.OTHER, "Not fitted yet: markers and forces as measured.")
        notes = (*subject.notes, *_unused(subject.unused), *unfitted)
        return Library(subject, notes=notes, results_folder=results)
    fit, written_ns = load_fit(folder, subject.folder), (folder / "fit.json").stat().st_mtime_ns
    check_recorded(subject, fit)
    bones = body_meshes(fit.skeleton, subject.folder / "Geometry")
    unused = _unused(replace(fit, subject=subject).unused)
    notes = (*subject.notes, *unused, *fit.skeleton.notes, *fit.notes, *bones.notes)
    return Library(
        subject,
        fit,
        bones.meshes,
        notes,
        results_folder=results,
        fit_folder=folder,
        fit_time_ns=written_ns,
    )


def _unused(files: Sequence[UnusedFile]) -> tuple[Note, ...]:
    return noted(Kind.LEFT_OUT, *(f"Not used: {file.file}: {file.reason}" for file in files))
