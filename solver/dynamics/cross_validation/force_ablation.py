"""The dataset paper's ablation: measured forces of some steps are hidden, and what that costs is measured.

Three arms start from the centre-of-mass trajectory of their kind, which moves the root, and go
on through the same joint fit: the oracle sees every force; ours lacks the hidden ones; piecewise lacks them
too and knows no tie between the stretches with force. The motion of the markers alone stands beside them.
All get the same trial and the frames whose force was hidden; only the oracle looks at it.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from solver.common.errors import ModelError
from solver.common.progress import Progress, part, silent
from solver.common.true_runs import runs
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import (
    FEWEST_FRAMES,
    ComData,
    ComTrajectory,
    MassPrior,
    com_data,
    fit_com_trajectory,
    unchanged,
)
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.force_prediction.missing_wrench import with_joint_torques
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.root_wrench import with_com_at
from solver.dynamics.settings import DynamicsSettings
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.forward import marker_positions
from solver.skeleton.skeleton import Skeleton

HIDDEN = "hidden by the ablation"  # the mask's reason


def oracle(
    data: ComData,
    held_out: Bool[np.ndarray, " frames"],
    settings: ComSettings,
    prior: MassPrior | None = None,
) -> ComTrajectory:
    """One trajectory that sees all recorded forces, the hidden ones too."""
    return fit_com_trajectory(data, settings, prior)


def ours(
    data: ComData,
    held_out: Bool[np.ndarray, " frames"],
    settings: ComSettings,
    prior: MassPrior | None = None,
) -> ComTrajectory:
    """One trajectory through all frames, with a free acceleration where the force is hidden."""
    return fit_com_trajectory(data.without(held_out), settings, prior)


def piecewise(
    data: ComData,
    held_out: Bool[np.ndarray, " frames"],
    settings: ComSettings,
    prior: MassPrior | None = None,
) -> ComTrajectory:
    """A trajectory for each run of frames with force, on its own; between them the markers' centre of mass.

    Nothing ties one run to the next. μ is the runs' mean by frames. Runs of fewer than three frames stay as
    measured.
    """
    stitched = unchanged(data)
    weighted, frames = 0.0, 0
    for start, end in runs(data.without(held_out).observed):
        if end - start < FEWEST_FRAMES:
            continue
        run = fit_com_trajectory(data.between(start, end), settings, prior)
        stitched.com_ground[start:end] = run.com_ground
        stitched.acceleration_ground[start:end] = run.acceleration_ground
        weighted += run.inverse_mass * (end - start)
        frames += end - start
    return ComTrajectory(
        stitched.com_ground,
        stitched.acceleration_ground,
        inverse_mass=weighted / frames if frames else 0.0,
        mass=None,
        rate=data.rate,
    )


ARMS = {"oracle": oracle, "ours": ours, "piecewise": piecewise}


@dataclass(frozen=True)
class AblationSettings:
    """Settings of the stages that take part, and the forces' filter."""

    com: ComSettings
    trajectory: TrajectorySettings
    dynamics: DynamicsSettings
    cutoff_Hz: float
    filter_order: int


@dataclass(frozen=True)
class AblationTrial:
    """One trial with all of its forces."""

    skeleton: Skeleton  # scaled, with the mass that all arms start from
    data: TrialData  # counts: every frame whose forces are known
    contacts: ContactWrenches
    mask: FrameMask
    foot: int  # whose steps are hidden; index into `contacts.foot_bodies`

    @cached_property
    def knee(self) -> int:
        """The dof of that leg's knee.

        Raises:
            ModelError: no joint between the foot and the root is called a knee.
        """
        body = self.skeleton.body_index(self.contacts.foot_bodies[self.foot])
        while body >= 0:
            for axis in self.skeleton.joints[body].axes:
                if axis.coordinate in self.skeleton.dofs and "knee" in axis.coordinate.lower():
                    return self.skeleton.dofs.index(axis.coordinate)
            body = self.skeleton.joints[body].parent
        raise ModelError(
            f"{self.skeleton.name}: no knee between {self.contacts.foot_bodies[self.foot]} and the root; the "
            "ablation compares the knee's torque and looks for a coordinate with 'knee' in its name."
        )

    def hiding(self, held_out: Bool[np.ndarray, " frames"]) -> FrameMask:
        """The trial's mask without the foot's force on hidden frames."""
        counts = self.mask.counts.copy()
        counts[held_out, self.foot] = False
        return replace(self.mask, counts=counts)


@dataclass(frozen=True)
class ArmFigures:
    """How one arm did; RMS throughout, the trial's ends left out of everything but the markers."""

    residual_N: float  # frames whose forces both the oracle and ours see
    residual_Nm: float
    marker_rms_m: float  # against the raw markers, all frames
    hidden_N: float  # hidden frames: required by the motion less the hidden measurement
    hidden_Nm: float
    knee_Nm: float  # torque less the oracle's after its joint fit


@dataclass(frozen=True)
class Repetition:
    """One choice of hidden frames: figures, and torque of the knee [N·m], by arm."""

    held_out: Bool[np.ndarray, " frames"]
    figures: dict[str, ArmFigures]
    knee_torque: dict[str, Float[np.ndarray, " frames"]]
    notes: tuple[str, ...]


MARKERS = "markers only"
FITTED = {arm: arm for arm in ARMS}  # names of the arms after the joint fit …
STARTED = {arm: f"{arm}, before the joint fit" for arm in ARMS}  # … and before


def ablate(
    trial: AblationTrial,
    choices: Iterable[Bool[np.ndarray, " frames"]],
    settings: AblationSettings,
    progress: Progress = silent,
) -> Iterator[Repetition]:
    """Run the arms for each choice of hidden frames; the oracle's fit is made once.

    Args:
        trial: with all of its forces.
        choices: frames on which the foot's force is hidden.
        settings: of all stages.
        progress: told the fraction done; may raise `Cancelled`.
    """
    choices = list(choices)
    arms = _Arms(trial, settings)
    share = 1 / (1 + len(choices))
    oracle = arms.oracle(part(progress, 0.0, share))
    for i, held_out in enumerate(choices):
        yield arms.repetition(held_out, oracle, part(progress, (1 + i) * share, (2 + i) * share))


@dataclass(frozen=True)
class _Outcome:
    """A motion with the skeleton that goes with it."""

    skeleton: Skeleton
    motion: Motion
    notes: tuple[str, ...] = ()


class _Arms:
    def __init__(self, trial: AblationTrial, settings: AblationSettings) -> None:
        self.trial, self.settings = trial, settings
        self.com: ComData = com_data(trial.skeleton, trial.data.start, trial.contacts, trial.mask)
        self.mass = MassPrior(
            trial.skeleton.mass, 0.0
        )  # one mass for all arms: the baseline's runs are short

    def oracle(self, progress: Progress) -> dict[str, _Outcome]:
        nothing = np.zeros(self.trial.data.start.frames, dtype=bool)
        return self._arm("oracle", nothing, progress)

    def repetition(
        self, held_out: Bool[np.ndarray, " frames"], oracle: dict[str, _Outcome], progress: Progress
    ) -> Repetition:
        start = self.trial.data.start
        outcomes = {MARKERS: self._smoothed(start), **oracle}
        outcomes |= self._arm("ours", held_out, part(progress, 0.0, 0.5))
        outcomes |= self._arm("piecewise", held_out, part(progress, 0.5, 1.0))
        whole, without_held_out = self.trial.mask, self.trial.hiding(held_out)
        knee = {
            name: self._knee_torque(o, whole if name in oracle else without_held_out)
            for name, o in outcomes.items()
        }
        return Repetition(
            held_out=held_out,
            figures={
                name: self._figures(o, held_out, knee[name] - knee[FITTED["oracle"]])
                for name, o in outcomes.items()
            },
            knee_torque=knee,
            notes=tuple(f"{name}: {note}" for name, o in outcomes.items() for note in o.notes),
        )

    def _arm(
        self, arm: str, held_out: Bool[np.ndarray, " frames"], progress: Progress
    ) -> dict[str, _Outcome]:
        """Before and after the joint fit."""
        trial, data = self.trial, self.trial.data
        com = ARMS[arm](self.com, held_out, self.settings.com, self.mass).com_ground
        start = replace(data.start, q=with_com_at(trial.skeleton, data.start.q, com))
        seen = replace(data, initial=start, counts=data.counts & ~held_out)
        fit = fit_trajectories(trial.skeleton, [seen], self.settings.trajectory, progress)
        return {
            STARTED[arm]: self._smoothed(start),
            FITTED[arm]: _Outcome(fit.skeleton, fit.motions[0], fit.notes),
        }

    def _smoothed(self, motion: Motion) -> _Outcome:
        """A motion that no spline was fitted to, through the forces' filter."""
        motion = motion.low_passed(self.settings.cutoff_Hz, self.settings.filter_order)
        return _Outcome(self.trial.skeleton, motion)

    def _dynamics(self, outcome: _Outcome, mask: FrameMask) -> Dynamics:
        return inverse_dynamics(
            outcome.skeleton, outcome.motion, self.trial.contacts, mask, self.settings.dynamics
        )

    def _knee_torque(self, outcome: _Outcome, mask: FrameMask) -> Float[np.ndarray, " frames"]:
        dynamics = self._dynamics(outcome, mask)
        full = with_joint_torques(outcome.skeleton, dynamics, self.trial.contacts, mask)
        return full.joint_torques[:, self.trial.knee]

    def _figures(
        self,
        outcome: _Outcome,
        held_out: Bool[np.ndarray, " frames"],
        knee_difference: Float[np.ndarray, " frames"],
    ) -> ArmFigures:
        dynamics = self._dynamics(outcome, self.trial.mask)
        both, unseen = dynamics.used & ~held_out, dynamics.used & held_out
        force, moment = dynamics.residual_root[:, :3], dynamics.residual_root[:, 3:]
        errors = marker_positions(outcome.skeleton, outcome.motion.q) - self.trial.data.observed_ground
        return ArmFigures(
            residual_N=_rms(force[both]),
            residual_Nm=_rms(moment[both]),
            marker_rms_m=_rms(errors[np.isfinite(errors).all(axis=2)]),
            hidden_N=_rms(force[unseen]),
            hidden_Nm=_rms(moment[unseen]),
            knee_Nm=_rms(knee_difference[dynamics.used, None]),
        )


def _rms(vectors: Float[np.ndarray, "some axes"]) -> float:
    """Root of the mean squared length; NaN of nothing."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean())) if len(vectors) else float("nan")
