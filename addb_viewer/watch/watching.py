"""A watched folder: trials are claimed as they are written, judged in processes, and told line by line."""

import os
import re
import time
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

from addb_viewer.jobs.processes import THREADS
from addb_viewer.watch import judging
from addb_viewer.watch.verdict_log import (
    LOG,
    Claim,
    Colour,
    Stage,
    VerdictLine,
    append,
    claim,
    log_folder,
    now_utc,
    present,
    read_log,
)
from addb_viewer.watch.what_to_do import STATIC, Told, broken_told, first_told, missed_words, plan_words, told
from addb_viewer.watch.written_trials import Digests, WatchedSubject, WrittenTrial, subjects_below
from solver.capture.formats.text_table import some_of
from solver.common.errors import ResultsError, SolverError
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.fitting.results.store import default_folder
from solver.fitting.state import KeptModel

PROCESSES = 4  # fit, diagnosis, the next trial's first look, and a former diagnosis that takes long
FIT_ALONE_S = 8.0  # after so long since its files rested a trial gets the fit's word without the diagnosis
RENEW_S = 3.0  # a claim is said to live so often
FREE = re.compile(r"[0-9.]+ MB free")  # changes while the disk is as full as before
AGAIN_S = 2.0  # what could not be written, or was another watcher's, is tried again
QUIET_S = 5.0  # without news the folder is looked at so often, should the system have told nothing
BUSY_S = 30.0  # after news it is looked at all the time


@dataclass
class _Judging:
    """A trial that is claimed, and what is known of it."""

    trial: WrittenTrial
    claim: Claim
    first: Future[Any] | None
    fit: Future[Any] | None = None
    diagnosis: Future[Any] | None = None
    fit_is_told: bool = False


class Session:
    """What one watcher knows. Everything is called from one thread; `tick` never waits for a judgement."""

    def __init__(
        self,
        folder: Path,
        out: Path | None = None,
        *,
        say: Callable[[str, VerdictLine, bool], None],
        complain: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Nothing is judged yet.

        Args:
            folder: of a subject, or of several.
            out: where results go, in a folder of each subject's name; None: beside the recordings.
            say: given the subject's name, a new line and whether this watcher added it.
            complain: told what is wrong, each sentence once.
            clock: [s] from any moment on.
        """
        self.folder, self.out = folder, out
        self.subjects: dict[Path, WatchedSubject] = {}
        self.lines: dict[Path, list[VerdictLine]] = {}
        self.troubles: tuple[str, ...] = ()  # that last
        self._say, self._complain, self._clock = say, complain, clock
        self._waiting: list[WrittenTrial] = []
        self._judging: list[_Judging] = []
        self._unwritten: list[tuple[Path, VerdictLine]] = []
        self._own: set[tuple[Path, VerdictLine]] = set()
        self._broken: set[str] = set()  # files at which a process broke down once
        self._refused: tuple[str, ...] = ()  # why nothing can be written
        self._others: dict[WrittenTrial, float] = {}  # trials that another watcher has, and when to ask again
        self._models: dict[
            Path, tuple[KeptModel | None, KeptModel | None]
        ] = {}  # persons', of fit and diagnosis
        self._logs: dict[Path, tuple[int, int]] = {}  # size and time of each log when it was read
        self._again = self._renewed = self._looked = 0.0
        self._news = clock()
        self._pool = self._new_pool()

    def news(self) -> None:
        """Something changed in the folder."""
        self._news = self._clock()

    def tick(self) -> None:
        """Look, claim, collect and tell; as often as four times a second."""
        now = self._clock()
        troubles = self._look(now)
        for one in list(self._judging):
            self._collect(one, now)
        self._start_fit()
        if now - self._renewed >= RENEW_S:
            self._renewed = now
            for one in self._judging:
                one.claim.renew()
        self._tell()
        for trouble in set(troubles) - set(self.troubles):
            self._complain(trouble)
        self.troubles = tuple(dict.fromkeys(troubles))

    @property
    def is_idle(self) -> bool:
        """Whether nothing that was written waits for its verdict."""
        return not (self._waiting or self._judging or self._unwritten)

    def close(self) -> None:
        """Let others judge what is not judged, and end the processes."""
        for one in self._judging:
            one.claim.release()
        for process in active_children():  # they would finish their fits first
            process.kill()
        self._pool.shutdown(wait=False, cancel_futures=True)

    def plan_of(self, subject: str) -> list[tuple[str, bool | None]]:
        """How far the plan of a subject of that name is, as `plan_words` says it."""
        for folder, watched in self.subjects.items():
            if name_of(folder) == subject and watched.subject is not None:
                return plan_words(watched.subject.plan, list(present(self.lines[folder]).values()))
        return []

    def _new_pool(self) -> ProcessPoolExecutor:
        for name in THREADS:
            os.environ.setdefault(name, "1")
        pool = ProcessPoolExecutor(PROCESSES, get_context("spawn"), initializer=judging.begin_worker)
        for _ in range(PROCESSES):
            pool.submit(judging.warm_up)
        return pool

    def _look(self, now: float) -> list[str]:
        """Claim what is written by now, and write what could not be written; what is wrong with that."""
        troubles = []
        if now - self._news < BUSY_S or now - self._looked >= QUIET_S:
            self._looked = now
            try:
                self._find()
            except OSError as error:
                troubles.append(f"{self.folder}: cannot be read ({error.strerror}); is the share there?")
        for watched in self.subjects.values():
            self._waiting += watched.written(now)
            troubles += [watched.trouble] if watched.trouble else []
            if missing := watched.missing(now):
                names = some_of([os.path.relpath(file, watched.folder) for file in missing])
                self._complain(f"{watched.folder}: not there yet, though subject.toml names it: {names}")
        if now >= self._again:
            try:
                self._write_again()
                self._claim(now)
                self._refused = ()
            except SolverError as error:  # the disk is full, or the share is away
                self._again = now + AGAIN_S
                if [FREE.sub("", said) for said in self._refused] != [FREE.sub("", str(error))]:
                    self._refused = (str(error),)
        return [*troubles, *self._refused]

    def _find(self) -> None:
        for place in subjects_below(self.folder):
            if place not in self.subjects:
                self.lines[place] = read_log(self._log(place))
                judged: dict[str, list[Digests]] = {}
                for line in self.lines[place]:
                    judged.setdefault(line.trial, []).append(tuple(line.files.split()))
                self.subjects[place] = WatchedSubject(place, judged)

    def _claim(self, now: float) -> None:
        """Begin with the newest; what another watcher judges waits until that has said its verdict."""
        for trial in sorted(self._waiting, key=lambda trial: -trial.rested):
            if now < self._others.get(trial, 0.0):
                continue
            if not self.subjects[trial.subject].is_current(trial) or self._is_judged(trial):
                self._waiting.remove(trial)
                continue
            mine = claim(self._log(trial.subject), trial.name)
            if mine is None:
                self._others[trial] = now + AGAIN_S
                continue
            self._waiting.remove(trial)
            if trial.static:
                self._add(trial, Stage.STATIC, Told(Colour.NONE, STATIC, ""))
            if trial.static or self._is_judged(trial):  # by whoever had the claim before
                mine.release()
            else:
                former = [line.trial for line in present(self.lines[trial.subject]).values()]
                first = self._submit(judging.first_look, trial.subject, trial.name, former)
                self._judging.append(_Judging(trial, mine, first))

    def _is_judged(self, trial: WrittenTrial) -> bool:
        line = present(read_log(self._log(trial.subject))).get(trial.name)
        return line is not None and line.files == trial.digest and line.is_last

    def _submit(self, *work: Any) -> Future[Any]:
        try:
            return self._pool.submit(*work)
        except BrokenProcessPool:
            self._pool = self._new_pool()
            return self._pool.submit(*work)

    def _start_fit(self) -> None:
        """One trial at a time, the newest first: fit and diagnosis share the cores."""
        ready = [one for one in self._judging if one.fit is None]
        if ready and all(one.fit is None or one.fit_is_told for one in self._judging):
            one = max(ready, key=lambda one: one.trial.rested)
            folder, name = one.trial.subject, one.trial.name
            of_fit, of_diagnosis = self._models.get(folder, (None, None))
            one.fit = self._submit(judging.fit_look, folder, name, of_fit)
            one.diagnosis = self._submit(judging.diagnosis_of, folder, name, self._log(folder), of_diagnosis)

    def _collect(self, one: _Judging, now: float) -> None:
        """Say what is known by now; end where that is all, or the files are others by now."""
        is_last = True  # of files that were replaced: what they are now is handed out once it rests
        if self.subjects[one.trial.subject].is_current(one.trial):
            try:
                is_last = self._say_what_is_known(one, now)
            except BrokenProcessPool as error:
                if one.trial.digest in self._broken:
                    self._add(one.trial, Stage.VERDICT, broken_told(str(error)))
                else:  # perhaps somebody ended it: once more
                    self._broken.add(one.trial.digest)
                    self._waiting.append(one.trial)
            except Exception as error:  # whatever the files can break in there
                self._add(one.trial, Stage.VERDICT, broken_told(" ".join(str(error).split())))
        if is_last:
            self._judging.remove(one)
            if not self._unwritten:  # else the claim ends by itself, and the line is written before
                one.claim.release()

    def _say_what_is_known(self, one: _Judging, now: float) -> bool:
        """Whether that is all."""
        others = (
            line for line in present(self.lines[one.trial.subject]).values() if line.trial != one.trial.name
        )
        former = [(*line.off_zero, *line.about) for line in others if line.stage is not Stage.STATIC]
        kept = [file.name for file in one.trial.kept]
        if one.first is not None and one.first.done():
            found, one.first = one.first.result(), None
            self._add(one.trial, Stage.FIRST, first_told(found, former, kept))
        if one.first is not None or one.fit is None or one.diagnosis is None or not one.fit.done():
            return False
        fit, report = one.fit.result(), None
        if one.diagnosis.done():
            of_diagnosis = self._models.get(one.trial.subject, (None, None))[1]
            with suppress(SolverError):  # no forces, or too few: the fit says so
                looked: judging.DiagnosisLook = one.diagnosis.result()
                report, of_diagnosis = looked.report, looked.model
            self._models[one.trial.subject] = fit.model, of_diagnosis
            self._add(one.trial, Stage.VERDICT, told(fit, report, former, kept), fit, report)
        elif now - one.trial.rested >= FIT_ALONE_S and not one.fit_is_told:
            one.fit_is_told = True
            self._add(one.trial, Stage.FIT, told(fit, None, former, kept, is_last=False), fit)
        return one.diagnosis.done()

    def _add(
        self,
        trial: WrittenTrial,
        stage: Stage,
        said: Told,
        fit: judging.FitLook | None = None,
        report: DiagnosisReport | None = None,
    ) -> None:
        seconds = round(self._clock() - trial.rested, 1)
        texts = said.colour, said.words, said.to_do
        line = VerdictLine(
            trial.name,
            trial.digest,
            stage,
            *texts,
            now_utc(),
            seconds,
            about=said.about,
            against=said.against,
        )
        if fit is not None:
            line = replace(
                line,
                good=not said.against,
                activity=fit.activity,
                right_steps=sum(step.whole and step.side == "Right" for step in fit.steps),
                left_steps=sum(step.whole and step.side == "Left" for step in fit.steps),
                missed=missed_words(fit),
                off_zero=tuple(f"plate_{k}" for k, _ in fit.look.off_zero),
                names=tuple(f"{cause.id} {cause.target}" for cause in report.effects) if report else (),
            )
        self._unwritten.append((trial.subject, line))
        with suppress(SolverError):  # it is told, and tried again, by the next tick
            self._write_again()

    def _write_again(self) -> None:
        while self._unwritten:
            subject, line = self._unwritten[0]
            if append(self._log(subject), line):
                self._own.add((subject, line))
            del self._unwritten[0]

    def _tell(self) -> None:
        """Lines that are new in the logs, whoever wrote them."""
        for subject, before in self.lines.items():
            folder = self._log(subject)
            try:
                stat = (folder / LOG).stat()
                if self._logs.get(subject) == (stat.st_size, stat.st_mtime_ns):
                    continue
                self.lines[subject] = read_log(folder)
            except (OSError, ResultsError):
                continue
            self._logs[subject] = (stat.st_size, stat.st_mtime_ns)
            for line in self.lines[subject][len(before) :]:
                self._say(name_of(subject), line, (subject, line) in self._own)

    def _log(self, subject: Path) -> Path:
        return log_folder(default_folder(subject) if self.out is None else self.out / name_of(subject))


def name_of(subject: Path) -> str:
    """A subject's folder as people call it."""
    return subject.resolve().name
