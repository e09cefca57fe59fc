"""How the errors of one frame's torques go together: their joint covariance, on demand."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.common.errors import FitError
from solver.dynamics.trajectory.extension import Extension
from solver.dynamics.trajectory.uncertainty import torque_errors
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.predicted_std import torque_errors_by_prediction
from solver.fitting.seen_part import seen_part
from solver.fitting.settings import Settings
from solver.fitting.state import MassAndGains
from solver.fitting.torques_stage import error_sizes, loads_of, torque_errors_by_plates
from solver.fitting.trajectory_stage import all_data, before_forces, extra_of


def torque_covariance(
    fit: Fit, trial: TrialFit, frame: int, settings: Settings, extension: Extension | None = None
) -> Float[np.ndarray, "dofs dofs"]:
    """Joint covariance of a frame's torques [N·m or N, squared]; NaN where a torque has no band.

    Its diagonal is the square of `TrialStd.torque`; how errors go together comes from `frame_errors`.

    Args:
        fit: of the subject.
        trial: of it.
        frame: of the trial.
        settings: of the fit.
        extension: of the fit.

    Raises:
        FitError: the trial's torques have no bands, or it has no such frame.
    """
    name = trial.capture.name
    if not 0 <= frame < trial.motion.frames:
        raise FitError(f"{name}: has frames 0 to {trial.motion.frames - 1}; frame {frame} is none of them.")
    if trial.std is None or fit.groundwork is None or fit.groundwork.settled is None:
        raise FitError(f"{name}: its motion was not fitted to forces, so its torques have no bands.")
    std = trial.std.torque[frame]
    if np.isnan(std).all():
        return np.full((len(std), len(std)), np.nan)
    errors = frame_errors(fit, trial, frame, settings, extension)
    size = np.linalg.norm(errors, axis=1)
    scaled = errors * np.divide(std, size, out=np.zeros_like(size), where=size > 0)[:, None]
    return np.asarray(scaled @ scaled.T)


def frame_errors(
    fit: Fit, trial: TrialFit, frame: int, settings: Settings, extension: Extension | None = None
) -> Float[np.ndarray, "dofs errors"]:
    """Independent errors of a frame's torques, a column each: markers, tables, plates, predicted wrenches.

    Arguments as of `torque_covariance`, of a trial with bands.
    """
    assert fit.groundwork is not None
    assert fit.groundwork.settled is not None
    seen, gain = seen_part(trial), fit.groundwork.settled.gains[trial.capture.name]
    own = frame if seen is trial else frame - int(np.argmax(trial.motion.posed))
    x = extension.x if extension is not None else np.zeros(0)
    wrenches, loads = loads_of(seen, extra_of(seen, extension), x)
    weighed = MassAndGains(fit.groundwork.settled.mass_kg, (gain,))
    (data,) = all_data([before_forces(seen)], fit.groundwork.match, weighed, extension)
    if seen.prediction_spline is not None:
        data = replace(data, predicted_ground=wrenches.sum(axis=1) / gain)
    assert seen.spline is not None
    by_markers_and_tables = torque_errors(
        fit.skeleton,
        data.with_fixed_extra(x),
        seen.spline,
        loads,
        settings.trajectory,
        sizes=error_sizes(fit.subject),
        frame=own,
    )
    by_plates = torque_errors_by_plates(seen, wrenches, fit.skeleton, own)
    by_prediction = torque_errors_by_prediction(trial, fit.skeleton, fit.held_out_layouts, frame)
    return np.hstack([by_markers_and_tables, by_plates, by_prediction])
