"""Rerun recordings: one a trial, all in one .rrd file."""

import errno
import os
import re
import shutil
import subprocess
import threading
from collections.abc import Sequence
from pathlib import Path

import rerun as rr

from addb_viewer.recordings.recording import Recording, TrialRecord
from addb_viewer.recordings.rerun_program import rerun_command, rerun_environment
from addb_viewer.recordings.rrd_blueprint import blueprint_of
from addb_viewer.recordings.rrd_scene import write_scene
from addb_viewer.recordings.rrd_series import write_series
from addb_viewer.recordings.rrd_story import write_story
from addb_viewer.recordings.rrd_stream import RrdStream
from solver.capture.atomic import draft_folder, whole_file
from solver.errors import CaptureError

PROGRAM = "addb-viewer"
LOOKS_S = 0.5  # between looks at whether rerun has ended
FULL_S = 20.0  # after which a full disk is taken for the reason why it has not
LEAST_ROOM_BYTES = 1 << 20
_NO_SPACE = os.strerror(errno.ENOSPC)


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
        parts = []
        for i, record in enumerate(recording.trials):
            parts.append(folder / f"{i}.rrd")
            try:
                _write_trial(recording, record, parts[-1])
            except RuntimeError as error:  # as rerun tells what the system said
                if _NO_SPACE not in str(error):
                    raise
                raise OSError(errno.ENOSPC, _NO_SPACE, str(file)) from error
        if len(parts) > 1:
            parts = [_merged(parts, file)]
        with parts[0].open("rb") as whole:
            shutil.copyfileobj(whole, draft)
    return file


def _merged(parts: Sequence[Path], file: Path) -> Path:
    """One file beside the parts, by rerun's own program."""
    folder = parts[0].parent
    merged = folder / "merged.rrd"
    command = [*rerun_command(), "rrd", "merge", *map(str, parts), "-o", str(merged)]
    run = subprocess.run(command, check=False, capture_output=True, text=True, env=rerun_environment(folder))
    if run.returncode:
        said = " ".join(run.stderr.split()) or f"status {run.returncode}"
        if _NO_SPACE in said:
            raise OSError(errno.ENOSPC, _NO_SPACE, str(file))
        raise CaptureError(f"{file}: rerun's program could not merge the trials ({said}).")
    return merged


def _write_trial(recording: Recording, record: TrialRecord, file: Path) -> None:
    replay = record.replay
    several = len(recording.trials) > 1
    name = f"{recording.subject}, {replay.name}"
    application = re.sub(r"[^A-Za-z0-9_.-]+", "-", f"{PROGRAM} {name}")  # each trial with a layout of its own
    with rr.RecordingStream(application, recording_id=name) as target:
        target.save(file, default_blueprint=blueprint_of(record, several=several))
        target.send_recording_name(name)
        stream = RrdStream(target, replay.times)
        write_scene(stream, record, recording)
        write_series(stream, record)
        write_story(stream, record, recording)
        _finished(target, file)


def _finished(target: rr.RecordingStream, file: Path) -> None:
    """Wait until all is written; on a full disk rerun may never say that it is."""
    failed: list[BaseException] = []

    def disconnect() -> None:
        try:
            target.disconnect()
        except BaseException as error:  # told below, where somebody waits
            failed.append(error)

    ending = threading.Thread(target=disconnect, daemon=True)
    ending.start()
    waited = 0.0
    while ending.is_alive():
        ending.join(LOOKS_S)
        waited += LOOKS_S
        if ending.is_alive() and waited > FULL_S and shutil.disk_usage(file.parent).free < LEAST_ROOM_BYTES:
            raise OSError(errno.ENOSPC, _NO_SPACE, str(file))
    if failed:
        raise failed[0]
