"""A wrench that repeats with the step: curves over its phase, mirrored from left to right."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import BSpline

from solver.dynamics.force_prediction.columns import Columns
from solver.dynamics.force_prediction.footfalls import Footfalls
from solver.dynamics.force_prediction.heading_frame import HeadingFrame
from solver.dynamics.force_prediction.settings import PredictionSettings

KIND = "steps"
FEWEST_STEPS = 1  # whole ones, seen at both ends
MIRRORED = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])  # lateral force, roll and turning moment change sign


@dataclass(frozen=True)
class StepPhases:
    """Where in a step each frame is."""

    phase: Float[np.ndarray, " frames"]  # 0 to 1; NaN where nobody steps
    mirrored: Bool[np.ndarray, " frames"]  # the step began with the second foot

    def between(self, start: int, end: int) -> "StepPhases":
        """Frames `start` to `end` (excluded) alone."""
        return StepPhases(self.phase[start:end], self.mirrored[start:end])


def step_phases(falls: Footfalls, frames: int, settings: PredictionSettings) -> StepPhases | None:
    """Phases of two-legged steps; None where fewer than two whole steps are seen.

    A step lasts from one foot's fall to the other's. Before the first and after the last fall one usual step
    is assumed. Where a foot falls twice in a row, or a step takes much longer or shorter than the usual one,
    nobody steps.

    Args:
        falls: of the trial.
        frames: of the trial.
        settings: what is a step.
    """
    times, feet = falls.frames, falls.feet
    lasts, turns = np.diff(times), np.diff(feet) != 0
    if turns.sum() < FEWEST_STEPS:
        return None
    usual = float(np.median(lasts[turns]))
    times = np.concatenate([[times[0] - usual], times, [times[-1] + usual]])
    feet = np.concatenate([[1 - feet[0]], feet])
    lasts = np.diff(times)
    turns = np.concatenate([[True], turns, [True]])
    sound = turns & (lasts < settings.step_change * usual) & (lasts > usual / settings.step_change)
    if sound[1:-1].sum() < FEWEST_STEPS:
        return None
    t = np.arange(frames)
    step = np.searchsorted(times, t, side="right") - 1
    inside = (step >= 0) & (step < len(lasts))
    step = step.clip(0, len(lasts) - 1)
    stepping = inside & sound[step]
    phase = np.where(stepping, (t - times[step]) / lasts[step], np.nan)
    return StepPhases(phase, stepping & (feet[step] == 1))


def periodic_splines(phase: Float[np.ndarray, " frames"], knots: int) -> Float[np.ndarray, "frames knots"]:
    """Cubic B-splines over 0 to 1 that meet themselves at the ends; zero where the phase is NaN."""
    bump = BSpline.basis_element(np.arange(-2.0, 3.0), extrapolate=False)
    distance = np.nan_to_num(phase, nan=0.0)[:, None] * knots - np.arange(knots)
    distance = (distance + knots / 2) % knots - knots / 2
    return np.where(np.isnan(phase)[:, None], 0.0, np.nan_to_num(bump(distance)))


def step_columns(
    phases: StepPhases | None, frame: HeadingFrame, peak_N: float, settings: PredictionSettings
) -> Columns:
    """Six curves, one axis after the other; zero for a trial without steps.

    Args:
        phases: of the trial.
        frame: of the trial.
        peak_N: of the force that the person's motions demand.
        settings: knots and scatter of the curves.
    """
    frames, knots = len(frame.origin_ground), settings.phase_knots
    std = peak_N * np.repeat([settings.phase_force_share, settings.phase_arm_m], 3 * knots)
    if phases is None:
        return Columns(KIND, np.zeros((frames, 6, 6 * knots)), std)
    sign = np.where(phases.mirrored[:, None], MIRRORED, 1.0)
    splines = periodic_splines(phases.phase, knots)
    curves = np.eye(6)[None, :, :, None] * sign[:, :, None, None] * splines[:, None, None, :]
    return Columns(KIND, frame.to_ground(curves.reshape(frames, 6, 6 * knots)), std)
