"""MCAP files of a fit: every trial on its own clock, below its own name."""

import json
from pathlib import Path

import numpy as np

from addb_viewer.recordings.mcap_file import McapFile
from addb_viewer.recordings.mcap_schemas import EDIT, PROGRESS
from addb_viewer.recordings.mcap_trial import (
    TrialTopics,
    write_analog,
    write_capture,
    write_causes,
    write_fit,
)
from addb_viewer.trial_view.drawn_curves import nanoseconds
from addb_viewer.trial_view.recorded_subject import Recording, TrialRecord, file_of
from addb_viewer.trial_view.solver_steps import SolverStep, stages_of
from addb_viewer.trial_view.trial_events import lines_of
from annotations.event_codec import encoded
from annotations.events import Edit
from annotations.review_json import KEY
from solver.capture.atomic import whole_file
from solver.common.errors import ModelError
from solver.common.typed_json import plain
from solver.fitting.fit_result import Fit
from solver.fitting.settings import as_toml, from_dict
from solver.fitting.summary import summary
from solver.skeleton.osim_writer import skeleton_text

EDITS_TOPIC, PROGRESS_TOPIC = "/review/edits", "/solver/progress"
PROGRAM = "addb-viewer"
ABOUT = "about"  # metadata: the subject, the version, and when the trials' clocks read zero


def write_mcap(recording: Recording, file: Path) -> Path:
    """Write a recording as an MCAP file, in place of the file that was there; all of it or nothing.

    Args:
        recording: with one trial or more.
        file: its folder must exist.

    Returns:
        The file.

    Raises:
        CaptureError: the folder cannot be written to.
    """
    with whole_file(file) as stream:
        mcap = McapFile(stream)
        first = min(float(record.replay.times[0]) for record in recording.trials)
        origin_ns = max(0, -int(nanoseconds(np.array(first))))  # times of a file cannot be negative
        version = recording.fit.provenance.get(PROGRAM, "")
        about = {"subject": recording.subject, PROGRAM: version, "clock_zero_ns": str(origin_ns)}
        mcap.metadata(ABOUT, about)
        for record in recording.trials:
            topics = TrialTopics(mcap, record.replay, origin_ns)
            write_capture(topics, record.replay)
            write_fit(topics, record, recording.meshes, lines_of(record, recording))
            analog = record.analog[0]
            if analog is not None:
                write_analog(topics, analog)
            if recording.diagnosis is not None:
                write_causes(topics, record.replay.name, recording.diagnosis)
        for edit in recording.edits:
            _write_edit(mcap, edit, origin_ns)
        first_trial = recording.trials[0]
        for step in stages_of(first_trial.figures, first_trial.costs):
            _write_step(mcap, step, origin_ns + int(step.seconds * 1e9))
        _attach_fit(mcap, recording.fit, origin_ns)
        for record in recording.trials:
            _attach_review(mcap, record, origin_ns)
        if recording.diagnosis is not None:
            text = json.dumps(recording.diagnosis.as_json(), indent=2, ensure_ascii=False)
            mcap.attach("diagnosis.json", "application/json", text, origin_ns)
        mcap.finish()
    return file


def _write_edit(mcap: McapFile, edit: Edit, time_ns: int) -> None:
    """Write a line of the review log."""
    kind, content = encoded(edit.event)
    told = {"number": edit.number, "trial": edit.trial, "author": edit.author}
    when = {"made_at": edit.made_at.isoformat(), "kind": kind, "content": content}
    mcap.record(EDITS_TOPIC, time_ns, EDIT, told | when)


def _write_step(mcap: McapFile, step: SolverStep, time_ns: int) -> None:
    """Write a report of the solver."""
    mcap.record(PROGRESS_TOPIC, time_ns, PROGRESS, plain(step))


def _attach_fit(mcap: McapFile, fit: Fit, time_ns: int) -> None:
    """Put a fit's settings, model, figures and provenance into the file."""
    mcap.attach("settings.toml", "application/toml", as_toml(from_dict(fit.settings)), time_ns)
    try:
        mcap.attach("model.osim", "application/xml", skeleton_text(fit.skeleton), time_ns)
    except ModelError as error:
        mcap.attach("model.txt", "text/plain", f"no OpenSim model: {error}\n", time_ns)
    figures = json.dumps(plain(summary(fit)), indent=2, ensure_ascii=False)
    mcap.attach("fit.json", "application/json", figures, time_ns)
    made_from = json.dumps(dict(fit.provenance), indent=2, ensure_ascii=False)
    mcap.attach("provenance.json", "application/json", made_from, time_ns)


def _attach_review(mcap: McapFile, record: TrialRecord, time_ns: int) -> None:
    """Put a trial's `review.json` into the file: true where a foot's force does not count."""
    text = json.dumps({KEY: list(record.missing)})
    mcap.attach(f"{file_of(record.replay.name)}/review.json", "application/json", text, time_ns)
