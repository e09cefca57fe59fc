"""The part of a trial on which a person is seen: solved as a trial of its own, then laid back into the whole.

Frames count from the recording's beginning everywhere else. There, frames without a pose are NaN, and no foot
has a force on them.
"""

from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool

from solver.capture.capture import Capture
from solver.common.true_runs import runs
from solver.contact.detected_ranges import within
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.mask import TOO_FEW_MARKERS, with_own_file
from solver.contact.wrenches import NO_FOOT, RECORDING, ContactWrenches, FrameMask, MissingRange
from solver.fitting.fit_result import KinematicsOnly, TrialFit
from solver.kinematics.determined import beyond_bridges, beyond_people
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

Rows = TypeVar("Rows", bound=Any)


def seen_part(trial: TrialFit) -> TrialFit:
    """From the first to the last frame with a pose, and a pose on every frame; all of it where that is all.

    Splines are of this part in either.
    """
    if trial.motion.posed.all() or not trial.motion.posed.any():
        return trial
    span = _span(trial.motion.posed)

    def cut(of: Rows) -> Rows:
        return _each(of, lambda values, _: values[span])

    before, mask, held_out = trial.kinematics_only, trial.mask, trial.held_out
    return replace(
        trial,
        capture=_captured(trial.capture, span),
        motion=_moving(trial.motion, span),
        marker_errors=cut(trial.marker_errors),
        model_markers_ground=trial.model_markers_ground[span],
        contacts=cut(trial.contacts) if trial.contacts else None,
        mask=replace(cut(mask), reasons=_shifted(mask.reasons, span), sources=_kept(mask, span))
        if mask
        else None,
        proposals=tuple(
            replace(p, range=(p.range[0] - span.start, p.range[1] - span.start)) for p in trial.proposals
        ),
        dynamics=None,
        kinematics_only=KinematicsOnly(_moving(before.motion, span), cut(before.marker_errors))
        if before
        else None,
        held_out=cut(held_out) if held_out else None,
        std=None,
        left_open=None if trial.left_open is None else trial.left_open[span],
    )


def guessed(trial: TrialFit) -> Bool[np.ndarray, "frames dofs"]:
    """Coordinates that markers out of view would show, for longer than the motion around them tells."""
    if trial.left_open is None:
        return np.zeros(trial.motion.q.shape, dtype=bool)
    return beyond_bridges(trial.left_open, trial.motion.rate)


def impossible_angles(trial: TrialFit, skeleton: Skeleton) -> Bool[np.ndarray, "frames dofs"]:
    """Where its motions bend a joint as nobody's does."""
    motions = (trial.motion, *((trial.dynamics.motion,) if trial.dynamics else ()))
    return np.any([beyond_people(skeleton, each.q, each.rate) for each in motions], axis=0)


def without_guesses(trial: TrialFit) -> TrialFit:
    """The trial as it is told to others: no angle, speed or torque that no marker shows."""
    return _without(trial, guessed(trial) | np.isin(trial.motion.dofs, trial.unseen_coordinates))


def in_view(trial: TrialFit) -> TrialFit:
    """The trial as it is drawn: what no marker ever shows stays near neutral."""
    return _without(trial, guessed(trial))


def _without(trial: TrialFit, unknown: Bool[np.ndarray, "frames dofs"]) -> TrialFit:
    if not unknown[trial.motion.posed].any():
        return trial

    def motion(of: Motion) -> Motion:
        whole_q = of.q if of.whole_q is None else of.whole_q
        return replace(of, q=np.where(unknown, np.nan, of.q), whole_q=whole_q)

    before, dynamics, std = trial.kinematics_only, trial.dynamics, trial.std
    if std is not None:
        of_dofs = ("angle", "speed", "acceleration", "torque", "power")
        std = replace(std, **{name: np.where(unknown, np.nan, getattr(std, name)) for name in of_dofs})
    return replace(
        trial,
        std=std,
        motion=motion(trial.motion),
        kinematics_only=before and replace(before, motion=motion(before.motion)),
        dynamics=dynamics
        and replace(
            dynamics,
            motion=motion(dynamics.motion),
            joint_torques=np.where(unknown, np.nan, dynamics.joint_torques),
        ),
    )


def in_whole(part: TrialFit, whole: TrialFit) -> TrialFit:
    """What was found of the part, in the recording's frames.

    Args:
        part: `seen_part` of the whole, solved further.
        whole: with its marker fit at least.
    """
    posed = whole.motion.posed
    if posed.all():
        return part
    span = _span(posed)
    inside = posed[span]

    def laid(values: np.ndarray, fill: float) -> np.ndarray:
        result = np.full((len(posed), *values.shape[1:]), fill, values.dtype)
        result[span][inside] = values[inside]
        return result

    def back(of: Rows) -> Rows:
        return _each(of, laid)

    def motion(of: Motion) -> Motion:
        return replace(of, q=laid(of.q, np.nan), start_time=whole.motion.start_time)

    before, dynamics = part.kinematics_only, part.dynamics
    moved = (replace(p, range=(p.range[0] + span.start, p.range[1] + span.start)) for p in part.proposals)
    return replace(
        part,
        capture=whole.capture,
        motion=motion(part.motion),
        marker_errors=back(part.marker_errors),
        model_markers_ground=laid(part.model_markers_ground, np.nan),
        contacts=_with_silent_feet(back(part.contacts), posed) if part.contacts else None,
        mask=_with_unseen(back(part.mask), part.mask, span, posed) if part.mask else None,
        proposals=within(tuple(moved), posed),
        dynamics=replace(back(dynamics), motion=motion(dynamics.motion)) if dynamics else None,
        kinematics_only=KinematicsOnly(motion(before.motion), back(before.marker_errors)) if before else None,
        held_out=back(part.held_out) if part.held_out else None,
        std=back(part.std) if part.std else None,
        left_open=whole.left_open,
    )


def review_of_part(review: ForceReview | None, whole: TrialFit) -> ForceReview | None:
    """What is said of a trial's forces, in the frames of its seen part.

    Args:
        review: by people, in the recording's frames; None: nothing.
        whole: the trial, whose own file may say something as well.

    Raises:
        FitError: the file's review is of another number of frames.
    """
    if whole.motion.posed.all():
        return review
    span = _span(whole.motion.posed)
    review = with_own_file(review or ForceReview(), whole.capture)
    return replace(
        review,
        by_people=_labels(review.by_people, span, whole.motion.frames),
        by_file=None if review.by_file is None else _labels(review.by_file, span, whole.motion.frames),
        stays_out=None if review.stays_out is None else _shifted(review.stays_out, span),
    )


def _span(posed: Bool[np.ndarray, " frames"]) -> slice:
    seen = np.flatnonzero(posed)
    return slice(int(seen[0]), int(seen[-1]) + 1)


def _each(of: Rows, change: Any) -> Rows:
    """With every array of it, all of which are over frames, changed; told what stands where nothing is."""
    empty = {"f": np.nan, "b": False, "i": 0}
    arrays = {f.name: getattr(of, f.name) for f in fields(of)}
    arrays = {name: value for name, value in arrays.items() if isinstance(value, np.ndarray)}
    return replace(of, **{name: change(value, empty[value.dtype.kind]) for name, value in arrays.items()})


def _captured(capture: Capture, span: slice) -> Capture:
    markers, outside = capture.markers, capture.outside_ranges
    return replace(
        capture,
        markers=replace(
            markers,
            positions_ground=markers.positions_ground[span],
            start_time=float(markers.times[span.start]),
            first_frame=markers.first_frame + span.start,
        ),
        imported_missing_force=None,
        imported_reviewed=None,
        imported_reasons=(),
        outside_ranges=None if outside is None else outside[span],
    )


def _moving(motion: Motion, span: slice) -> Motion:
    return motion.between(span.start, span.stop).filled()


def _with_silent_feet(contacts: ContactWrenches, posed: Bool[np.ndarray, " frames"]) -> ContactWrenches:
    """No force is anybody's where nobody is seen, as where nothing was recorded."""
    return replace(
        contacts,
        wrench_ground=np.nan_to_num(contacts.wrench_ground),
        wrench_raw_ground=np.nan_to_num(contacts.wrench_raw_ground),
        plate=np.where(posed[:, None], contacts.plate, NO_FOOT),
    )


def _with_unseen(
    mask: FrameMask, part: FrameMask, span: slice, posed: Bool[np.ndarray, " frames"]
) -> FrameMask:
    """With a reason for the frames that show nobody."""
    sourced = [
        ((start + span.start, end + span.start, foot, why), part.source_of(k))
        for k, (start, end, foot, why) in enumerate(part.reasons)
    ]
    sourced += [
        ((start, end, None, TOO_FEW_MARKERS), RECORDING)
        for start, end in runs(~posed)
        if start < span.start or end > span.stop
    ]
    sourced.sort(key=lambda reason: reason[0][:2])
    return replace(
        mask, reasons=tuple(reason for reason, _ in sourced), sources=tuple(source for _, source in sourced)
    )


def _shifted(reasons: tuple[MissingRange, ...], span: slice) -> tuple[MissingRange, ...]:
    frames = span.stop - span.start
    moved = [(max(0, a - span.start), min(frames, b - span.start), foot, why) for a, b, foot, why in reasons]
    return tuple(reason for reason in moved if reason[0] < reason[1])


def _kept(mask: FrameMask, span: slice) -> tuple[str, ...]:
    return tuple(
        source
        for (start, end, _, _), source in zip(mask.reasons, mask.sources, strict=False)
        if max(0, start - span.start) < min(span.stop, end) - span.start
    )


def _labels(labels: tuple[ForceLabel, ...], span: slice, frames: int) -> tuple[ForceLabel, ...]:
    """Those of the part; one beyond the trial's end is left for the rule that refuses it."""
    beyond = [label for label in labels if not 0 <= label.start < label.end <= frames]
    moved = (
        label._replace(start=max(0, label.start - span.start), end=min(span.stop, label.end) - span.start)
        for label in labels
    )
    return (*beyond, *(label for label in moved if label.start < label.end))
