"""Marker errors of every recording: ours, OpenSim's with a model that somebody scaled, the peers' figures."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.opensim_kinematics import OpenSimKinematics, opensim_inverse_kinematics
from benchmarks.peers import ENGINE
from benchmarks.recordings import scaled_reference_models
from solver.capture.capture import Markers
from solver.fitting.fit import Fit, TrialFit

FEWEST_MARKERS = 10  # shared with a reference model, for its figure to say anything


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


def marker_row(name: str, fit: Fit, trial: TrialFit) -> Row:
    """The figures of one fitted trial."""
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
        opensim=tuple(_with_reference_models(fit, trial)),
        peers=peers.marker_rms_frame_mean_cm if peers else "",
    )


def _with_reference_models(fit: Fit, trial: TrialFit) -> Iterator[tuple[str, OpenSimKinematics]]:
    for model in scaled_reference_models(fit.subject):
        outcome = _opensim(model, trial.capture.markers)
        if outcome is not None and len(outcome.markers) >= FEWEST_MARKERS:
            yield model.name, outcome


def _opensim(model: Path, markers: Markers) -> OpenSimKinematics | None:
    try:
        return opensim_inverse_kinematics(model, markers)
    except (ImportError, RuntimeError, StopIteration):
        return None  # no wheel here, or OpenSim refuses the model


def marker_table(rows: Sequence[Row]) -> str:
    """The rows as Markdown."""
    columns = (
        "recording",
        "trial",
        "markers",
        "frames",
        "RMS cm",
        "frame-mean RMS cm",
        "max cm",
        "scaling s",
        "IK s (frames/s)",
        "OpenSim IK, somebody's scaled model: RMS / frame mean / max cm, frames/s",
        "engine: frame-mean RMS cm",
    )
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for row in rows:
        opensim = "; ".join(
            f"{100 * o.rms:.2f} / {100 * o.rms_frame_mean:.2f} / {100 * o.maximum:.1f}, "
            f"{row.frames / o.cpu_seconds:.0f} ({name}, {len(o.markers)} markers)"
            for name, o in row.opensim
        )
        lines.append(
            f"| {row.recording} | {row.trial} | {row.markers} | {row.frames} | {row.rms_cm:.2f} "
            f"| {row.rms_frame_mean_cm:.2f} | {row.max_cm:.1f} | {row.scaling_s:.1f} "
            f"| {row.kinematics_s:.2f} ({row.frames / row.kinematics_s:.0f}) | {opensim} | {row.peers} |"
        )
    return "\n".join(lines)
