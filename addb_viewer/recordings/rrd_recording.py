"""Rerun recordings: one a trial, all in one .rrd file."""

import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import rerun as rr

from addb_viewer.recordings.rerun_program import rerun_command, rerun_environment
from addb_viewer.recordings.rrd_blueprint import blueprint_of
from addb_viewer.recordings.rrd_log import write_log
from addb_viewer.recordings.rrd_scene import write_scene
from addb_viewer.recordings.rrd_series import write_series
from addb_viewer.recordings.rrd_stream import RrdStream
from addb_viewer.trial_view.recorded_subject import Recording, TrialRecord
from solver.capture.atomic import draft_folder, whole_file
from solver.common.errors import CaptureError

PROGRAM = "addb-viewer"


def write_rrd(recording: Recording, file: Path) -> Path:
    """Write a recording for rerun's viewer, in place of the file that was there; all of it or nothing.

    Args:
        recording: with one trial or more.
        file: its folder must exist.

    Returns:
        The file.

    Raises:
        CaptureError: the folder cannot be written to, or has no room for the recording twice.
    """
    with whole_file(file) as draft, draft_folder(file.parent) as folder:
        parts = [folder / f"{i}.rrd" for i in range(len(recording.trials))]
        for record, part in zip(recording.trials, parts, strict=True):
            with part.open("wb") as begun:
                _write_trial(recording, record, begun)
        _merge(parts, draft, file)
    return file


def _merge(parts: Sequence[Path], draft: BinaryIO, file: Path) -> None:
    """Put the parts into one file, with its table of contents, by rerun's own program."""
    folder = parts[0].parent
    command = [*rerun_command(), "rrd", "merge", *map(str, parts)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=rerun_environment(folder)
    ) as run:
        assert run.stdout is not None
        assert run.stderr is not None
        try:
            shutil.copyfileobj(run.stdout, draft)
        except BaseException:
            run.kill()
            raise
        said = run.stderr.read().decode(errors="replace")
    if run.returncode:
        why = " ".join(said.split()) or f"status {run.returncode}"
        raise CaptureError(f"{file}: rerun's program could not merge the trials ({why}).")


def _write_trial(recording: Recording, record: TrialRecord, part: BinaryIO) -> None:
    """Rerun makes the bytes and we write them: its own writer may hang for ever where the disk is full."""
    replay = record.replay
    several = len(recording.trials) > 1
    name = f"{recording.subject}, {replay.name}"
    application = re.sub(r"[^A-Za-z0-9_.-]+", "-", f"{PROGRAM} {name}")  # each trial with a layout of its own
    with rr.RecordingStream(application, recording_id=name) as target:
        made = rr.binary_stream(target)
        target.send_blueprint(blueprint_of(record, several=several), make_active=False, make_default=True)
        target.send_recording_name(name)
        stream = RrdStream(target, replay.times)
        write_scene(stream, record, recording)
        part.write(made.read() or b"")
        write_series(stream, record)
        write_log(stream, record, recording)
        part.write(made.read() or b"")
