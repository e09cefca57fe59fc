"""The log of a session: an MCAP file that grows while the app runs and survives a kill up to its last chunk.

    with SessionLog.begin(results, subject) as log:
        for edit in live.log.history():
            log.edit(edit)          # so that the file alone gives the review back
        log.capture(capture)        # a trial is opened
        fit = solve(..., progress=log.watching(progress))
        log.fit(fit)
        log.edit(edit)              # as they are made

Times are wall-clock times; the frames of a trial follow the moment at which it was opened, and every fit of
it lies at the same times, so that two of them can be looked at together. Every call may come from any thread.
When the disk fails, `trouble` says so and nothing is written any more: the session goes on without its log.
"""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from threading import RLock
from types import TracebackType
from typing import IO, Any, Self

import trimesh
from foxglove_schemas_protobuf.Log_pb2 import Log

from addb_viewer.recordings.mcap_file import McapFile
from addb_viewer.recordings.mcap_recording import (
    attach_fit,
    attach_review,
    write_about,
    write_edit,
    write_step,
)
from addb_viewer.recordings.mcap_scene import stamp
from addb_viewer.recordings.mcap_trial import TrialTopics, write_capture, write_causes, write_fit
from addb_viewer.trial_view.recording import recording_of
from addb_viewer.trial_view.replay import Replay
from addb_viewer.trial_view.replay_of_fit import unfitted_replay
from addb_viewer.trial_view.solver_steps import SolverStep
from addb_viewer.trial_view.trial_events import lines_of
from annotations.events import Edit
from solver.capture.capture import Capture
from solver.common.errors import ResultsError
from solver.common.progress import Progress, silent
from solver.fitting.fit import Fit

FOLDER = "sessions"  # in the results folder
SESSION_TOPIC = "/session/log"
FLUSH_EVERY_S = 1.0  # while the solver reports; whatever a person does is flushed at once


class SessionLog:
    """One file, open."""

    def __init__(self, file: Path, subject: str) -> None:
        """Begin a file that is not there yet.

        Args:
            file: its folder must exist.
            subject: whose session it is.

        Raises:
            ResultsError: it is there, or cannot be made.
        """
        self.file, self.trouble = file, ""
        self._lock, self._flushed = RLock(), time.monotonic()
        self._solve_began: float | None = None
        self._trials: dict[str, TrialTopics] = {}
        self._fits = 0
        try:
            self._stream: IO[bytes] = file.open("xb")
        except OSError as error:
            raise ResultsError(
                f"{file}: cannot be begun ({error.strerror}); the session has no log"
            ) from error
        self._mcap = McapFile(self._stream)
        self._write(lambda mcap: write_about(mcap, subject, "", time.time_ns()))

    @classmethod
    def begin(cls, results: Path, subject: str) -> Self:
        """Begin the log of a session in a results folder; its name is the time.

        Args:
            results: the results folder, made where it is missing.
            subject: the subject's name.

        Raises:
            ResultsError: the folder or the file cannot be made.
        """
        folder, now = results / FOLDER, datetime.now(UTC)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsError(
                f"{folder}: cannot be made ({error.strerror}); the session has no log"
            ) from error
        return cls(folder / f"{now:%Y-%m-%dT%H-%M-%S.%f}Z.mcap", subject)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self.close()

    def capture(self, capture: Capture) -> None:
        """A trial was opened: what was measured, once a session."""
        replay = unfitted_replay(capture)

        def written(mcap: McapFile) -> None:
            self._opened(mcap, replay)

        self._write(written)

    def fit(
        self,
        fit: Fit,
        *,
        trials: Sequence[str] | None = None,
        previous: Fit | None = None,
        meshes: Mapping[str, trimesh.Trimesh] | None = None,
        number: int | None = None,
    ) -> int:
        """A fit was opened or made: below `/TRIAL/fit-1`, the next one below `/TRIAL/fit-2`.

        Args:
            fit: the present one.
            trials: those to write; None for all.
            previous: what it is compared with; None: with what the markers alone said.
            meshes: of its bodies, where they are loaded already.
            number: of a fit some of whose trials are in the log already; None: it is another one.

        Returns:
            The fit's number in this session.
        """
        recording = recording_of(fit, trials=trials, previous=previous, meshes=meshes)
        with self._lock:
            is_new = number is None
            if number is None:
                self._fits += 1
                number = self._fits
        below = f"fit-{number}"

        def written(mcap: McapFile) -> None:
            for record in recording.trials:
                opened = self._opened(mcap, record.replay)
                topics = TrialTopics(mcap, record.replay, opened.origin_ns, below)
                write_fit(topics, record, recording.meshes, lines_of(record, recording))
                attach_review(mcap, record, time.time_ns())
            if is_new:
                attach_fit(mcap, fit, time.time_ns())

        self._write(written)
        return number

    def diagnosis(self, figures: Mapping[str, Any]) -> None:
        """A diagnosis was made; its causes are told in the trials that were opened.

        Args:
            figures: in the shape of `diagnose --json`.
        """

        def written(mcap: McapFile) -> None:
            for name, topics in self._trials.items():
                write_causes(topics, name, figures)
            text = json.dumps(dict(figures), indent=2, ensure_ascii=False)
            mcap.attach("diagnosis.json", "application/json", text, time.time_ns())

        self._write(written)

    def edit(self, edit: Edit) -> None:
        """A line of the review log, new or old."""
        self._write(lambda mcap: write_edit(mcap, edit, time.time_ns()))

    def note(self, text: str, *, is_warning: bool = False) -> None:
        """Anything that the user was told."""
        now = time.time_ns()
        level = Log.WARNING if is_warning else Log.INFO
        said = Log(timestamp=stamp(now), level=level, message=text, name="addb-viewer")
        self._write(lambda mcap: mcap.message(SESSION_TOPIC, now, said))

    def progress(
        self,
        stage: str,
        fraction: float,
        values: Mapping[str, float] | None = None,
        *,
        seconds: float | None = None,
    ) -> None:
        """The solver reports.

        Args:
            stage: its name.
            fraction: of the whole work, 0 to 1.
            values: figures of the step, their units in their names.
            seconds: since the work began; None: since its first report.
        """
        now = time.monotonic()
        with self._lock:
            if self._solve_began is None or seconds is not None:
                self._solve_began = now - (seconds or 0.0)
            step = SolverStep(stage, fraction, now - self._solve_began, values or {})
            if fraction >= 1.0:
                self._solve_began = None
            due = now - self._flushed >= FLUSH_EVERY_S or fraction >= 1.0
        self._write(lambda mcap: write_step(mcap, step, time.time_ns()), flush=due)

    def watching(self, progress: Progress = silent) -> Progress:
        """Progress that is written down before it is passed on."""

        def report(stage: str, fraction: float) -> None:
            self.progress(stage, fraction)
            progress(stage, fraction)

        return report

    def close(self) -> None:
        """Write the index and close the file; later calls do nothing."""
        with self._lock:
            if self._stream.closed:
                return
            self._write(McapFile.finish, flush=False)
            try:
                self._stream.close()
            except OSError as error:
                self._give_up(error)

    def _write(self, written: Callable[[McapFile], None], *, flush: bool = True) -> None:
        with self._lock:
            if self._stream.closed or self.trouble:
                return
            try:
                written(self._mcap)
                if flush:
                    self._mcap.flush()
                    self._flushed = time.monotonic()
            except OSError as error:
                self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        self.trouble = self.trouble or f"{self.file}: cannot be written any more ({error.strerror})"

    def _opened(self, mcap: McapFile, replay: Replay) -> TrialTopics:
        """Where a trial's messages go; its first frame is when it was opened, whatever comes later."""
        if replay.name not in self._trials:
            origin_ns = time.time_ns() - int(1e9 * replay.times[0])
            self._trials[replay.name] = TrialTopics(mcap, replay, origin_ns)
            write_capture(self._trials[replay.name], replay)
        return self._trials[replay.name]
