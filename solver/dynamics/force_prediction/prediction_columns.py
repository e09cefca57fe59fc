"""The columns of the prediction fit's learnt terms: of whole trials, and of windows of long ones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.force_prediction.learnt_columns import (
    CONSTANTS,
    GAINS,
    STEPS,
    Columns,
    HeadingFrame,
    StepPhases,
    constant_columns,
    footfalls,
    gain_columns,
    heading_frame,
    smooth_demand,
    step_columns,
    step_phases,
)
from solver.dynamics.force_prediction.settings import PredictionSettings
from solver.dynamics.trajectory.frame_spans import Span
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.skeleton.skeleton import Skeleton

OTHER = "extension"


@dataclass(frozen=True)
class Parameters:
    """Of all extra columns, the same for all trials."""

    of: tuple[str, ...]  # the kind of each
    prior: ExtraParameters

    def some(self, kinds: Sequence[str]) -> Bool[np.ndarray, " extra"]:
        """Which belong to these kinds."""
        return np.isin(np.array(self.of, dtype=object), list(kinds))


@dataclass(frozen=True)
class PredictionTrial:
    """What one trial gives: as to the trajectory fit, beginning at that fit's motion, and its feet."""

    data: TrialData
    feet: tuple[str, ...]  # bodies
    in_contact: Bool[np.ndarray, "frames feet"]  # by plates; looked at where the data count alone

    def part(self, start: int, end: int, spacing: int) -> "PredictionTrial":
        """Some frames as a trial of their own; arguments as of the data's own `part`."""
        return replace(self, data=self.data.part(start, end, spacing), in_contact=self.in_contact[start:end])


class PredictionColumns:
    """Of trials; what does not depend on which frames count is made once."""

    def __init__(
        self,
        skeleton: Skeleton,
        settings: PredictionSettings,
        trials: Sequence[PredictionTrial],
        extra: ExtraParameters,
        peak_N: float | None = None,
    ) -> None:
        """Of trials.

        Args:
            skeleton: with the person's mass.
            settings: of the columns.
            trials: as for the prediction fit.
            extra: x of the trials' own extra columns.
            peak_N: of the force that stepping demands; None: as these trials tell; zero: nobody steps.
        """
        self.skeleton, self.settings, self.trials, self.extra = skeleton, settings, trials, extra
        self.motions = [trial.data.start for trial in trials]
        self.frames = [heading_frame(skeleton, motion) for motion in self.motions]
        self.weight_N = float(skeleton.mass * np.linalg.norm(skeleton.gravity))
        self.demands = [
            smooth_demand(skeleton, motion, frame)
            for motion, frame in zip(self.motions, self.frames, strict=True)
        ]
        self.phases = self._phases([trial.data for trial in trials])
        stepping = [  # ends and spikes left out
            float(np.percentile(np.linalg.norm(demand[:, :3], axis=1), 95))
            for demand, phase in zip(self.demands, self.phases, strict=True)
            if phase is not None
        ]
        self.peak_N = max(stepping, default=0.0) if peak_N is None else peak_N

    def parameters(self, kinds: Sequence[str]) -> Parameters:
        """Of the trials' own extra columns and of these kinds."""
        columns, extra = self._learnt([trial.data for trial in self.trials], kinds)[0], self.extra
        of = (OTHER,) * len(extra.start) + tuple(c.kind for c in columns for _ in c.prior_std)
        prior_std = np.concatenate([extra.prior_std, *(c.prior_std for c in columns)])
        start = np.concatenate([extra.start, np.zeros(len(of) - len(extra.start))])
        return Parameters(of, ExtraParameters(prior_std, start))

    def with_columns(self, data: Sequence[TrialData], kinds: Sequence[str]) -> list[TrialData]:
        """The trials with columns of these kinds behind those that they have."""
        learnt = self._learnt(data, kinds)
        return [self._beside(trial, columns) for trial, columns in zip(data, learnt, strict=True)]

    def _beside(self, trial: TrialData, columns: Sequence[Columns]) -> TrialData:
        own = trial.extra_columns_ground
        if own is None:
            own = np.zeros((len(trial.counts), 6, len(self.extra.start)))
        together = np.concatenate([own, *(c.ground for c in columns)], axis=2)
        return replace(trial, extra_columns_ground=together)

    def _learnt(self, data: Sequence[TrialData], kinds: Sequence[str]) -> list[list[Columns]]:
        """Of each trial, the same kinds in the same order."""
        same = all(own.counts is trial.data.counts for own, trial in zip(data, self.trials, strict=True))
        return [
            self._columns(phases, frame, demand, motion.rate, kinds)
            for phases, frame, demand, motion in zip(
                self.phases if same else self._phases(data),
                self.frames,
                self.demands,
                self.motions,
                strict=True,
            )
        ]

    def _columns(
        self,
        phases: StepPhases | None,
        frame: HeadingFrame,
        demand: Float[np.ndarray, "frames 6"],
        rate: float,
        kinds: Sequence[str],
    ) -> list[Columns]:
        """Of some frames."""
        columns = []
        if self.peak_N and STEPS in kinds:
            columns.append(step_columns(phases, frame, self.peak_N))
        if GAINS in kinds:
            columns.append(gain_columns(demand, rate, frame, self.settings))
        if CONSTANTS in kinds:
            columns.append(constant_columns(frame, self.weight_N))
        return columns

    def window(self, span: Span, kinds: Sequence[str], spacing: int, *, held: bool = False) -> TrialData:
        """Some frames as a trial of their own, with columns of these kinds behind those that it has."""
        i, start, end = span.trial, span.start, span.end
        phases, rate = self.phases[i], self.motions[i].rate
        own = self._columns(
            None if phases is None else phases.between(start, end),
            self.frames[i].between(start, end),
            self.demands[i][start:end],
            rate,
            kinds,
        )
        return self._beside(self.trials[i].data.part(start, end, spacing, held=held), own)

    def _phases(self, data: Sequence[TrialData]) -> list[StepPhases | None]:
        """Told by plates on frames that count, elsewhere by the feet's motion."""
        phases = []
        for trial, own, motion, frame in zip(self.trials, data, self.motions, self.frames, strict=True):
            falls = footfalls(
                self.skeleton, motion, frame, feet=trial.feet, in_contact=trial.in_contact, known=own.counts
            )
            two = len(trial.feet) == 2
            phases.append(step_phases(falls, motion.frames) if two else None)
        return phases
