"""A subject from its recordings to its files of a release."""

from dataclasses import replace

import numpy as np

from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.identifiers import side_of
from addb_viewer.dataset.subject_writing import SubjectWriting
from addb_viewer.dataset.task import LeftOut, Receipt, Task, hours_of
from addb_viewer.dataset.trial_labels import labels_of
from addb_viewer.jobs.accepted_extension import extension_for_solve
from addb_viewer.jobs.force_reviews import reviews_for_solve
from addb_viewer.jobs.suggested_activities import suggestions_of
from solver.capture.subject.subject import open_subject
from solver.common.memory_release import release_memory
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.results.store import default_folder
from solver.fitting.settings import Settings, settings_for

MODEL_NAME = "subject"  # in model texts: the file's own may be a person's


def write_subject_files(task: Task) -> Receipt:
    """Solve the wanted trials together and write everything that the release has of the subject.

    Always from the beginning: a re-solve depends, within tolerance, on the edits before it.

    Raises:
        SolverError: the data cannot be fitted, or a file cannot be written.
        ReviewError: the reviews cannot be read.
    """
    settings = settings_for(task.place)
    subject = open_subject(task.place, settings.reading)
    chosen = [trial for trial in subject.trials if trial.name in task.trials]
    reviews, _ = reviews_for_solve(subject, chosen)
    extension, _ = extension_for_solve(subject, chosen, default_folder(subject.folder))
    fit = solve(subject, settings, trials=list(task.trials), reviews=reviews, extension=extension)
    fit, left = _fit_for_release(fit, task, settings)
    if not fit.trials:
        gone = LeftOut("subject", task.who.subject_id, "no_trials", "see its trials")
        return Receipt(task.key, left_out=(*left, gone))
    captures = [trial.capture for trial in fit.trials]
    kept = {capture.name for capture in captures}
    files = [trial for trial in chosen if trial.name in kept]
    said = labels_of(subject, files, captures, names=task.options.names)
    labels = {
        trial.capture.name: said[trial.capture.name].with_suggestions(suggestions_of(trial, fit.skeleton))
        for trial in fit.trials
    }
    release_memory()
    return SubjectWriting(task, fit, settings, extension, labels).receipt(left)


def _fit_for_release(fit: Fit, task: Task, settings: Settings) -> tuple[Fit, list[LeftOut]]:
    """The fit with those trials that a release takes, under names that tell nobody's; and the others."""
    kept, left = [], []
    for trial in fit.trials:
        reason, detail = _trial_gate(trial)
        if reason is None:
            kept.append(trial)
            continue
        name, frames = task.who.trial_id(trial.capture.name), trial.motion.frames
        hours = hours_of(frames, trial.motion.rate)
        left.append(LeftOut("trial", name, reason, detail, frames=frames, hours=hours))
    feet = {trial.contacts.foot_bodies for trial in kept if trial.contacts}
    if any(sorted(str(side_of(body)) for body in bodies) != ["l", "r"] for bodies in feet):
        raise ReleaseError(f"forces act on other than two feet: {', '.join(sorted(next(iter(feet))))}")
    named = replace(fit.skeleton, name=MODEL_NAME)
    unread = [
        LeftOut("trial", task.who.trial_id(one.name), "unreadable", one.file.reason)
        for one in fit.unread
        if one.name
    ]
    return replace(fit, skeleton=named, trials=tuple(kept)), [*left, *unread]


def _trial_gate(trial: TrialFit) -> tuple[str | None, str]:
    if not trial.forces_known.any():
        return "no_counting_frames", ""
    if trial.dynamics is None or trial.kinematics_only is None:
        return "no_dynamics", f"forces count on {int(trial.forces_known.sum())} frames"
    arrays = (trial.motion.q, trial.kinematics_only.motion.q, trial.dynamics.joint_torques)
    if not all(np.isfinite(array[trial.motion.posed]).all() for array in arrays):
        return "non_finite", ""
    return None, ""
