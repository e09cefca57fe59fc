"""What forces are foretold where nobody knows them: the trajectory fit's sister, made of fitted trials."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from threadpoolctl import threadpool_limits

from solver.dynamics.extension import Extension
from solver.dynamics.foretelling.sister_fit import Foretold, SisterTrial, foretold
from solver.dynamics.heldout import Heldout
from solver.dynamics.root_wrench import about_point
from solver.dynamics.trajectory_fit import TrajectoryFit
from solver.dynamics.trial_data import ExtraParameters, TrialData
from solver.fit import TrialFit
from solver.settings import Settings
from solver.skeleton.skeleton import Skeleton


def sister_of(
    fits: Sequence[TrialFit],
    data: Sequence[TrialData],
    result: TrajectoryFit,
    skeleton: Skeleton,
    settings: Settings,
    *,
    extension: Extension | None,
) -> Foretold | None:
    """The sister of a trajectory fit; None where settings do without.

    Args:
        fits: with contacts.
        data: that the fit was given.
        result: of that fit.
        skeleton: that it began with.
        settings: of every stage.
        extension: what acts beside the recorded forces.
    """
    if not settings.foretelling.enabled:
        return None
    trials = []
    for fit, own, motion in zip(fits, data, result.motions, strict=True):
        assert fit.contacts is not None
        contacts = fit.contacts
        trials.append(
            SisterTrial(replace(own, spline=None, initial=motion), contacts.foot_bodies, contacts.in_contact)
        )
    extra = None
    if extension is not None and extension.parameters is not None:
        extra = ExtraParameters(extension.prior_std, result.extra)
    with threadpool_limits(1):
        return foretold(
            skeleton, trials, settings.trajectory, settings.foretelling, phi=result.phi, extra=extra
        )


def with_foretold(data: Sequence[TrialData], result: TrajectoryFit, sister: Foretold) -> list[TrialData]:
    """The same trials for a fit that is held, where forces are missing, by those that the sister foretells.

    Without them the motion would change its mind at the borders of what is known, and be noisier beyond.

    Args:
        data: of the fit so far.
        result: of it; the search goes on there.
        sister: of that fit.
    """
    return [
        replace(own, foretold_ground=wrench, spline=spline)
        for own, wrench, spline in zip(data, sister.wrenches_ground, result.splines, strict=True)
    ]


def misses_a_force(fit: TrialFit) -> bool:
    """Whether torques of the trial rest on a wrench that nobody measured."""
    return fit.mask is not None and not fit.mask.counts.all()


def foretold_heldout(
    heldout: Heldout,
    fit: TrialFit,
    sister: Foretold,
    wrench_ground: Float[np.ndarray, "frames 6"],
    root_ground: Float[np.ndarray, "frames 3"],
) -> Heldout:
    """The withheld blocks judged by what the sister foretells; the fit's own motion beside it.

    Args:
        heldout: judged by the fit's own motion.
        fit: with contacts.
        sister: blind to the blocks.
        wrench_ground: that it foretells for this trial.
        root_ground: the root joint's centre [m], that residuals are about.
    """
    assert fit.contacts is not None
    missed = about_point(wrench_ground - fit.contacts.wrench_ground.sum(axis=1), root_ground)
    return replace(heldout, residual_root=missed, motion_only_root=heldout.residual_root, learnt=sister.kinds)
