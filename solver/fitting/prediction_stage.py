"""What forces are predicted where nobody knows them: the prediction fit, made of fitted trials."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import uniform_filter1d

from solver.dynamics.cross_validation.held_out_layouts import frames_of
from solver.dynamics.force_prediction.learnt_terms import LearntTerms
from solver.dynamics.force_prediction.prediction_columns import PredictionTrial
from solver.dynamics.force_prediction.prediction_fit import Predicted, fit_prediction, fit_prediction_near
from solver.dynamics.trajectory.extension import Extension
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.fitting.fit_result import Groundwork, TrialFit
from solver.fitting.settings import Settings
from solver.fitting.state import FitState
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

# share of the known frames that edits of the flags may change before hidden blocks choose kinds anew:
# choosing takes three times as long as all the rest of a re-solve
KINDS_LAST = 0.4

PASSAGE_S = 0.1  # to either side of a border, from the fit's motion to the prediction fit's


def predict_missing_forces(state: FitState, settings: Settings) -> FitState:
    """What acts where a force is missing, by terms learnt where none is; the data then hold it.

    Near a small edit only the prediction near it is made anew; after other edits the terms of the former fit
    stay, where few frames have changed.
    """
    fits, groundwork, edit = state.members, state.groundwork, state.edit
    prediction: Predicted | None = None
    if edit is not None and edit.learnt is not None:
        trials = _begun_before(fits, state.data)
        prediction = replace(
            fit_prediction_near(
                state.weighed_skeleton,
                trials,
                edit.edited,
                settings.trajectory,
                settings.prediction,
                learnt=edit.learnt,
            ),
            notes=edit.settled.prediction_notes,
        )
    elif state.motion_only is not None or (edit is None and any(misses_a_force(fit) for fit in fits)):
        first = state.motion_only is not None
        prediction = prediction_fit_of(
            fits,
            state.data,
            state.motion_only,
            state.weighed_skeleton,
            settings,
            extension=state.extension,
            learnt=None if first else learnt_before(fits, groundwork),
            chosen=edit.kinds if edit is not None else None,
        )
    if prediction is None:
        return state
    # Near an edit, frames beyond it stay as they were: the search does not begin elsewhere.
    begun = state.motion_only if edit is None else None
    return replace(state, prediction=prediction, data=tuple(with_predicted(state.data, begun, prediction)))


def _begun_before(fits: Sequence[TrialFit], data: Sequence[TrialData]) -> list[PredictionTrial]:
    """Trials for a prediction fit that begins where the former one ended."""
    trials = []
    for fit, own in zip(fits, data, strict=True):
        assert fit.contacts is not None
        begun = replace(own, spline=fit.prediction_spline)
        trials.append(PredictionTrial(begun, fit.contacts.foot_bodies, fit.contacts.in_contact))
    return trials


def learnt_before(fits: Sequence[TrialFit], groundwork: Groundwork) -> LearntTerms | None:
    """What a re-solve need not learn anew; None where it has to.

    A few frames more or fewer change little of what repeats in every step. Where many have changed since
    hidden blocks chose the kinds of terms, or other trials take part, blocks are asked again.

    Args:
        fits: that take part, with contacts and mask.
        groundwork: of the former solve.
    """
    begun = all(fit.spline is not None and fit.prediction_spline is not None for fit in fits)
    known = {fit.capture.name: fit.forces_known for fit in fits}
    if groundwork.learnt is None or not begun or known.keys() != groundwork.learnt_on.keys():
        return None
    then = {name: frames_of(list(groundwork.learnt_on[name]), len(now)) for name, now in known.items()}
    changed = sum(int((then[name] != now).sum()) for name, now in known.items())
    before = sum(int(frames.sum()) for frames in then.values())
    return groundwork.learnt if changed <= KINDS_LAST * before else None


def prediction_fit_of(
    fits: Sequence[TrialFit],
    data: Sequence[TrialData],
    result: TrajectoryFit | None,
    skeleton: Skeleton,
    settings: Settings,
    *,
    extension: Extension | None,
    learnt: LearntTerms | None = None,
    chosen: Sequence[str] | None = None,
) -> Predicted | None:
    """The prediction fit of a trajectory fit; None where settings do without.

    Args:
        fits: with contacts.
        data: that the fit was given.
        result: of that fit; None: the prediction fit begins where an earlier one ended.
        skeleton: that it began with.
        settings: of every stage.
        extension: what acts beside the recorded forces.
        learnt: by that earlier prediction fit.
        chosen: kinds of terms that are known to predict better; None: hidden blocks choose.
    """
    if not settings.prediction.enabled:
        return None
    trials = _begun_before(fits, data)
    if result is not None:
        trials = [
            replace(trial, data=replace(own, spline=None, initial=motion))
            for trial, own, motion in zip(trials, data, result.motions, strict=True)
        ]
    extra = None
    if extension is not None and extension.parameters is not None:
        extra = extension.parameters if result is None else ExtraParameters(extension.prior_std, result.extra)
    return fit_prediction(
        skeleton,
        trials,
        settings.trajectory,
        settings.prediction,
        phi=None if result is None else result.phi,
        extra=extra,
        learnt=learnt,
        chosen=chosen,
    )


def with_predicted(
    data: Sequence[TrialData], result: TrajectoryFit | None, prediction_fit: Predicted
) -> list[TrialData]:
    """The same trials for a fit that is held, where forces are missing, by the predicted ones.

    Without them the motion would change its mind at the borders of what is known, and be noisier beyond.
    Where the two motions are far apart, the fit's own may lie in a valley of the cost without a way to the
    predicted forces; so where forces are missing, the search may begin at the prediction fit's.

    Args:
        data: of the fit so far.
        result: of it; the search goes on there, or at the prediction's motion if that costs less. None: where
            the data say.
        prediction_fit: of that fit.
    """
    if result is None:
        return [
            replace(own, predicted_ground=wrench)
            for own, wrench in zip(data, prediction_fit.wrenches_ground, strict=True)
        ]
    held = []
    for i, (own, wrench) in enumerate(zip(data, prediction_fit.wrenches_ground, strict=True)):
        between = _predicted_where_missing(result.motions[i], prediction_fit.motions[i], own.counts)
        held.append(replace(own, predicted_ground=wrench, spline=result.splines[i], other_start=between))
    return held


def _predicted_where_missing(
    fit: Motion, prediction_fit: Motion, known: Bool[np.ndarray, " frames"]
) -> Motion:
    """The prediction's motion where forces are missing, the fit's elsewhere, and a passage between them."""
    frames = 1 + 2 * max(1, round(PASSAGE_S * fit.rate))
    share = np.clip(2 * uniform_filter1d((~known).astype(float), frames), 0.0, 1.0)[:, None]
    return replace(fit, q=fit.q + share * (prediction_fit.q - fit.q))


def misses_a_force(fit: TrialFit) -> bool:
    """Whether torques of the trial rest on a wrench that nobody measured."""
    return fit.mask is not None and not fit.mask.counts.all()
