"""The residual over the time of one trial, as the diagnosis found it: without and with the named causes."""

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.trial_view.charts import Chart, Line
from addb_viewer.trial_view.palette import BLUE, GREY, VERMILION
from addb_viewer.trial_view.replay import Replay
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.diagnosis.residual_description import TrialResidual

BROKEN = 1.5  # times the usual step from window to window: frames between that did not count


def residual_charts(figures: DiagnosisReport, replay: Replay) -> tuple[Chart, ...]:
    """Force and moment; none where the trial was not diagnosed.

    Args:
        figures: of the diagnosis.
        replay: the trial.
    """
    trial = _of_trial(figures, replay.name)
    if trial is None or not trial.time_history.time_s:
        return ()
    time_history = trial.time_history
    times = replay.times[0] + np.array(time_history.time_s)
    told = _told(times, replay.times)

    def at_frames(name: str) -> Float[np.ndarray, " frames"]:
        return np.where(told, np.interp(replay.times, times, np.array(getattr(time_history, name))), np.nan)

    charts = []
    for what, unit, suffix in (("force", "N", "N"), ("moment", "N·m", "Nm")):
        lines = [Line("recorded", at_frames(f"{what}_{suffix}"), VERMILION)]
        if figures.effects:
            lines.append(Line("with causes", at_frames(f"{what}_after_{suffix}"), BLUE))
        lines.append(Line("ordinary", at_frames(f"{what}_floor_{suffix}"), GREY, dashed=True))
        charts.append(Chart(f"Residual {what}", unit, tuple(lines), shaded=~told))
    return tuple(charts)


def worst_frame(figures: DiagnosisReport, trial: str) -> int:
    """Where the worst half second of a trial begins that has charts."""
    found = _of_trial(figures, trial)
    assert found is not None
    return int(found.worst.frames[0])


def _of_trial(figures: DiagnosisReport, name: str) -> TrialResidual | None:
    trials = figures.residual.trials if figures.residual else ()
    return next((t for t in trials if t.trial == name), None)


def _told(
    windows_s: Float[np.ndarray, " windows"], frames_s: Float[np.ndarray, " frames"]
) -> Bool[np.ndarray, " frames"]:
    """Frames between two windows that follow one another."""
    if len(windows_s) < 2:
        return np.zeros(len(frames_s), dtype=bool)
    after = np.clip(np.searchsorted(windows_s, frames_s), 1, len(windows_s) - 1)
    gap = windows_s[after] - windows_s[after - 1]
    inside = (frames_s >= windows_s[0]) & (frames_s <= windows_s[-1])
    return np.asarray(inside & (gap <= BROKEN * np.diff(windows_s).min() + 1e-9))
