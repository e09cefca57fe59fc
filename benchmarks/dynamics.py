"""Root residuals of every trial with forces, ours and the referee's (OpenSim on our exported files)."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.peers import ENGINE
from benchmarks.referee import referee
from solver.summary import STANDARD_GRAVITY
from solver.export.opensim import export_opensim, file_stem
from solver.fit import Fit, TrialFit
from solver.pipeline import solve
from solver.settings import Settings

SLOW_CUTOFF_HZ = 6.0  # OpenSim's own habit, for comparison with plain inverse dynamics elsewhere


@dataclass(frozen=True)
class Row:
    """One trial of the table."""

    recording: str
    trial: str
    frames: int
    used: int
    mask: str
    ours: str
    slow: str
    referee: str
    peers: str


def residual_rows(name: str, fit: Fit, settings: Settings) -> list[Row]:
    """A row for every trial of a fit that has forces."""
    measured = [t for t in fit.trials if t.dynamics is not None and t.dynamics.used.any()]
    if not measured:
        return []
    slow_settings = replace(settings, conditioning=replace(settings.conditioning, cutoff_Hz=SLOW_CUTOFF_HZ))
    slow = {t.capture.name: t for t in solve(fit.subject, slow_settings).trials}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        export_opensim(fit, folder)
        return [_row(name, fit, trial, slow[trial.capture.name], folder) for trial in measured]


def _row(name: str, fit: Fit, trial: TrialFit, slow: TrialFit, exported: Path) -> Row:
    assert trial.dynamics is not None
    assert slow.dynamics is not None
    used = trial.dynamics.used
    peers = ENGINE.get((name, trial.capture.name))
    return Row(
        recording=name,
        trial=trial.capture.name,
        frames=trial.motion.frames,
        used=int(used.sum()),
        mask=trial.mask.source if trial.mask else "none",
        ours=_figures(fit, trial.dynamics.residual_root[used]),
        slow=_figures(fit, slow.dynamics.residual_root[used]),
        referee=_disagreement(fit, trial, exported),
        peers=f"{peers.linear_residual_N} N, {peers.angular_residual_Nm} N·m" if peers else "",
    )


def _figures(fit: Fit, residual: Float[np.ndarray, "frames 6"]) -> str:
    force, moment = _rms(residual[:, :3]), _rms(residual[:, 3:])
    weight = fit.mass_kg * STANDARD_GRAVITY
    return (
        f"{force:.1f} N ({force / weight:.3f} BW), {moment:.1f} N·m ({moment / weight / fit.height_m:.4f} BW·h); "
        f"mean norm {_mean_norm(residual[:, :3]):.1f} N, {_mean_norm(residual[:, 3:]):.1f} N·m"
    )


def _disagreement(fit: Fit, trial: TrialFit, exported: Path) -> str:
    """RMS of the referee's residual less ours, over the frames used."""
    assert trial.dynamics is not None
    try:
        verdict = referee(exported, file_stem(trial.capture.name))
    except (ImportError, RuntimeError) as error:
        return f"not run: {error}"
    rows = np.round((verdict.times - trial.motion.start_time) * trial.motion.rate).astype(int)
    difference = verdict.residual_root - trial.dynamics.residual_root[rows]
    difference = difference[trial.dynamics.used[rows]]
    weight = fit.mass_kg * STANDARD_GRAVITY
    return (
        f"{100 * _rms(difference[:, :3]) / weight:.3f} % BW, "
        f"{100 * _rms(difference[:, 3:]) / weight / fit.height_m:.3f} % BW·h"
    )


def _rms(vectors: Float[np.ndarray, "frames 3"]) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def _mean_norm(vectors: Float[np.ndarray, "frames 3"]) -> float:
    return float(np.linalg.norm(vectors, axis=1).mean())


def residual_table(rows: Sequence[Row]) -> str:
    """The rows as Markdown."""
    lines = [
        "| recording | trial | frames used of all | mask | residual RMS at the default cutoff | at 6 Hz "
        "| referee less ours | engine, kinematics → dynamics, mean norms |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r.recording} | {r.trial} | {r.used} of {r.frames} | {r.mask} | {r.ours} | {r.slow} | {r.referee} "
        f"| {r.peers} |"
        for r in rows
    ]
    return "\n".join(lines)
