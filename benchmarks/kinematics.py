"""Marker errors of every recording: ours, OpenSim's with a model that somebody scaled, the peers' figures."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.opensim_kinematics import OpenSimKinematics, opensim_inverse_kinematics
from benchmarks.peers import ENGINE
from benchmarks.recordings import scaled_reference_models, subjects
from solver.capture.capture import Subject
from solver.capture.trial import read_trial
from solver.errors import SolverError
from solver.fit import Fit, TrialFit
from solver.pipeline import solve
from solver.settings import settings_for


@dataclass(frozen=True)
class Row:
    """One trial of the table."""

    recording: str
    trial: str
    markers: int
    frames: int
    rms_cm: float
    rms_frame_mean_cm: float
    max_cm: float
    scaling_s: float
    kinematics_s: float
    opensim: tuple[tuple[str, OpenSimKinematics], ...]
    peers: str


def rows() -> Iterator[Row | str]:
    """A row for every trial that could be fitted, else a line that says why not."""
    for name, subject in subjects():
        if isinstance(subject, SolverError):
            yield f"`{name}`: {subject}"
            continue
        try:
            fit = solve(subject, settings_for(subject.folder))
        except SolverError as error:
            yield f"`{name}`: {error}"
            continue
        yield from (_row(name, subject, fit, trial) for trial in fit.trials)


def _row(name: str, subject: Subject, fit: Fit, trial: TrialFit) -> Row:
    errors, scaling = trial.marker_errors, trial.seconds.get("scaling", 0.0) * len(fit.trials)
    peers = ENGINE.get((name, trial.capture.name))
    return Row(
        recording=name,
        trial=trial.capture.name,
        markers=len(errors.names),
        frames=trial.motion.frames,
        rms_cm=100 * errors.rms,
        rms_frame_mean_cm=100 * errors.rms_frame_mean,
        max_cm=100 * errors.maximum,
        scaling_s=scaling,
        kinematics_s=trial.seconds["kinematics"],
        opensim=tuple(_with_reference_models(subject, trial.capture.name)),
        peers=peers.marker_rms_frame_mean_cm if peers else "",
    )


def _with_reference_models(subject: Subject, trial: str) -> Iterator[tuple[str, OpenSimKinematics]]:
    markers = next(read_trial(t).markers for t in subject.trials if t.name == trial)
    for model in scaled_reference_models(subject):
        outcome = _opensim(model, markers)
        if outcome is not None and len(outcome.markers) >= 10:
            yield model.name, outcome


def _opensim(model: Path, markers: object) -> OpenSimKinematics | None:
    try:
        return opensim_inverse_kinematics(model, markers)  # type: ignore[arg-type]
    except (ImportError, RuntimeError, StopIteration):
        return None  # no wheel here, or OpenSim refuses the model


def table() -> str:
    """The table as Markdown, trials that could not be fitted below it."""
    lines = [
        "| recording | trial | markers | frames | RMS cm | frame-mean RMS cm | max cm | scaling s | IK s (frames/s) "
        "| OpenSim IK, expert's scaled model: RMS / frame mean / max cm, frames/s | engine: frame-mean RMS cm |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    refused = []
    for row in rows():
        if isinstance(row, str):
            refused.append(f"- {row}")
            continue
        opensim = "; ".join(
            f"{100 * o.rms:.2f} / {100 * o.rms_frame_mean:.2f} / {100 * o.maximum:.1f}, "
            f"{row.frames / o.cpu_seconds:.0f} ({n}, {len(o.markers)} markers)"
            for n, o in row.opensim
        )
        lines.append(
            f"| {row.recording} | {row.trial} | {row.markers} | {row.frames} | {row.rms_cm:.2f} "
            f"| {row.rms_frame_mean_cm:.2f} | {row.max_cm:.1f} | {row.scaling_s:.1f} "
            f"| {row.kinematics_s:.2f} ({row.frames / row.kinematics_s:.0f}) | {opensim} | {row.peers} |"
        )
    return "\n".join(lines + (["", "Not fitted:", "", *refused] if refused else []))
