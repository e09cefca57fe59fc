"""The prediction fit: the trajectory fit with learnt terms beside the forces; what acts where one is missing.

    r_t = required(c, φ) − measured − C_t x,      x ~ N(0, prior_std²), shared by steps and trials

In the reported fit nothing of that kind takes part, so that its residual stays the person's and its motion is
not asked for by terms that nobody measured. It begins where the trajectory fit ended and is smoother, since
nobody reads its motion. What it gives is required(its motion, its inertias) − C x, the wrench that plates
would have read.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Bool, Float

from solver.common.frames_at_once import joined
from solver.common.notes import Note
from solver.dynamics.force_prediction.held_out_prediction import (
    INERTIA_PRIOR_WEIGHT,
    INERTIAS,
    HeldOutPrediction,
)
from solver.dynamics.force_prediction.learnt_columns import CONSTANTS, GAINS, STEPS, gain_notes
from solver.dynamics.force_prediction.learnt_terms import LearntTerms
from solver.dynamics.force_prediction.prediction_columns import OTHER, PredictionColumns, PredictionTrial
from solver.dynamics.force_prediction.settings import PredictionSettings
from solver.dynamics.inertia_parameters import inertia_parameters
from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.trajectory.frame_spans import Span, are_long, teaching_spans, windows
from solver.dynamics.trajectory.near_edits import spans_near, splice, with_levels
from solver.dynamics.trajectory.trajectory_search import take_steps
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import basis_for, knot_spacing
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

MARKER_SLOW_M = 0.0056  # [m] at least, of its markers: they follow where the forces call them
MARKER_GROWTH_M = 0.01  # [m/√s] at least, likewise: 1 mm from frame to frame at 100 Hz
SHARED_GROWTH = 0.0  # likewise: of no say beside such a smoothness
KINDS = (INERTIAS, STEPS, GAINS, CONSTANTS)
FIT_STEPS = 2  # from the trajectory fit, whose weights are others, or from an earlier prediction fit


def held_out_prediction(
    skeleton: Skeleton,
    trials: Sequence[PredictionTrial],
    trajectory: TrajectorySettings,
    settings: PredictionSettings,
    *,
    phi: Float[np.ndarray, " parameters"] | None,
    extra: ExtraParameters,
    is_at_its_end: bool = False,
) -> HeldOutPrediction:
    """Where a trajectory fit ended, as kinds are chosen; or where the prediction fit ends without any.

    Other arguments are those of `fit_prediction`, trials no longer than one problem can be.
    """
    weights = _weights(trajectory, settings)
    if is_at_its_end:
        plain = [trial.data for trial in trials]
        ended = take_steps(skeleton, plain, weights, FIT_STEPS, phi=phi, extra=extra)
        phi = ended.phi
        trials = [
            replace(trial, data=replace(trial.data, spline=spline))
            for trial, spline in zip(trials, ended.splines, strict=True)
        ]
    return _held_out(skeleton, PredictionColumns(skeleton, settings, trials, extra), weights, phi, KINDS)


def _held_out(
    skeleton: Skeleton,
    made: PredictionColumns,
    weights: TrajectorySettings,
    phi: Float[np.ndarray, " parameters"] | None,
    kinds: Sequence[str],
) -> HeldOutPrediction:
    every = made.parameters(kinds)
    return HeldOutPrediction(
        skeleton,
        [trial.data for trial in made.trials],
        weights,
        phi=phi,
        parameters=every,
        with_columns=lambda data: made.with_columns(data, kinds),
        kinds=[kind for kind in kinds if kind == INERTIAS or kind in every.of],
        always=(OTHER,),
        peak_N=made.peak_N,
    )


@dataclass(frozen=True)
class Predicted:
    """What the prediction fit says of all trials."""

    wrenches_ground: tuple[Float[np.ndarray, "frames 6"], ...]  # [N, N·m about the ground origin] of all feet
    skeleton: Skeleton  # with the prediction fit's inertias
    kinds: tuple[str, ...]  # of terms that predict better
    notes: tuple[Note, ...]  # what the learnt gains may point to
    motions: tuple[Motion, ...]
    splines: tuple[Float[np.ndarray, "coefficients dofs"], ...]  # of these motions
    learnt: LearntTerms


def fit_prediction(
    skeleton: Skeleton,
    trials: Sequence[PredictionTrial],
    trajectory: TrajectorySettings,
    settings: PredictionSettings,
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters | None = None,
    kinds: Sequence[str] = KINDS,
    chosen: Sequence[str] | None = None,
    learnt: LearntTerms | None = None,
) -> Predicted:
    """Fit the prediction fit, with the kinds of terms that predict known forces better, if any.

    Args:
        skeleton: scaled, with the entered mass; as the trajectory fit began with.
        trials: of the subject.
        trajectory: settings of the fit whose prediction fit this is.
        settings: of the learnt terms.
        phi: inertias of that fit.
        extra: x of the trials' extra columns, where a diagnosis has added some: they act on the body, and the
            wrench here is what remains beside them.
        kinds: of terms to choose among.
        chosen: those that are known to predict better; None: hidden blocks choose.
        learnt: by an earlier prediction fit, whose splines the trials begin with: its kinds stay.

    Raises:
        FitError: as the trajectory fit.
    """
    extra = extra or ExtraParameters.none()
    weights = _weights(trajectory, settings)
    together = partial(
        _together,
        skeleton,
        weights=weights,
        settings=settings,
        phi=phi,
        extra=extra,
        kinds=kinds,
        chosen=chosen,
        learnt=learnt,
    )
    if not are_long([len(trial.data.counts) for trial in trials], weights):
        return together(trials)
    spacing = [knot_spacing(trial.data.start, weights) for trial in trials]
    trials = [_with_levels(trial, skeleton, weights) for trial in trials]
    spans = teaching_spans([trial.data for trial in trials], spacing, weights)
    taught = together([trials[s.trial].part(s.start, s.end, spacing[s.trial]) for s in spans])
    made = PredictionColumns(skeleton, settings, trials, extra, taught.learnt.peak_N)
    return _in_windows(taught, made, spacing, weights)


def _weights(trajectory: TrajectorySettings, settings: PredictionSettings) -> TrajectorySettings:
    """The prediction fit's, beside those of the fit whose prediction fit it is."""
    return replace(
        trajectory,
        smoothness=settings.smoothness,
        least_marker_slow_m=MARKER_SLOW_M,
        least_marker_growth_m=MARKER_GROWTH_M,
        shared_growth=SHARED_GROWTH,
        residual_force_std_N=settings.residual_force_std_N,
        residual_moment_std_Nm=settings.residual_moment_std_Nm,
        knot_spacing_s=settings.knot_spacing_s,
    )


def _with_levels(trial: PredictionTrial, skeleton: Skeleton, weights: TrajectorySettings) -> PredictionTrial:
    return replace(trial, data=with_levels(skeleton, trial.data, weights))


def _together(
    skeleton: Skeleton,
    trials: Sequence[PredictionTrial],
    weights: TrajectorySettings,
    settings: PredictionSettings,
    *,
    phi: Float[np.ndarray, " parameters"] | None,
    extra: ExtraParameters,
    kinds: Sequence[str],
    chosen: Sequence[str] | None,
    learnt: LearntTerms | None,
) -> Predicted:
    """All trials as one problem."""
    made = PredictionColumns(skeleton, settings, trials, extra)
    plain = [trial.data for trial in trials]
    if learnt is not None:
        taken, phi = learnt.kinds, learnt.phi
    elif chosen is not None:
        taken = tuple(chosen)
    else:
        taken = _held_out(skeleton, made, weights, phi, kinds).best_kinds()
    if INERTIAS in taken:
        weights = replace(weights, inertia_prior_weight=INERTIA_PRIOR_WEIGHT * weights.inertia_prior_weight)
    parameters, data = made.parameters(taken), made.with_columns(plain, taken)
    start = parameters.prior
    if learnt is not None and len(learnt.x) == len(start.start):
        start = replace(start, start=learnt.x)
    prediction_fit = take_steps(skeleton, data, weights, FIT_STEPS, phi=phi, extra=start)
    wrenches = []
    for motion, trial in zip(prediction_fit.motions, data, strict=True):
        beside = trial.with_fixed_extra(prediction_fit.extra).extra_wrench_ground
        wrenches.append(required_ground(prediction_fit.skeleton, motion) - beside)
    gains = parameters.some((GAINS,))
    notes: tuple[Note, ...] = ()
    if gains.any():
        variance = np.diag(prediction_fit.extra_covariance)[gains]
        notes = gain_notes(prediction_fit.extra[gains], np.sqrt(variance))
    return Predicted(
        tuple(wrenches),
        prediction_fit.skeleton,
        taken,
        notes,
        prediction_fit.motions,
        prediction_fit.splines,
        LearntTerms(taken, prediction_fit.phi, prediction_fit.extra, made.peak_N),
    )


def _in_windows(
    taught: Predicted, made: PredictionColumns, spacing: Sequence[int], weights: TrajectorySettings
) -> Predicted:
    """Every trial by itself with the learnt terms and inertias of some of the frames, window by window.

    Args:
        taught: by these frames.
        made: of all trials, with levels, at the peak force of these frames.
        spacing: of their splines [frames].
        weights: of the prediction fit.
    """
    fixed = replace(weights, fit_inertias=False)
    wrenches, motions, splines = [], [], []
    for i, trial in enumerate(made.trials):
        spans = windows(i, len(trial.data.counts), spacing[i], weights)
        parts = []
        for span in spans:
            data = made.window(span, taught.kinds, spacing[i]).with_fixed_extra(taught.learnt.x)
            own = take_steps(taught.skeleton, [data], fixed, FIT_STEPS, extra=ExtraParameters.none())
            wrench = required_ground(taught.skeleton, own.motions[0]) - data.extra_wrench_ground
            parts.append((wrench, own.motions[0].q, own.splines[0]))
        starts = [span.start for span in spans]
        wrenches.append(joined([wrench for wrench, _, _ in parts], starts))
        motions.append(replace(trial.data.start, q=joined([q for _, q, _ in parts], starts)))
        splines.append(joined([c for _, _, c in parts], [start // spacing[i] for start in starts]))
    return replace(taught, wrenches_ground=tuple(wrenches), motions=tuple(motions), splines=tuple(splines))


def fit_prediction_near(
    skeleton: Skeleton,
    trials: Sequence[PredictionTrial],
    edited: Sequence[Bool[np.ndarray, " frames"]],
    trajectory: TrajectorySettings,
    settings: PredictionSettings,
    *,
    learnt: LearntTerms,
) -> Predicted:
    """The prediction fit after an edit, near it alone: what was learnt of the person stays.

    Args:
        skeleton: as for the prediction fit of all frames.
        trials: that begin with her splines.
        edited: by trial, frames whose force was not known and now is, or the other way round.
        trajectory: settings of the fit whose prediction fit this is.
        settings: of the learnt terms.
        learnt: by her, without columns of an extension.
    """
    weights = _weights(trajectory, settings)
    fixed = replace(weights, fit_inertias=False)
    inertias = inertia_parameters(skeleton)
    fitted = inertias.skeleton_at(learnt.phi) if weights.fit_inertias else skeleton
    spacing = [knot_spacing(trial.data.start, weights) for trial in trials]
    spans = spans_near(edited, [trial.data.start for trial in trials], weights)
    near = {span.trial for span in spans}
    trials = [_with_levels(t, skeleton, weights) if i in near else t for i, t in enumerate(trials)]
    made = PredictionColumns(skeleton, settings, trials, ExtraParameters.none(), learnt.peak_N)

    def beside(span: Span) -> TrialData:
        data = made.window(span, learnt.kinds, spacing[span.trial], held=True)
        return data.with_fixed_extra(learnt.x)

    splines = []
    for trial in trials:
        assert trial.data.spline is not None
        splines.append(trial.data.spline)
    for span in spans:
        i = span.trial
        own = take_steps(fitted, [beside(span)], fixed, 1, extra=ExtraParameters.none())
        splines[i] = splice(splines[i], own.splines[0], span.start // spacing[i])
    motions, wrenches = [], []
    for i, (trial, spline) in enumerate(zip(made.trials, splines, strict=True)):
        motion = replace(trial.data.start, q=basis_for(trial.data.start, weights).evaluate(spline))
        motions.append(motion)
        if trial.data.counts.all():
            wrenches.append(trial.data.wrench_ground)
            continue
        spans_of_all = windows(i, motion.frames, spacing[i], weights)
        acting = []
        for span in spans_of_all:
            wrench = beside(span).extra_wrench_ground
            assert wrench is not None
            acting.append(wrench)
        learnt_ground = joined(acting, [span.start for span in spans_of_all])
        wrenches.append(required_ground(fitted, motion) - learnt_ground)
    return Predicted(tuple(wrenches), fitted, learnt.kinds, (), tuple(motions), tuple(splines), learnt)
