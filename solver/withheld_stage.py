"""Forces withheld from the trajectory fit and then foretold."""

from collections.abc import Sequence
from dataclasses import replace

from solver.clock import Clock
from solver.dynamics.extension import Extension, with_extra_wrench
from solver.dynamics.heldout import Heldout, withheld_frames
from solver.dynamics.trajectory_fit import fit_trajectories
from solver.dynamics_stage import all_data, before_forces, extra_of, filtered, started, under_forces
from solver.fit import TrialFit
from solver.foretelling_stage import foretold_heldout, sister_of
from solver.kinematics.marker_matching import MarkerMatch
from solver.progress import Progress
from solver.settings import Settings
from solver.skeleton.skeleton import Skeleton


def with_heldout(
    fits: Sequence[TrialFit],
    match: MarkerMatch,
    skeleton: Skeleton,
    settings: Settings,
    progress: Progress,
    *,
    extension: Extension | None = None,
) -> tuple[TrialFit, ...]:
    """The same fit without the forces of some blocks, judged on these blocks.

    Its search begins at the markers, never where these forces have been seen.

    Args:
        fits: fitted to the forces.
        match: of the skeleton's markers.
        skeleton: that the trajectory fit began with.
        settings: of every stage.
        progress: told the fraction done; may raise `Cancelled`.
        extension: what acts beside the recorded forces; its parameters do not see the blocks either.
    """
    fits = tuple(replace(fit, heldout=None) for fit in fits)
    fitted = [i for i, fit in enumerate(fits) if fit.kinematics_only is not None]
    before = [before_forces(fits[i]) for i in fitted]
    clock = Clock()
    with clock("heldout"):
        data, _ = all_data(before, match, skeleton, settings, extension)
        withheld = [withheld_frames(d.counts, d.start.rate, settings.trajectory) for d in data]
        if not any(w.any() for w in withheld):
            return fits
        blind = [
            started(replace(d, counts=d.counts & ~w), fit, skeleton, settings)
            for d, w, fit in zip(data, withheld, before, strict=True)
        ]
        result = fit_trajectories(
            skeleton,
            blind,
            settings.trajectory,
            progress,
            extra=extension.parameters if extension else None,
        )
        sister = sister_of(before, blind, result, skeleton, settings, extension=extension)
        judged = []
        for k, (frames, fit, motion) in enumerate(zip(withheld, before, result.motions, strict=True)):
            ours, extra = under_forces(fit, motion, result.skeleton, settings), extra_of(fit, extension)
            if extra is not None:
                ours = with_extra_wrench(ours, result.skeleton, extra, result.extra)
            plain = under_forces(fit, filtered(fit.motion, settings), skeleton, settings)
            heldout = Heldout(frames & ours.used, ours.residual_root, plain.residual_root)
            if sister is not None:
                wrench = sister.wrenches_ground[k]
                heldout = foretold_heldout(heldout, fit, sister, wrench, ours.root_ground)
            judged.append(heldout)
    seconds = {"heldout": clock.seconds["heldout"] / len(fitted)}
    updated = list(fits)
    for i, heldout in zip(fitted, judged, strict=True):
        updated[i] = replace(fits[i], heldout=heldout, seconds=fits[i].seconds | seconds)
    return tuple(updated)
