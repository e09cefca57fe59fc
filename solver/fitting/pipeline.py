"""The whole solve as a row of stages, each `stage(state, settings) -> state`; and again after an edit.

Markers come in with `fit_markers`, people's reviews, forces, masses, learnt terms and torques with `finish`.
A re-solve is `finish` alone, begun with the marker fits of a former one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from solver.capture.capture import Capture, Subject, TrialFiles
from solver.common.cpu_timer import CpuTimer
from solver.common.errors import FitError
from solver.common.memory_release import release_memory
from solver.common.progress import Progress, part, silent
from solver.contact.force_review import ForceReview
from solver.dynamics.memory import refuse_what_does_not_fit, sizes_of
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.edit_stage import follow_small_edit
from solver.fitting.failing_trials import Failed, together, without_failing
from solver.fitting.fit_result import Fit
from solver.fitting.held_out_stage import predict_held_out, with_figures_of
from solver.fitting.mass_stage import weigh_body
from solver.fitting.model_stage import read_recordings, repair_labels, scale_model, weigh_who_stands
from solver.fitting.prediction_stage import predict_missing_forces
from solver.fitting.provenance import provenance_of, without_reviews
from solver.fitting.result_stage import (
    as_fit,
    lay_into_whole,
    leave_out_impossible_angles,
    note_what_is_predicted,
)
from solver.fitting.review_stage import (
    apply_reviews,
    cut_to_seen_part,
    detect_missing_forces,
    estimate_person,
    is_mass_guessed,
)
from solver.fitting.settings import Settings, decide_the_same_fit
from solver.fitting.state import FitState, Session
from solver.fitting.torques_stage import compute_torques, estimate_std
from solver.fitting.tracking_stage import (
    assign_forces,
    former_marker_fit,
    leave_out_turning_head,
    track_markers,
    track_with_kept_model,
)
from solver.fitting.trajectory_stage import collect_data, fit_before_prediction, fit_motions, take_motions
from solver.skeleton.skeleton import Skeleton

SCALED, TRACKED, FITTED = 0.2, 0.4, 0.75  # shares of the work done after scaling, marker fit, trajectory fit


def solve(
    subject: Subject,
    settings: Settings,
    *,
    trials: Sequence[str] | None = None,
    reviews: Mapping[str, ForceReview] | None = None,
    captures: Mapping[str, Capture] | None = None,
    extension: Extension | None = None,
    before_fitting: Callable[[Skeleton, Sequence[Capture]], None] | None = None,
    held_out: bool = True,
    session: Session | None = None,
    progress: Progress = silent,
) -> Fit:
    """Scale the model to the subject, fit every trial's motion, and compute its dynamics.

    Args:
        subject: as `open_subject` found it.
        settings: of every stage.
        trials: names of the trials to solve; None for all.
        reviews: by trial, what people say about the forces; where they say nothing, the trial's review.json
            decides, and where that says nothing detection.
        captures: recordings in place of those that the files hold, by trial; repaired markers, say.
        extension: causes that a diagnosis found and a person accepted: what acts beside the recorded forces,
            and which labels are exchanged.
        before_fitting: given the model with the markers to be fitted, and the recordings as read; what it
            raises stops the solve before any time is spent on it.
        held_out: whether held-out forces are predicted as well; else they are left due.
        session: what former trials left of the person's model, and where this solve leaves it; None: the
            model is scaled to these trials alone.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        SolverError: no trial can be read, or the model or the data cannot be used; the message says which
            and what to do. A trial that cannot be read or fitted beside others is left out, and told.
    """
    solve_some = partial(_solve, subject, settings, reviews or {}, captures or {}, extension=extension)
    doing = partial(
        solve_some, before_fitting=before_fitting, held_out=held_out, session=session, progress=progress
    )
    return without_failing(subject, trials, doing)


def _solve(
    subject: Subject,
    settings: Settings,
    reviews: Mapping[str, ForceReview],
    captures: Mapping[str, Capture],
    chosen: Sequence[TrialFiles],
    *,
    failed: Failed,
    extension: Extension | None,
    before_fitting: Callable[[Skeleton, Sequence[Capture]], None] | None,
    held_out: bool,
    session: Session | None,
    progress: Progress,
) -> Fit:
    """These trials together, told which failed before."""
    state = read_recordings(
        subject, chosen, settings, instead=captures, failed=failed, extension=extension, progress=progress
    )
    if before_fitting is not None:
        before_fitting(state.skeleton, state.recordings.captures)
    state = fit_markers(replace(state, reviews=reviews, session=session), settings, progress)
    fit = together(
        state.trials,
        lambda trial: trial.capture.name,
        lambda some: finish(replace(state, trials=tuple(some)), settings, part(progress, TRACKED, FITTED)),
    )
    del state  # where the markers alone had the model's
    release_memory()
    if not held_out:
        return fit
    return predict_held_out(fit, settings, part(progress, FITTED, 1.0), extension)


def fit_markers(state: FitState, settings: Settings, progress: Progress) -> FitState:
    """From recordings to motions that follow the markers alone, and forces that belong to feet.

    Args:
        state: as `read_recordings` began it.
        settings: of every stage.
        progress: told the stage and the fraction done; may raise `Cancelled`.
    """
    _refuse_what_does_not_fit(state.recordings.captures, state, settings)
    state = leave_out_turning_head(repair_labels(state, settings))
    tracked = track_with_kept_model(state, settings, part(progress, SCALED, TRACKED))
    if tracked is None:
        state = scale_model(state, settings, part(progress, 0.0, SCALED))
        tracked = track_markers(state, settings, part(progress, SCALED, TRACKED))
    state = weigh_who_stands(tracked, settings)
    return assign_forces(state, settings)


def finish(state: FitState, settings: Settings, progress: Progress, *, with_std: bool = True) -> Fit:
    """From there to the whole fit: all that reviews may change. Held-out forces are left due.

    Args:
        state: as `fit_markers` left it, or begun with a former fit.
        settings: of every stage.
        progress: told the stage and the fraction done; may raise `Cancelled`.
        with_std: and how far it may be off.

    Raises:
        FitError: a review is of another number of frames, or of another foot.
    """
    state = cut_to_seen_part(state)
    state = apply_reviews(state, settings)
    state = estimate_person(state, settings)
    state = detect_missing_forces(state, settings)
    if is_mass_guessed(state):  # plates may tell it without the frames that miss a force
        state = estimate_person(state, settings)
        state = detect_missing_forces(state, settings)
    state = fit_to_forces(state, settings, progress)
    state = note_what_is_predicted(state, settings)
    state = compute_torques(state, settings)
    if with_std:
        state = estimate_std(state, settings)
    state = lay_into_whole(state)
    state = leave_out_impossible_angles(state)
    return as_fit(state, settings)


def fit_to_forces(state: FitState, settings: Settings, progress: Progress) -> FitState:
    """Trajectories of all trials that have forces enough, fitted together; the others stay as they are.

    Where a force is missing, the fit is held by what a prediction fit predicts. A first prediction fit begins
    where the fit ends without it; a later one where the former one ended.

    Args:
        state: its trials with contacts and mask; the search begins at their splines, where they have some,
            and at the groundwork's inertias.
        settings: of every stage.
        progress: told the fraction done; may raise `Cancelled`.
    """
    cpu_timer = CpuTimer()
    with cpu_timer("dynamics"):
        state = weigh_body(state, settings)
        state = follow_small_edit(state, settings)
        state = collect_data(state, settings)
        state = fit_before_prediction(state, settings, progress)
        state = predict_missing_forces(state, settings)
        state = fit_motions(state, settings, progress)
    return take_motions(replace(state, seconds=cpu_timer.seconds), settings)


def resolve(
    previous: Fit,
    reviews: Mapping[str, ForceReview],
    settings: Settings,
    progress: Progress = silent,
    *,
    extension: Extension | None = None,
    with_std: bool = True,
) -> Fit:
    """The same trials after an edit of the reviews; the search begins where the previous fit ended.

    Files, scaling, marker fit and the feet that forces belong to are taken from the previous fit: no review
    changes them. After a small edit the motion is made anew near it alone, and other trials stay as they
    are; so do figures on held-out forces, but for those that were edited. Else these wait for
    `predict_held_out`. Agrees with `solve` to within the trajectory fit's tolerance.

    Args:
        previous: a fit of the same files with the same settings; `can_resolve` tells.
        reviews: all of them, as `solve` takes them.
        settings: those of the previous fit.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.
        extension: that of the previous fit.
        with_std: and how far it may be off.

    Raises:
        FitError: the previous fit has other settings or is too old to begin with, or a review does not fit
            its trial.
    """
    groundwork = previous.groundwork
    if groundwork is None or not decide_the_same_fit(previous.settings, settings):
        raise FitError(
            f"{previous.subject.folder}: the kept fit was made with other settings or by an older version; "
            "fit the subject anew: addb-viewer fit --force"
        )
    state = FitState(
        previous.subject, groundwork, groundwork.skeleton, reviews, extension, former=previous.trials
    )
    _refuse_what_does_not_fit([trial.capture for trial in previous.trials], state, settings)
    state = replace(state, trials=tuple(former_marker_fit(t, groundwork, settings) for t in previous.trials))
    fit = finish(state, settings, progress, with_std=with_std)
    return fit if fit.held_out_due else with_figures_of(previous, fit)


def can_resolve(
    previous: Fit,
    subject: Subject,
    trials: Sequence[TrialFiles],
    settings: Settings,
    *,
    extension: Extension | None = None,
) -> bool:
    """Whether the previous fit differs from what is wanted in its reviews at most.

    Args:
        previous: any fit of the subject.
        subject: as its folder is now.
        trials: those wanted.
        settings: those wanted.
        extension: that wanted.
    """
    return (
        previous.groundwork is not None
        and decide_the_same_fit(previous.settings, settings)
        and without_reviews(previous.provenance) == provenance_of(subject, trials, extension=extension)
    )


def _refuse_what_does_not_fit(captures: Sequence[Capture], state: FitState, settings: Settings) -> None:
    """Before any time is spent: the largest of the fits has these parameters beside its trajectories."""
    extra = (len(state.extension.x) if state.extension else 0) + settings.prediction.most_columns
    refuse_what_does_not_fit(sizes_of(captures), state.skeleton, settings.trajectory, extra=extra)
