"""A sister of the trajectory fit, with learnt terms beside the forces: what acts where a force is missing.

    r_t = demanded(c, φ) − measured − C_t x,      x ~ N(0, prior_std²), shared by steps and trials

In the reported fit nothing of that kind takes part, so that its residual stays the person's and its motion is
not asked for by terms that nobody measured. The sister begins where that fit ended and is smoother, since
nobody reads its motion. What it gives is demanded(its motion, its inertias) − C x, the wrench that plates
would have told.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.fit_steps import stepped
from solver.dynamics.foretelling import constants, demand_gains, step_curves
from solver.dynamics.foretelling.columns import Columns
from solver.dynamics.foretelling.constants import constant_columns
from solver.dynamics.foretelling.demand_gains import demanded_ground, gain_columns, gain_notes, smooth_demand
from solver.dynamics.foretelling.footfalls import footfalls
from solver.dynamics.foretelling.heading_frame import heading_frame
from solver.dynamics.foretelling.inner_blocks import INERTIAS, Parameters, chosen_kinds
from solver.dynamics.foretelling.learnt_terms import LearntTerms
from solver.dynamics.foretelling.settings import ForetellingSettings
from solver.dynamics.foretelling.step_curves import StepPhases, step_columns, step_phases
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.dynamics.trial_data import ExtraParameters, TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

KINDS = (INERTIAS, step_curves.KIND, demand_gains.KIND, constants.KIND)
OTHER = "extension"
FIRST_STEPS = 2  # from the trajectory fit: its weights are others
NEXT_STEPS = 1  # from an earlier sister: a few frames more or fewer


@dataclass(frozen=True)
class SisterTrial:
    """What one trial gives: as to the trajectory fit, beginning at that fit's motion, and its feet."""

    data: TrialData
    feet: tuple[str, ...]  # bodies
    in_contact: Bool[np.ndarray, "frames feet"]  # by plates; looked at where the data count alone


@dataclass(frozen=True)
class Foretold:
    """What the sister fit says of all trials."""

    wrenches_ground: tuple[Float[np.ndarray, "frames 6"], ...]  # [N, N·m about the ground origin] of all feet
    skeleton: Skeleton  # with the sister's inertias
    kinds: tuple[str, ...]  # of terms that foretell better
    notes: tuple[str, ...]  # what the learnt gains may point to
    motions: tuple[Motion, ...]
    splines: tuple[Float[np.ndarray, "coefficients dofs"], ...]  # of these motions
    learnt: LearntTerms


def foretold(
    skeleton: Skeleton,
    trials: Sequence[SisterTrial],
    trajectory: TrajectorySettings,
    settings: ForetellingSettings,
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters | None = None,
    kinds: Sequence[str] = KINDS,
    learnt: LearntTerms | None = None,
) -> Foretold:
    """Fit the sister, with the kinds of terms that foretell known forces better, if any.

    Args:
        skeleton: scaled, with the entered mass; as the trajectory fit began with.
        trials: of the subject.
        trajectory: settings of the fit whose sister this is.
        settings: of the learnt terms.
        phi: inertias of that fit.
        extra: x of the trials' extra columns, where a diagnosis has added some: they act on the body, and the
            wrench here is what remains beside them.
        kinds: of terms to choose among.
        learnt: by an earlier sister, whose splines the trials begin with: its kinds stay. None: hidden blocks
            choose among `kinds`.

    Raises:
        FitError: as the trajectory fit.
    """
    extra = extra or ExtraParameters.none()
    weights = replace(
        trajectory,
        smoothness=settings.smoothness,
        least_marker_slow_m=settings.marker_slow_m,
        least_marker_growth_m=settings.marker_growth_m,
        shared_growth=settings.shared_growth,
        residual_force_std_N=settings.residual_force_std_N,
        residual_moment_std_Nm=settings.residual_moment_std_Nm,
        knot_spacing_s=settings.knot_spacing_s,
    )
    made = _Made(skeleton, settings, trials, extra)
    plain = [trial.data for trial in trials]
    if learnt is None:
        chosen = chosen_kinds(
            skeleton,
            plain,
            weights,
            settings,
            phi=phi,
            parameters=(every := made.parameters(kinds)),
            with_columns=lambda data: made.with_columns(data, kinds),
            kinds=[kind for kind in kinds if kind == INERTIAS or kind in every.of],
            always=(OTHER,),
        )
    else:
        chosen, phi = learnt.kinds, learnt.phi
    if INERTIAS in chosen:
        weights = replace(
            weights, inertia_prior_weight=settings.inertia_prior_weight * weights.inertia_prior_weight
        )
    parameters, data = made.parameters(chosen), made.with_columns(plain, chosen)
    start = parameters.prior
    if learnt is not None and len(learnt.x) == len(start.start):
        start = replace(start, start=learnt.x)
    steps = FIRST_STEPS if learnt is None else NEXT_STEPS
    sister = stepped(skeleton, data, weights, steps, phi=phi, extra=start)
    wrenches = []
    for motion, trial in zip(sister.motions, data, strict=True):
        assert trial.extra_columns_ground is not None
        beside = trial.extra_columns_ground @ sister.extra
        if trial.extra_wrench_ground is not None:
            beside = beside + trial.extra_wrench_ground
        wrenches.append(demanded_ground(sister.skeleton, motion) - beside)
    gains = parameters.some((demand_gains.KIND,))
    notes: tuple[str, ...] = ()
    if gains.any():
        notes = gain_notes(sister.extra[gains], np.sqrt(sister.extra_variance[gains]), settings)
    return Foretold(
        tuple(wrenches),
        sister.skeleton,
        chosen,
        notes,
        sister.motions,
        sister.splines,
        LearntTerms(chosen, sister.phi, sister.extra),
    )


class _Made:
    """Columns of trials; what does not depend on which frames count is made once."""

    def __init__(
        self,
        skeleton: Skeleton,
        settings: ForetellingSettings,
        trials: Sequence[SisterTrial],
        extra: ExtraParameters,
    ) -> None:
        self.skeleton, self.settings, self.trials, self.extra = skeleton, settings, trials, extra
        self.motions = [trial.data.start for trial in trials]
        self.frames = [heading_frame(skeleton, motion) for motion in self.motions]
        self.weight_N = float(skeleton.mass * np.linalg.norm(skeleton.gravity))
        self.demands = [
            smooth_demand(skeleton, motion, frame, settings)
            for motion, frame in zip(self.motions, self.frames, strict=True)
        ]
        self.phases = self._phases([trial.data for trial in trials])
        stepping = [_peak(d) for d, p in zip(self.demands, self.phases, strict=True) if p is not None]
        self.peak_N = max(stepping, default=0.0)  # zero: nobody steps
        self.lasting = [
            [gain_columns(d, m.rate, f, settings), constant_columns(f, self.weight_N, settings)]
            for d, m, f in zip(self.demands, self.motions, self.frames, strict=True)
        ]

    def parameters(self, kinds: Sequence[str]) -> Parameters:
        """Of the trials' own extra columns and of these kinds."""
        columns, extra = self._learnt([trial.data for trial in self.trials], kinds)[0], self.extra
        of = (OTHER,) * len(extra.start) + tuple(c.kind for c in columns for _ in c.prior_std)
        prior_std = np.concatenate([extra.prior_std, *(c.prior_std for c in columns)])
        start = np.concatenate([extra.start, np.zeros(len(of) - len(extra.start))])
        return Parameters(of, ExtraParameters(prior_std, start))

    def with_columns(self, data: Sequence[TrialData], kinds: Sequence[str]) -> list[TrialData]:
        """The trials with columns of these kinds behind those that they have."""
        whole = []
        for trial, columns in zip(data, self._learnt(data, kinds), strict=True):
            own = trial.extra_columns_ground
            if own is None:
                own = np.zeros((len(trial.counts), 6, len(self.extra.start)))
            together = np.concatenate([own, *(c.ground for c in columns)], axis=2)
            whole.append(replace(trial, extra_columns_ground=together))
        return whole

    def _learnt(self, data: Sequence[TrialData], kinds: Sequence[str]) -> list[list[Columns]]:
        """Of each trial, the same kinds in the same order."""
        lasting = [[c for c in own if c.kind in kinds] for own in self.lasting]
        if not self.peak_N or step_curves.KIND not in kinds:
            return lasting
        same = all(own.counts is trial.data.counts for own, trial in zip(data, self.trials, strict=True))
        return [
            [step_columns(phases, frame, self.peak_N, self.settings), *own]
            for phases, frame, own in zip(
                self.phases if same else self._phases(data), self.frames, lasting, strict=True
            )
        ]

    def _phases(self, data: Sequence[TrialData]) -> list[StepPhases | None]:
        """Told by plates on frames that count, elsewhere by the feet's motion."""
        phases = []
        for trial, own, motion, frame in zip(self.trials, data, self.motions, self.frames, strict=True):
            falls = footfalls(
                self.skeleton,
                motion,
                frame,
                self.settings,
                feet=trial.feet,
                in_contact=trial.in_contact,
                known=own.counts,
            )
            two = len(trial.feet) == 2
            phases.append(step_phases(falls, motion.frames, self.settings) if two else None)
        return phases


def _peak(demand: Float[np.ndarray, "frames 6"]) -> float:
    """Of the force, ends and spikes left out [N]."""
    return float(np.percentile(np.linalg.norm(demand[:, :3], axis=1), 95))
