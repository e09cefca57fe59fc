"""Words in a rerun recording: lanes of flags and causes, the log, a page of figures, the solver's steps.

lanes/NAME             StateChange, on the trial's timelines
log                    notes, flags, causes and edits at their frames
summary                Markdown
solver/report, figure  on the timeline `solver_step`
"""

import numpy as np
import rerun as rr

from addb_viewer.recordings.rrd_stream import RrdStream
from addb_viewer.text.change_words import change_key_findings
from addb_viewer.text.diagnosis_vocabulary import title
from addb_viewer.text.judged_figures import Judged, judged_figures, length_words
from addb_viewer.trial_view.lanes import Lane
from addb_viewer.trial_view.recorded_subject import Recording, TrialRecord
from addb_viewer.trial_view.solver_steps import SolverStep, stages_of
from addb_viewer.trial_view.trial_events import lanes_of, lines_of, states_of
from solver.diagnosis.diagnosis_report import DiagnosisReport

LANES, LOG, SUMMARY, SOLVER = "lanes", "log", "summary", "solver"
REPORT, FRACTION, SECONDS = "report", "fraction", "seconds"  # below solver
SOLVER_STEP = "solver_step"  # timeline


def write_log(stream: RrdStream, record: TrialRecord, recording: Recording) -> None:
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
    _steps(stream, stages_of(record.figures, record.costs))


def _lane(stream: RrdStream, lane: Lane) -> None:
    changes = states_of(lane, stream.frames)
    parts = (LANES, lane.label.replace(" ", "_"))  # rerun writes blanks of a path as "\\ "
    colors = {block.text: [*block.color, 255] for block in lane.blocks}
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


def summary_page(record: TrialRecord, recording: Recording) -> str:
    """The trial's figures, and how to read the recording, as Markdown."""
    f, fit = record.figures, recording.fit
    rows = [
        ("Frames used", f"{f.frames_with_force_used} of {f.frames}", "decided by " + f.mask_source),
        *((each.label, each.words or "not computed", _verdict(each)) for each in judged_figures(f)),
    ]
    if f.forces_predicted:
        rows.append(("Forces and torques", "predicted from the motion", "no measurement confirms them"))
    if f.kinematics_only is not None:
        before = length_words(f.kinematics_only.marker_rms_m)
        rows.append(("Marker error of the markers alone, RMS", before, "before forces counted"))
    if changed := change_key_findings(f.change):
        rows.append(("Joints moved by the fit to forces", changed, "no error by itself"))
    person = f"{fit.mass_kg:.1f} kg, {fit.height_m:.2f} m"
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    compared = f" Sky blue: *{record.before_name}*." if record.before is not None else ""
    return (
        f"**{recording.subject}, {record.replay.name}**: {person}, {f.rate_hz:.0f} Hz.\n\n"
        f"| figure | value | bound |\n|---|---|---|\n{table}\n\n"
        "Residuals: what the motion demands less what was measured, over the frames used; the moment is "
        "about the root joint's centre, in the ground frame.\n\n"
        "**Scene.** Markers from blue (no error) over orange to vermilion (4 cm); forces 1 m for 1000 N, "
        f"right foot green, left purple, of no foot orange; pale: required but not measured.{compared}\n"
        f"{_diagnosis(recording.diagnosis)}"
    )


def _diagnosis(diagnosis: DiagnosisReport | None) -> str:
    if diagnosis is None:
        return ""
    named = "".join(f"- {title(effect)}\n" for effect in diagnosis.effects)
    return f"\n**Diagnosis:** {diagnosis.verdict}\n\n{named}"


def _verdict(judged: Judged) -> str:
    return "" if judged.within is None else f"{'within' if judged.within else 'BEYOND'} {judged.bound}"
