"""What a recording says about a subject: each trial's present fit, the one before, flags, causes, steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float

from addb_viewer.trial_view.replay import BodySize, Replay
from addb_viewer.trial_view.replay_of_fit import fitted_replay
from annotations.events import Edit
from solver.capture.formats.analog_channels import AnalogChannels, analog_or_why_not
from solver.common.notes import Note
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.fit_summary import TrialFigures
from solver.fitting.settings import from_dict
from solver.fitting.summary import all_notes, summary
from solver.fitting.torques_stage import filter_as_forces
from solver.fitting.trajectory_stage import before_forces
from solver.skeleton.bones import body_meshes
from solver.skeleton.forward import marker_positions
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

MARKERS_ALONE = "markers alone"  # the fit before forces were looked at
PREVIOUS_FIT = "previous fit"
ON_ONE_PAGE = " on one page.html"  # a report whose file is named so is the form


@dataclass(frozen=True)
class TrialRecord:
    """One trial: what is shown, what it is compared with, and its figures."""

    replay: Replay
    before: Replay | None  # the same frames; None: nothing to compare with
    before_name: str  # MARKERS_ALONE or PREVIOUS_FIT
    figures: TrialFigures
    missing: tuple[bool, ...]  # by frame, as `review.json` has it: a foot's force does not count
    costs: tuple[float, ...] = ()  # of the trajectory fit: where it began, and after each iteration
    files: tuple[Path, ...] = ()  # that it was recorded in

    @cached_property
    def analog(self) -> tuple[AnalogChannels | None, tuple[str, ...]]:
        """Channels of the recording that are no force plate's; and why they cannot be read."""
        return analog_or_why_not(self.files)


@dataclass(frozen=True)
class Recording:
    """A subject's fit, ready to be written."""

    fit: Fit
    trials: tuple[TrialRecord, ...]
    meshes: Mapping[str, trimesh.Trimesh]  # by body
    diagnosis: DiagnosisReport | None = None
    edits: tuple[Edit, ...] = ()  # of the subject's review
    notes: tuple[Note, ...] = field(default=())

    @property
    def subject(self) -> str:
        """The subject's name."""
        return self.fit.subject.name


def recording_of(
    fit: Fit,
    *,
    trials: Sequence[str] | None = None,
    previous: Fit | None = None,
    diagnosis: DiagnosisReport | None = None,
    edits: Sequence[Edit] = (),
) -> Recording:
    """Collect what a recording of a fit needs.

    Args:
        fit: the present one.
        trials: names of those wanted; None for all.
        previous: what to compare it with; None: with what the markers alone said.
        diagnosis: the one that is kept with the fit, if any.
        edits: of the subject's review.
    """
    bones = body_meshes(fit.skeleton, fit.subject.folder / "Geometry")
    figures = summary(fit).trials
    by_name = {} if previous is None else {trial.capture.name: trial for trial in previous.trials}
    records = []
    for trial, its_figures in zip(fit.trials, figures, strict=True):
        if trials and trial.capture.name not in trials:
            continue
        earlier, name = by_name.get(trial.capture.name), PREVIOUS_FIT
        before = None if earlier is None or previous is None else _of_previous(earlier, previous)
        if previous is None:
            before, name = _of_markers_alone(trial, fit), MARKERS_ALONE
        replay = fitted_replay(trial, fit.skeleton, _person(fit), fit.settings)
        missing, files = _missing(trial), trial.capture.files
        records.append(TrialRecord(replay, before, name, its_figures, missing, trial.costs, files))
    return Recording(
        fit=fit,
        trials=tuple(records),
        meshes=bones.meshes,
        diagnosis=diagnosis,
        edits=tuple(edits),
        notes=(*all_notes(fit), *bones.notes),
    )


def _person(fit: Fit) -> BodySize:
    return BodySize(fit.mass_kg, fit.height_m)


def _of_previous(trial: TrialFit, fit: Fit) -> Replay:
    return fitted_replay(trial, fit.skeleton, _person(fit), fit.settings)


def _of_markers_alone(trial: TrialFit, fit: Fit) -> Replay | None:
    """The motion that the forces have not touched, with the body that it was fitted with."""
    if trial.kinematics_only is None:
        return None
    skeleton, settings = _body_before(fit), from_dict(fit.settings)
    before = before_forces(trial)
    dynamics = None
    if trial.contacts is not None and trial.mask is not None:
        motion = filter_as_forces(before.motion, settings)
        dynamics = inverse_dynamics(skeleton, motion, trial.contacts, trial.mask, settings.dynamics)
    bare = replace(
        before,
        model_markers_ground=_shared_markers(before, skeleton),
        dynamics=dynamics,
        contacts=None,  # forces are drawn once, with the present fit
        mask=None,
    )
    return fitted_replay(bare, skeleton, _person(fit), fit.settings)


def _body_before(fit: Fit) -> Skeleton:
    work = fit.groundwork
    if work is None or work.mass_kg is None:
        return fit.skeleton
    return with_mass(work.skeleton, work.mass_kg)


def _shared_markers(trial: TrialFit, skeleton: Skeleton) -> Float[np.ndarray, "frames markers 3"]:
    """Where the skeleton has the markers that `trial` compares [m], in their order; NaN for a stranger."""
    positions = marker_positions(skeleton, trial.motion.q)
    column = {marker.name: i for i, marker in enumerate(skeleton.markers)}
    shared = np.full((trial.motion.frames, len(trial.marker_errors.names), 3), np.nan)
    for i, name in enumerate(trial.marker_errors.names):
        if name in column:
            shared[:, i] = positions[:, column[name]]
    return shared


def _missing(trial: TrialFit) -> tuple[bool, ...]:
    if trial.mask is None:
        return (True,) * trial.motion.frames
    return tuple(bool(missing) for missing in ~trial.mask.all_feet)


def file_of(trial: str) -> str:
    """A trial's name as a part of paths and topics: what separates there is written as %xx."""
    return "".join(c if c.isalnum() or c in " .+-_" else f"%{ord(c):02x}" for c in trial)
