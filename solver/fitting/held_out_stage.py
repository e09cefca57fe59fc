"""Forces left_out from the trajectory fit and then predicted, layout by layout."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from solver.common.cpu_timer import CpuTimer
from solver.common.progress import Progress, part
from solver.dynamics.cross_validation.held_out import HeldOut, HeldOutLayout, judged_blocks
from solver.dynamics.cross_validation.held_out_layouts import BLOCKS, LAYOUTS, hold_out_blocks, hold_out_steps
from solver.dynamics.trajectory.extension import Extension, with_extra_wrench
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.mass_stage import estimate_mass_and_gains
from solver.fitting.prediction_stage import predicted_held_out, prediction_fit_of
from solver.fitting.seen_part import in_whole, seen_part
from solver.fitting.settings import Settings, from_dict
from solver.fitting.torques_stage import under_forces
from solver.fitting.trajectory_stage import all_data, before_forces, begin_at_forces, extra_of
from solver.kinematics.marker_matching import MarkerMatch
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

CUTOFFS_HZ = (3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0)  # of all that laboratories use for markers
FramesByTrial = Sequence[Bool[np.ndarray, " frames"]]


def predict_held_out(
    fit: Fit, settings: Settings, progress: Progress, extension: Extension | None = None
) -> Fit:
    """The fit with its held-out blocks predicted, where they were still due; with the fit's extension."""
    if not fit.held_out_due or fit.groundwork is None or fit.groundwork.mass_kg is None:
        return fit
    began = with_mass(fit.groundwork.skeleton, fit.groundwork.mass_kg)
    seen = [seen_part(trial) for trial in fit.trials]
    parts = with_held_out(seen, fit.groundwork.match, began, settings, progress, extension=extension)
    trials = tuple(
        replace(trial, held_out=in_whole(part, trial).held_out, seconds=part.seconds)
        for trial, part in zip(fit.trials, parts, strict=True)
    )
    judged = [trial.held_out for trial in trials if trial.held_out is not None]
    kinds = judged[0].learnt if judged else fit.groundwork.prediction_kinds
    return replace(
        fit,
        trials=trials,
        held_out_due=False,
        groundwork=replace(fit.groundwork, prediction_kinds=kinds),
    )


def with_held_out(
    fits: Sequence[TrialFit],
    match: MarkerMatch,
    skeleton: Skeleton,
    settings: Settings,
    progress: Progress,
    *,
    extension: Extension | None = None,
) -> tuple[TrialFit, ...]:
    """The same fit without the forces of the first layout's blocks, judged on these blocks.

    Args:
        fits: fitted to the forces.
        match: of the skeleton's markers.
        skeleton: that the trajectory fit began with.
        settings: of every stage.
        progress: told the fraction done; may raise `Cancelled`.
        extension: what acts beside the recorded forces; its parameters do not see the blocks either.
    """
    fits = tuple(replace(fit, held_out=None) for fit in fits)
    fitted = _fitted(fits)
    cpu_timer = CpuTimer()
    with cpu_timer("held_out"):
        left_out = [_frames(fits[i], LAYOUTS[0], settings, extension) for i in fitted]
        judged = _predicted(
            [fits[i] for i in fitted],
            left_out,
            match,
            skeleton,
            settings,
            progress=progress,
            extension=extension,
        )
    if not judged:
        return fits
    seconds = {"held_out": cpu_timer.seconds["held_out"] / len(fitted)}
    updated = list(fits)
    for i, held_out in zip(fitted, judged, strict=True):
        updated[i] = replace(fits[i], held_out=held_out, seconds=fits[i].seconds | seconds)
    return tuple(updated)


def layouts_due(fit: Fit) -> tuple[tuple[str, int], ...]:
    """Layouts that a fit can be judged on and has not been yet, in order."""
    wanted = from_dict(fit.settings).trajectory.held_out and not fit.held_out_due
    if not wanted or fit.groundwork is None or fit.groundwork.mass_kg is None or not _fitted(fit.trials):
        return ()
    done = {(layout.kind, layout.number) for layout in fit.held_out_layouts}
    return tuple(layout for layout in LAYOUTS if layout not in done)


def complete_held_out(
    fit: Fit,
    settings: Settings,
    progress: Progress,
    *,
    extension: Extension | None = None,
    came: Callable[[HeldOutLayout], None] = lambda _: None,
) -> Fit:
    """The fit judged on all layouts; those that it was judged on already are kept.

    Args:
        fit: with its first layout predicted.
        settings: of the fit.
        progress: told the fraction done; may raise `Cancelled`.
        extension: of the fit.
        came: told each layout when it is judged, so that whoever stops this half-way keeps the others.
    """
    due = layouts_due(fit)
    for k, layout in enumerate(due):
        weighed = part(progress, k / len(due), (k + 1) / len(due))
        judged = judged_layout(fit, layout, settings, weighed, extension=extension)
        came(judged)
        fit = replace(fit, held_out_layouts=(*fit.held_out_layouts, judged))
    return fit


def judged_layout(
    fit: Fit,
    layout: tuple[str, int],
    settings: Settings,
    progress: Progress,
    *,
    extension: Extension | None = None,
) -> HeldOutLayout:
    """One layout of a fit, by a fit of its own that begins at the markers, or as `with_held_out` left it.

    Args:
        fit: of the subject.
        layout: kind and number.
        settings: of the fit.
        progress: told the fraction done; may raise `Cancelled`.
        extension: of the fit.
    """
    assert fit.groundwork is not None
    assert fit.groundwork.mass_kg is not None
    trials = [seen_part(fit.trials[i]) for i in _fitted(fit.trials)]
    left_out = [_frames(trial, layout, settings, extension) for trial in trials]
    kept = [trial.held_out for trial in trials]
    if layout == LAYOUTS[0] and all(held_out is not None for held_out in kept):
        judged = [held_out for held_out in kept if held_out is not None]
    else:
        began = with_mass(fit.groundwork.skeleton, fit.groundwork.mass_kg)
        judged = _predicted(
            trials,
            left_out,
            fit.groundwork.match,
            began,
            settings,
            progress=progress,
            extension=extension,
        )
    names = [trial.capture.name for trial in trials]
    blocks = [
        judged_blocks(held_out, w, trial.capture.markers.first_frame)
        for held_out, w, trial in zip(judged, left_out, trials, strict=False)
    ]
    return HeldOutLayout(*layout, {n: b for n, b in zip(names, blocks, strict=False) if b is not None})


def _fitted(fits: Sequence[TrialFit]) -> list[int]:
    return [i for i, fit in enumerate(fits) if fit.kinematics_only is not None]


def _frames(
    fit: TrialFit, layout: tuple[str, int], settings: Settings, extension: Extension | None
) -> Bool[np.ndarray, " frames"]:
    """A trial's part of a layout; none where too few forces would be left to fit it to."""
    (kind, number), extra = layout, extra_of(fit, extension)
    counts, rate = fit.forces_known if extra is None else fit.forces_known & extra.known, fit.motion.rate
    if kind == BLOCKS:
        return hold_out_blocks(counts, rate, settings.trajectory, number)
    assert fit.contacts is not None
    frames = hold_out_steps(counts, fit.contacts.in_contact, rate, number)
    is_left = (counts & ~frames).sum() >= settings.trajectory.fewest_frames
    return frames if is_left else np.zeros_like(frames)


def _predicted(
    fits: Sequence[TrialFit],
    left_out: FramesByTrial,
    match: MarkerMatch,
    skeleton: Skeleton,
    settings: Settings,
    *,
    progress: Progress,
    extension: Extension | None,
) -> list[HeldOut]:
    """Each trial judged on frames that the fit was blind to; empty where nothing is left_out.

    The search begins at the markers, where these forces were never seen; the prediction fit chooses its terms
    without them too.
    """
    if not any(w.any() for w in left_out):
        return []
    before = [before_forces(fit) for fit in fits]
    known = [_without(fit, w) for fit, w in zip(before, left_out, strict=True)]
    weighed = estimate_mass_and_gains(known, skeleton, settings, extended=extension is not None)
    data = all_data(known, match, weighed, extension)
    nominal = with_mass(skeleton, weighed.mass_kg)
    begun = [begin_at_forces(d, fit, nominal, settings) for d, fit in zip(data, known, strict=True)]
    result = fit_trajectories(
        nominal,
        begun,
        settings.trajectory,
        progress,
        extra=extension.parameters if extension else None,
        mass_is_fitted=extension is None,
    )
    prediction_fit = prediction_fit_of(before, begun, result, nominal, settings, extension=extension)
    judged = []
    for k, (frames, fit, motion) in enumerate(zip(left_out, before, result.motions, strict=True)):
        gain = weighed.gains[k]  # of the plates, as the frames that are known tell it
        ours, extra = under_forces(fit, motion, result.skeleton, settings), extra_of(fit, extension)
        if extra is not None:
            ours = with_extra_wrench(ours, extra, result.extra)
        heavier = with_mass(result.skeleton, gain * result.skeleton.mass)
        markers, cutoffs = _markers_alone(fit, frames, heavier, settings)
        held_out = HeldOut(frames & ours.used, ours.residual_root, markers, cutoffs)
        if prediction_fit is not None:
            wrench = gain * prediction_fit.wrenches_ground[k]
            held_out = predicted_held_out(held_out, fit, prediction_fit, wrench, ours.root_ground)
        judged.append(held_out)
    return judged


def _without(fit: TrialFit, frames: Bool[np.ndarray, " frames"]) -> TrialFit:
    """The trial as if no force counted there."""
    assert fit.mask is not None
    return replace(fit, mask=replace(fit.mask, counts=fit.mask.counts & ~frames[:, None]))


def _markers_alone(
    fit: TrialFit, left_out: Bool[np.ndarray, " frames"], skeleton: Skeleton, settings: Settings
) -> tuple[Float[np.ndarray, "frames 6"], tuple[float, float]]:
    """Residual of the markers' motion at the cut-offs [Hz] that do best where nothing is left_out.

    Force and moment each have their own, and both are held against the same forces as the fit.
    """
    cutoffs = [cutoff for cutoff in CUTOFFS_HZ if cutoff < fit.motion.rate / 2] or [fit.motion.rate / 4]
    order = settings.conditioning.order
    residuals = []
    for cutoff in cutoffs:
        dynamics = under_forces(fit, fit.motion.low_passed(cutoff, order), skeleton, settings)
        residuals.append(dynamics.residual_root)
        elsewhere = dynamics.used & ~left_out
    chosen = []
    for part_ in (slice(0, 3), slice(3, 6)):
        squares = [float(np.sum(residual[elsewhere, part_] ** 2)) for residual in residuals]
        chosen.append(int(np.argmin(squares)))
    force, moment = chosen
    residual = np.hstack([residuals[force][:, :3], residuals[moment][:, 3:]])
    return residual, (cutoffs[force], cutoffs[moment])
