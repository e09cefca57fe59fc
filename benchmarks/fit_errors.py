"""Marker errors and root residuals of every recording: ours, OpenSim's, and the peers' figures."""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.opensim_reference import OpenSimKinematics, opensim_inverse_kinematics, referee
from benchmarks.recordings import scaled_reference_models
from solver.capture.capture import Markers
from solver.common.gravity import GRAVITY
from solver.export.export_places import file_stem
from solver.export.opensim import export_opensim
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.fit_summary import ForceFigures, HeldOutFigures, MomentFigures, TrialFigures
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.fitting.summary import summary


@dataclass(frozen=True)
class PeerFigures:
    """The AddBiomechanics engine, end to end: kinematics stage, then dynamics stage."""

    marker_rms_frame_mean_cm: str
    linear_residual_N: str  # mean norm, kinematics → dynamics
    angular_residual_Nm: str


# Engine state of 2025-06 on nimblephysics 0.10.52.1, default settings; keyed by (subject folder, trial).
ENGINE = {
    ("walk_rajagopal2015", "walk"): PeerFigures("1.57 → 1.47", "44.5 → 2.9", "26.7 → 11.4"),
    ("opencap_reviewed", "DJ1"): PeerFigures(
        "1.19 → 1.13; 1.49 → 1.49", "137 → 7.0; 118 → 31.5", "18.9 → 9.6; 44.5 → 37.7"
    ),
    ("overground_camargo2021_AB06", "levelground_ccw_fast_01_01"): PeerFigures(
        "3.48", "no dynamics", "no dynamics"
    ),
}
SLOW_CUTOFF_HZ = 6.0  # OpenSim's own habit, for comparison with plain inverse dynamics elsewhere
FEWEST_MARKERS = 10  # shared with a reference model, for its figure to say anything
MARKER_COLUMNS = (
    *("recording", "trial", "markers", "frames", "RMS cm", "frame-mean RMS cm", "max cm"),
    *("scaling s", "IK s (frames/s)"),
    "OpenSim IK, somebody's scaled model: RMS / frame mean / max cm, frames/s",
    "engine: frame-mean RMS cm",
)
RESIDUAL_COLUMNS = (
    *("recording", "trial", "frames used of all", "mask", "mass fitted (entered) kg"),
    *("marker RMS / max cm (markers alone)", "residual RMS", "raw forces"),
    "first layout of held-out blocks (markers alone at their best cut-off elsewhere)",
    *("markers alone, 6 Hz", "referee RMS; referee less ours", "Hicks: force, moment, marker RMS, max"),
    *("CPU s", "engine, kinematics → dynamics, mean norms"),
)


def marker_row(name: str, fit: Fit, trial: TrialFit) -> list[object]:
    """The cells of one fitted trial."""
    errors, scaling = trial.marker_errors, trial.seconds.get("scaling", 0.0) * len(fit.trials)
    peers, frames, seconds = (
        ENGINE.get((name, trial.capture.name)),
        trial.motion.frames,
        trial.seconds["kinematics"],
    )
    opensim = "; ".join(
        f"{100 * o.rms:.2f} / {100 * o.rms_frame_mean:.2f} / {100 * o.maximum:.1f}, "
        f"{frames / o.cpu_seconds:.0f} ({model}, {len(o.markers)} markers)"
        for model, o in _with_reference_models(fit, trial)
    )
    return [
        *(name, trial.capture.name, len(errors.names), frames),
        *(f"{100 * errors.rms:.2f}", f"{100 * errors.rms_frame_mean:.2f}", f"{100 * errors.maximum:.1f}"),
        *(f"{scaling:.1f}", f"{seconds:.2f} ({frames / seconds:.0f})", opensim),
        peers.marker_rms_frame_mean_cm if peers else "",
    ]


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


FitTrials = dict[str, TrialFigures]  # by name


def residual_rows(name: str, fit: Fit, settings: Settings) -> list[tuple[str, ...]]:
    """A row for every trial of a fit that has forces."""
    measured = [t for t in fit.trials if t.dynamics is not None and t.dynamics.used.any()]
    if not measured:
        return []
    plain = replace(
        settings,
        conditioning=replace(settings.conditioning, cutoff_Hz=SLOW_CUTOFF_HZ),
        trajectory=replace(settings.trajectory, enabled=False),
    )
    slow, ours = ({t.name: t for t in summary(each).trials} for each in (solve(fit.subject, plain), fit))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        export_opensim(fit, folder)
        return [
            (name, *_cells(fit, trial, ours, slow), _verdict(fit, trial, folder), *_rest(name, trial, ours))
            for trial in measured
        ]


def _cells(fit: Fit, trial: TrialFit, ours: FitTrials, slow: FitTrials) -> tuple[str, ...]:
    own, plain = ours[trial.capture.name], slow[trial.capture.name]
    before, held_out = own.kinematics_only, own.held_out
    entered = fit.subject.mass_kg
    return (
        trial.capture.name,
        f"{own.frames_with_force_used} of {own.frames}",
        own.mask_source,
        f"{fit.mass_kg:.1f} ({f'{entered:.1f}' if entered else 'none'})",
        f"{100 * own.marker_rms_m:.2f} / {100 * own.marker_max_m:.1f}"
        + (f" ({100 * before.marker_rms_m:.2f} / {100 * before.marker_max_m:.1f})" if before else ""),
        _residual(own.linear_residual, own.angular_residual),
        _residual(own.linear_residual_raw, own.angular_residual_raw, short=True),
        f"{_residual(held_out.linear_residual, held_out.angular_residual, short=True)} ({_before(held_out)})"
        if held_out
        else "too short",
        _residual(plain.linear_residual, plain.angular_residual, short=True),
    )


def _residual(force: ForceFigures | None, moment: MomentFigures | None, *, short: bool = False) -> str:
    if force is None or moment is None:
        return "no frames"
    text = f"{force.rms_N:.1f} N, {moment.rms_Nm:.1f} N·m"
    if short:
        return text
    return (
        f"{text} ({force.rms_BW:.3f} BW, {moment.rms_BWh:.4f} BW·h; "
        f"mean norms {force.mean_norm_N:.1f} N, {moment.mean_norm_Nm:.1f} N·m)"
    )


def _before(held_out: HeldOutFigures) -> str:
    return _residual(
        held_out.kinematics_only_linear_residual, held_out.kinematics_only_angular_residual, short=True
    )


def _rest(name: str, trial: TrialFit, ours: FitTrials) -> tuple[str, ...]:
    own = ours[trial.capture.name]
    hicks, peers = own.hicks, ENGINE.get((name, trial.capture.name))
    passed = (hicks.linear, hicks.angular, hicks.marker_rms, hicks.marker_max)
    return (
        " ".join("✓" if each else "✗" for each in passed),
        f"{sum(spent or 0.0 for spent in own.seconds.values()):.1f}",
        f"{peers.linear_residual_N} N, {peers.angular_residual_Nm} N·m" if peers else "",
    )


def _verdict(fit: Fit, trial: TrialFit, exported: Path) -> str:
    """What OpenSim's inverse dynamics finds on our files, and how far that is from ours."""
    assert trial.dynamics is not None
    try:
        verdict = referee(exported, file_stem(trial.capture.name))
    except (ImportError, RuntimeError) as error:
        return f"not run: {error}"
    rows = np.round((verdict.times - trial.motion.start_time) * trial.motion.rate).astype(int)
    used = trial.dynamics.used[rows]
    theirs = verdict.residual_root[used]
    difference = theirs - trial.dynamics.residual_root[rows][used]
    weight = fit.mass_kg * GRAVITY
    return (
        f"{_rms(theirs[:, :3]):.1f} N, {_rms(theirs[:, 3:]):.1f} N·m; "
        f"{100 * _rms(difference[:, :3]) / weight:.3f} % BW, "
        f"{100 * _rms(difference[:, 3:]) / weight / fit.height_m:.3f} % BW·h"
    )


def _rms(vectors: Float[np.ndarray, "frames 3"]) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))
