"""A re-solve after an edit of the flags: near the edit alone, as long as little else follows from it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from solver.common.progress import Progress, silent
from solver.common.runs import runs
from solver.dynamics.cross_validation.hidden_steps import frames_of
from solver.dynamics.force_prediction.learnt_terms import LearntTerms
from solver.dynamics.force_prediction.prediction_columns import PredictionTrial
from solver.dynamics.force_prediction.prediction_fit import Predicted, predicted_near
from solver.dynamics.trajectory.extension import Extension
from solver.dynamics.trajectory.near_edits import InertiasBefore, fitted_near, spans_near
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit
from solver.dynamics.trajectory.trial_data import TrialData
from solver.fitting.fit import Groundwork, SettledFit, TrialFit
from solver.fitting.prediction_stage import learnt_before, misses_a_force, prediction_fit_of, with_predicted
from solver.fitting.settings import Settings
from solver.fitting.weighing_stage import Weighed
from solver.skeleton.skeleton import Skeleton

MOST_NEAR = 0.5  # of all frames; with more, the whole costs no more


@dataclass(frozen=True)
class Edit:
    """What changed since the former fit, where that is little."""

    edited: tuple[Bool[np.ndarray, " frames"], ...]  # by trial
    told: Weighed  # as the former fit took it
    settled: SettledFit
    inertias: InertiasBefore
    learnt: LearntTerms | None  # None: nothing was predicted
    kinds: tuple[str, ...] | None  # of learnt terms, where a first prediction fit is to be made


def small_edit(
    fits: Sequence[TrialFit],
    told: Weighed,
    groundwork: Groundwork,
    settings: Settings,
    extension: Extension | None,
) -> Edit | None:
    """The edit, if it can be followed near it alone; None where all frames have to be asked.

    Flags change what plates say of the mass and of a trial's gain by next to nothing, and with it every
    frame: so little is left as it was. A gain that moves more makes its whole trial anew, a mass that does
    all of them. What adds up over many edits is held against the last fit of all frames.

    Args:
        fits: that take part, with contacts and mask.
        told: by plates, of the mass and of their gains.
        groundwork: of the former fit.
        settings: of every stage.
        extension: what acts beside the recorded forces; its parameters hang on all frames.
    """
    settled = groundwork.settled
    names = {fit.capture.name for fit in fits}
    if extension is not None or settled is None or groundwork.phi is None or names != settled.known.keys():
        return None
    if any(fit.spline is None for fit in fits):
        return None
    learnt, kinds = None, None
    if settings.prediction.enabled and (groundwork.learnt or any(misses_a_force(fit) for fit in fits)):
        learnt, kinds = learnt_before(fits, groundwork, settings), groundwork.prediction_kinds
        first = all(fit.prediction_spline is None for fit in fits)
        if learnt is None and (kinds is None or not first):
            return None
    weights = settings.trajectory
    if abs(told.mass_kg / settled.mass_kg - 1) > weights.edit_gain:
        return None
    gains = [settled.gains[fit.capture.name] for fit in fits]
    regained = [abs(now / then - 1) > weights.edit_gain for now, then in zip(told.gains, gains, strict=True)]
    known = [fit.forces_known for fit in fits]
    whole = [frames_of(list(settled.known_to_all[f.capture.name]), f.motion.frames) for f in fits]
    before = [frames_of(list(settled.known[f.capture.name]), f.motion.frames) for f in fits]
    changed = sum(int((now != then).sum()) for now, then in zip(known, whole, strict=True))
    if changed > weights.edits_last * sum(int(then.sum()) for then in whole):
        return None
    edited = tuple((now != then) | anew for now, then, anew in zip(known, before, regained, strict=True))
    spans = spans_near(edited, [fit.motion for fit in fits], weights)
    if sum(span.frames for span in spans) > MOST_NEAR * sum(len(frames) for frames in edited):
        return None
    taken = tuple(now if anew else then for now, then, anew in zip(told.gains, gains, regained, strict=True))
    inertias = InertiasBefore(groundwork.phi, settled.asked_phi)
    return Edit(edited, replace(told, mass_kg=settled.mass_kg, gains=taken), settled, inertias, learnt, kinds)


def fitted_near_edit(
    edit: Edit,
    fits: Sequence[TrialFit],
    data: Sequence[TrialData],
    skeleton: Skeleton,
    *,
    settings: Settings,
    progress: Progress,
) -> tuple[TrajectoryFit, Predicted | None]:
    """The trajectories and what the prediction fit predicts, made anew near the edit.

    Args:
        edit: small.
        fits: with contacts.
        data: of these, with the splines of the former fit.
        skeleton: with the mass that the former fit began with.
        settings: of every stage.
        progress: told the fraction done; may raise `Cancelled`.
    """
    prediction_fit, trials = None, list(data)
    if edit.learnt is None and edit.kinds is not None:
        former = fitted_near(
            skeleton,
            data,
            [np.zeros(len(own.counts), dtype=bool) for own in data],
            settings.trajectory,
            silent,
            before=edit.inertias,
        )
        prediction_fit = prediction_fit_of(
            fits, data, former, skeleton, settings, extension=None, chosen=edit.kinds
        )
    elif edit.learnt is not None:
        hers = [
            PredictionTrial(
                replace(own, spline=fit.prediction_spline), fit.contacts.foot_bodies, fit.contacts.in_contact
            )
            for own, fit in zip(data, fits, strict=True)
            if fit.contacts is not None
        ]
        told = predicted_near(
            skeleton, hers, edit.edited, settings.trajectory, settings.prediction, learnt=edit.learnt
        )
        prediction_fit = replace(told, notes=edit.settled.prediction_notes)
    if prediction_fit is not None:
        trials = with_predicted(data, None, prediction_fit)
    result = fitted_near(skeleton, trials, edit.edited, settings.trajectory, progress, before=edit.inertias)
    return result, prediction_fit


def settled_fit(
    fits: Sequence[TrialFit],
    told: Weighed,
    result: TrajectoryFit,
    prediction_fit: Predicted | None,
    edit: Edit | None,
) -> SettledFit:
    """What the next re-solve goes by.

    Args:
        fits: that take part.
        told: that they were fitted with.
        result: of the fit.
        prediction_fit: of it.
        edit: None: all frames were asked.
    """
    known = {fit.capture.name: tuple(runs(fit.forces_known)) for fit in fits}
    return SettledFit(
        mass_kg=told.mass_kg,
        gains={fit.capture.name: gain for fit, gain in zip(fits, told.gains, strict=True)},
        asked_phi=result.asked_phi,
        prediction_notes=prediction_fit.notes if prediction_fit is not None else (),
        known=known,
        known_to_all=known if edit is None else edit.settled.known_to_all,
    )
