"""The whole solve as one readable function: subject folder in, fit out; and again after an edit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from solver.capture.capture import Capture, Subject, TrialFiles
from solver.capture.subject.readable_trials import read_trials
from solver.common.cpu_timer import CpuTimer
from solver.common.errors import FitError
from solver.common.memory_release import release_memory
from solver.common.progress import Progress, part, silent
from solver.contact.force_review import ForceReview
from solver.dynamics.memory import refuse_what_does_not_fit, sizes_of
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.failing_trials import Failed, about, together, without_failing
from solver.fitting.fit import Fit, Groundwork, TrialFit
from solver.fitting.provenance import provenance_of, without_reviews
from solver.fitting.review_stage import apply_reviews, predicting_held_out
from solver.fitting.seen_part import in_whole, seen_part
from solver.fitting.settings import Settings, decide_the_same_fit
from solver.fitting.standing_stage import weighed_standing
from solver.fitting.tracking_stage import compared, tracked_trial, with_contacts
from solver.kinematics.calibration import calibrate, choose_frames
from solver.kinematics.hip_width import expected_hip_width
from solver.kinematics.label_faults.repair import with_labels_repaired
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.model_ownership import Ownership, whose_model
from solver.kinematics.upright_pelvis import pitch_of_spines, posture_notes
from solver.markers.mapping_file import chosen_for
from solver.markers.people import of_one_person
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.skeleton import Skeleton
from solver.skeleton.subject_model import load_subject_model

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
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        SolverError: no trial can be read, or the model or the data cannot be used; the message says which
            and what to do. A trial that cannot be read or fitted beside others is left out, and told.
    """
    solve_some = partial(_solve, subject, settings, reviews or {}, captures or {}, extension=extension)
    return without_failing(
        subject, trials, partial(solve_some, before_fitting=before_fitting, progress=progress)
    )


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
    progress: Progress,
) -> Fit:
    """These trials together, told which failed before."""
    cpu_timer = CpuTimer()
    with cpu_timer("load"):
        generic = _generic(subject)
        read = read_trials(
            subject,
            chosen,
            settings.reading,
            instead=captures,
            progress=lambda name: progress(f"reading {name}", 0.0),
        )
        read = replace(read, unread=(*read.unread, *failed))
        recorded, static = read.captures, read.static
    mixed = of_one_person(subject, recorded, static)
    named = name_markers(
        generic,
        [c.markers for c in ([*recorded, static] if static else recorded)],
        default_body=subject.model is None,
        chosen=chosen_for(subject),
        settings=settings.naming,
    )
    match, body = named.match, named.match.skeleton(named.skeleton)
    if before_fitting is not None:
        before_fitting(body, recorded)
    refuse_what_does_not_fit(sizes_of(recorded), body, settings.trajectory, extra=_count(extension, settings))
    repaired = []
    for capture in recorded:
        others = [c.markers for c in (*recorded, *([static] if static else ())) if c is not capture]
        with cpu_timer("load"), about(capture.name):
            accepted = extension.exchanges if extension else ()
            repaired.append(
                with_labels_repaired(capture, others, match, body, settings.label_repair, accepted=accepted)
            )
    recorded = [capture for capture, _ in repaired]
    shown = [*recorded, *([static] if static else ())]
    release_memory()
    with cpu_timer("scaling"):
        frames = choose_frames(
            [match.observed(c.markers) for c in recorded],
            match.observed(static.markers) if static else None,
            settings.kinematics,
        )
        ownership = Ownership(is_scaled=False)
        if subject.model is not None:
            ownership = whose_model(
                generic,
                body,
                frames,
                settings.kinematics,
                file_name=subject.model.name,
                mass_kg=subject.mass_kg,
                said=subject.model_is,
            )
        calibration = calibrate(
            body,
            frames,
            settings.kinematics,
            registered_std=ownership.offset_std(body, generic.marker_names, settings.kinematics),
            height_m=subject.height_m,
            mass_kg=subject.mass_kg,
            hip_width_m=expected_hip_width(named.landmarks, match, [c.markers for c in shown]),
            pitch_of_spines=pitch_of_spines(body, named.landmarks) if subject.model is None else None,
            progress=part(progress, 0.0, SCALED),
        )
    notes = (*read.notes, *mixed, *match.notes, *ownership.notes, *calibration.notes)
    standing = weighed_standing(
        subject, recorded, static, skeleton=calibration.skeleton, match=match, settings=settings
    )
    groundwork = Groundwork(calibration.skeleton, match, notes, read.unread, standing)
    shared = {stage: seconds / len(recorded) for stage, seconds in cpu_timer.seconds.items()}
    share = (TRACKED - SCALED) / len(recorded)
    fits = []
    for i, (capture, faults) in enumerate(repaired):
        start = SCALED + i * share
        with about(capture.name):
            tracked = tracked_trial(capture, groundwork, settings, part(progress, start, start + share))
            tracked = replace(tracked, label_faults=faults, seconds=shared | tracked.seconds)
            seen = with_contacts(seen_part(tracked), groundwork, subject, settings)
            fits.append(in_whole(seen, tracked))
    if subject.model is not None:
        leaning = [
            f"{fit.capture.name}: {note}"
            for fit in fits
            for note in posture_notes(fit.motion, settings.kinematics)
        ]
        groundwork = replace(groundwork, notes=(*groundwork.notes, *leaning))
    release_memory()
    fitted_to_forces = partial(apply_reviews, subject, groundwork, settings=settings, reviews=reviews)
    fit = together(
        fits,
        lambda trial: trial.capture.name,
        partial(fitted_to_forces, progress=part(progress, TRACKED, FITTED), extension=extension),
    )
    fits.clear()  # where the markers alone had the model's
    del tracked
    release_memory()
    return predicting_held_out(fit, settings, part(progress, FITTED, 1.0), extension)


def resolve(
    previous: Fit,
    reviews: Mapping[str, ForceReview],
    settings: Settings,
    progress: Progress = silent,
    *,
    extension: Extension | None = None,
) -> Fit:
    """The same trials after an edit of the reviews; the search begins where the previous fit ended.

    Files, scaling, marker fit and the feet that forces belong to are taken from the previous fit: no review
    changes them. After a small edit the motion is made anew near it alone. Agrees with `solve` to within the
    trajectory fit's tolerance. The held-out blocks wait for
    `predicting_held_out`, which takes longer than all of this.

    Args:
        previous: a fit of the same files with the same settings; `can_resolve` tells.
        reviews: all of them, as `solve` takes them.
        settings: those of the previous fit.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.
        extension: that of the previous fit.

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
    sizes = sizes_of([trial.capture for trial in previous.trials])
    refuse_what_does_not_fit(
        sizes, groundwork.skeleton, settings.trajectory, extra=_count(extension, settings)
    )
    fits = [_before_reviews(trial, groundwork, settings) for trial in previous.trials]
    return apply_reviews(
        previous.subject, groundwork, fits, settings, reviews, progress=progress, extension=extension
    )


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


def _before_reviews(trial: TrialFit, groundwork: Groundwork, settings: Settings) -> TrialFit:
    """The trial as it was when its forces had been given to feet; nothing was spent on it this time."""
    markers_alone = trial.kinematics_only.motion if trial.kinematics_only else trial.motion
    fit = compared(trial.capture, groundwork, markers_alone.q, settings)
    nothing = dict.fromkeys(("load", "scaling", "kinematics"), 0.0)
    return replace(
        fit,
        contacts=trial.contacts,
        mask=trial.mask,
        proposals=trial.proposals,
        spline=trial.spline,
        prediction_spline=trial.prediction_spline,
        seconds=nothing,
        label_faults=trial.label_faults,
        why_not_predicted=trial.why_not_predicted,
    )


def _count(extension: Extension | None, settings: Settings) -> int:
    """Extra parameters of the largest of the fits."""
    return (len(extension.x) if extension else 0) + settings.prediction.most_columns


def _generic(subject: Subject) -> Skeleton:
    if subject.model is not None:
        return load_subject_model(subject.model)
    return default_skeleton(
        **{k: v for k, v in (("mass_kg", subject.mass_kg), ("height_m", subject.height_m)) if v is not None},
        sex=subject.sex,
    )
