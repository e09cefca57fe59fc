"""The trajectory fit after an edit, near it alone: the motion elsewhere and the inertias stay as they are.

A frame's force bends the motion for some tenths of a second around it. What it says of the inertias is one
frame's word among thousands. So a stretch around the edited frames is fitted with its ends held, and costs
the same whether the subject has one trial or twenty.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.common.one_thread import one_thread
from solver.common.progress import Progress
from solver.common.true_runs import runs
from solver.dynamics.inertia_parameters import inertia_parameters
from solver.dynamics.trajectory.frame_spans import Span, unite_spans
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit, searched
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import (
    TrajectorySolver,
    basis_for,
    knot_spacing,
    trial_levels,
)
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class InertiasBefore:
    """Of an earlier fit of all frames."""

    phi: Float[np.ndarray, " parameters"]
    asked_phi: Float[np.ndarray, " parameters"]  # as in its `TrajectoryFit`


def spans_near(
    edited: Sequence[Bool[np.ndarray, " frames"]], motions: Sequence[Motion], settings: TrajectorySettings
) -> list[Span]:
    """Stretches around edited frames, from knot to knot.

    Args:
        edited: by trial, frames whose force was not known and now is, or the other way round.
        motions: of the trials.
        settings: how far an edit reaches; the knots.
    """
    spans = []
    for i, (frames, motion) in enumerate(zip(edited, motions, strict=True)):
        spacing, reach = knot_spacing(motion, settings), round(settings.edit_reach_s * motion.rate)
        for start, end in runs(frames):
            first = max(0, start - reach) // spacing * spacing
            last = first + -(-(end + reach - first) // spacing) * spacing + 1
            spans.append(Span(i, first, min(last, len(frames))))
    return unite_spans(spans)


def with_levels(skeleton: Skeleton, trial: TrialData, settings: TrajectorySettings) -> TrialData:
    """The trial with the levels that its parts are to have as well."""
    kinematics = ForwardKinematics(skeleton)
    return replace(trial, levels=trial_levels(kinematics, trial.observed_ground, trial.start, settings))


def splice(
    whole: Float[np.ndarray, "coefficients dofs"], part: Float[np.ndarray, "some dofs"], first: int
) -> Float[np.ndarray, "coefficients dofs"]:
    """A spline with the coefficients of a part, whose ends were held, in place of its own.

    Args:
        whole: of the trial.
        part: of some of its frames.
        first: coefficient of the whole that the part's first one is.
    """
    changed = whole.copy()
    changed[first : first + len(part)] = part
    return changed


def fit_near_edits(
    skeleton: Skeleton,
    trials: Sequence[TrialData],
    edited: Sequence[Bool[np.ndarray, " frames"]],
    settings: TrajectorySettings,
    progress: Progress,
    *,
    before: InertiasBefore,
) -> TrajectoryFit:
    """All trials, those stretches made anew; its costs are theirs.

    Args:
        skeleton: as for the fit of all frames.
        trials: with the splines of the former fit.
        edited: by trial, which frames.
        settings: of that fit.
        progress: told the fraction done; may raise `Cancelled`.
        before: of that fit.
    """
    inertias = inertia_parameters(skeleton)
    fitted = inertias.skeleton_at(before.phi) if settings.fit_inertias else skeleton
    spans = spans_near(edited, [trial.start for trial in trials], settings)
    spacing = [knot_spacing(trial.start, settings) for trial in trials]
    weighted = {i: with_levels(skeleton, trials[i], settings) for i in {span.trial for span in spans}}
    parts = [weighted[s.trial].part(s.start, s.end, spacing[s.trial], held=True) for s in spans]
    splines = []
    for trial in trials:
        assert trial.spline is not None
        splines.append(trial.spline)
    if parts:
        with one_thread():
            solver = TrajectorySolver(fitted, parts, replace(settings, fit_inertias=False))
            near = searched(solver, progress, None, edited=True)
        for span, part in zip(spans, near.splines, strict=True):
            i = span.trial
            splines[i] = splice(splines[i], part, span.start // spacing[i])
    motions = [
        replace(trial.start, q=basis_for(trial.start, settings).evaluate(spline))
        for trial, spline in zip(trials, splines, strict=True)
    ]
    return TrajectoryFit(
        skeleton=fitted,
        motions=tuple(motions),
        splines=tuple(splines),
        phi=before.phi,
        iterations=near.iterations if parts else 0,
        converged=near.converged if parts else True,
        notes=near.notes if parts else (),
        costs=near.costs if parts else (),
        asked_phi=before.asked_phi,
    )
