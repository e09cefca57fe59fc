"""Words in a rerun recording: lanes of flags and causes, the log, a page of figures, the solver's steps.

lanes/NAME             StateChange, on the trial's timelines
log                    notes, flags, causes and edits at their frames
summary                Markdown
solver/report, figure  on the timeline `solver_step`
"""

import numpy as np
import rerun as rr

from addb_viewer.recordings.happenings import Lane, lanes_of, lines_of, states_of
from addb_viewer.recordings.recording import Recording, TrialRecord
from addb_viewer.recordings.rrd_stream import RrdStream
from addb_viewer.recordings.solver_steps import SolverStep, stages_of
from addb_viewer.recordings.summary_page import summary_page

LANES, LOG, SUMMARY, SOLVER = "lanes", "log", "summary", "solver"
REPORT, FRACTION, SECONDS = "report", "fraction", "seconds"  # below solver
SOLVER_STEP = "solver_step"  # timeline


def write_story(stream: RrdStream, record: TrialRecord, recording: Recording) -> None:
    """Write a trial's lanes, log, page of figures and solver's steps.

    Args:
        stream: of the trial.
        record: the trial.
        recording: that it belongs to.
    """
    for lane in lanes_of(record, recording.diagnosis):
        _lane(stream, lane)
    lines = lines_of(record, recording)
    if lines:
        columns = rr.TextLog.columns(
            text=[f"{line.source}: {line.text}" for line in lines],
            level=["WARN" if line.is_warning else "INFO" for line in lines],
        )
        stream.columns((LOG,), columns, frames=np.array([line.frame for line in lines]))
    page = rr.TextDocument(summary_page(record, recording), media_type=rr.MediaType.MARKDOWN)
    stream.static((SUMMARY,), page)
    _steps(stream, recording.steps or stages_of(record.figures, record.costs))


def _lane(stream: RrdStream, lane: Lane) -> None:
    changes = states_of(lane, stream.frames)
    parts = (LANES, lane.name.replace(" ", "_"))  # rerun writes blanks of a path as "\\ "
    colors = {stretch.state: [*stretch.color, 255] for stretch in lane.stretches}
    if not changes:
        return
    stream.static(parts, rr.StateConfiguration(values=list(colors), colors=list(colors.values())))
    columns = rr.StateChange.columns(state=[state for _, state in changes])
    stream.columns(parts, columns, frames=np.array([frame for frame, _ in changes]))


def _steps(stream: RrdStream, steps: tuple[SolverStep, ...]) -> None:
    rows = len(steps)
    said = [_said(step) for step in steps]
    stream.steps((SOLVER, REPORT), SOLVER_STEP, rr.TextLog.columns(text=said), rows)
    for name in (FRACTION, SECONDS):
        values = [round(getattr(step, name), 4) for step in steps]
        stream.steps((SOLVER, name), SOLVER_STEP, rr.Scalars.columns(scalars=values), rows)
    for name in dict.fromkeys(name for step in steps for name in step.values):
        values = [step.values.get(name, np.nan) for step in steps]
        stream.steps((SOLVER, name), SOLVER_STEP, rr.Scalars.columns(scalars=values), rows)


def _said(step: SolverStep) -> str:
    figures = "".join(f", {name} {value:.4g}" for name, value in step.values.items())
    return f"{step.stage}, {100 * step.fraction:.0f} %, {step.seconds:.2f} s{figures}"
