"""Rerun recordings: one a trial, all in one .rrd file."""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import rerun as rr

from addb_viewer.recordings.recording import Recording, TrialRecord
from addb_viewer.recordings.rerun_program import rerun_command, rerun_environment
from addb_viewer.recordings.rrd_blueprint import blueprint_of
from addb_viewer.recordings.rrd_scene import write_scene
from addb_viewer.recordings.rrd_series import write_series
from addb_viewer.recordings.rrd_story import write_story
from addb_viewer.recordings.rrd_stream import RrdStream
from solver.capture.atomic import whole_file

PROGRAM = "addb-viewer"


def write_rrd(recording: Recording, file: Path) -> Path:
    """Write a recording for rerun's viewer, in place of the file that was there; all of it or nothing.

    Args:
        recording: with one trial or more.
        file: its folder must exist.

    Returns:
        The file.

    Raises:
        CaptureError: the folder cannot be written to.
    """
    with whole_file(file) as draft, tempfile.TemporaryDirectory() as folder:
        parts = []
        for i, record in enumerate(recording.trials):
            parts.append(Path(folder) / f"{i}.rrd")
            _write_trial(recording, record, parts[-1])
        if len(parts) > 1:
            merged = Path(folder) / "merged.rrd"
            command = [*rerun_command(), "rrd", "merge", *map(str, parts), "-o", str(merged)]
            subprocess.run(command, check=True, capture_output=True, env=rerun_environment(Path(folder)))
            parts = [merged]
        with parts[0].open("rb") as whole:
            shutil.copyfileobj(whole, draft)
    return file


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
        target.disconnect()
