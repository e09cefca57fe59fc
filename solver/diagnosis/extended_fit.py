"""What naming the causes gains: the trajectory fit with and without them, on blocks held out from both."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from solver.common.errors import FitError
from solver.common.notes import Kind, Note, noted
from solver.common.progress import Progress, part, silent
from solver.common.true_runs import runs
from solver.contact.wrenches import FrameMask
from solver.diagnosis.diagnosis import Gain
from solver.dynamics.cross_validation.held_out_layouts import hold_out_blocks
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.force_prediction.missing_wrench import torques_under
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.trajectory.extension import Extension, TrialExtension, with_extra_wrench
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit
from solver.dynamics.trajectory.trial_data import TrialData
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.mass_stage import estimate_mass_and_gains
from solver.fitting.settings import Settings
from solver.fitting.trajectory_stage import before_forces, begin_at_forces, trial_data
from solver.kinematics.marker_matching import MarkerMatch, match_markers
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import marker_positions
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

BOOTSTRAPS = 400
FEWEST_BLOCKS = 3  # drawn anew, fewer say nothing of how they scatter
OWN_TIME_HISTORY_BLOCKS = 3  # a column that acts no longer than so many has a time history of its own
SUB_BLOCK_S = 0.06  # held out at a time where such a time history has to be told by the frames around
LEAST_LEFT = 0.5  # of the recorded force; whatever takes more away explains by silence
LEAST_PLACED_N = 5.0  # below it nobody asks on which segment a force acts

Block = tuple[int, int, int]  # trial, start, end


@dataclass(frozen=True, eq=False)
class ExtendedGain:
    """Figures without and with the extension; all of the same frames of the same trials."""

    held_out_linear_residual_N: Gain
    held_out_angular_residual_Nm: Gain  # about the root joint's centre
    held_out_linear_drop_N: tuple[float, float] | None  # interval of before − after, of the same blocks
    held_out_angular_drop_Nm: (
        tuple[float, float] | None
    )  # None: too few blocks, as for the figures' intervals
    marker_rms_m: Gain
    mass_kg: Gain
    joint_torque_change: dict[str, float]  # RMS by dof [N·m, or N for translations], greatest first
    joint_torque_rms: dict[str, float]  # without the extension, in the same order
    held_out_frames: int
    held_out_blocks: int
    fit: TrajectoryFit  # of all evidence, with the extension
    before: tuple[Dynamics, ...]  # of the trials of all evidence, without the extension
    after: tuple[Dynamics, ...]  # with it
    notes: tuple[Note, ...] = ()


def extended_fit(
    fit: Fit, extension: Extension, settings: Settings, progress: Progress = silent
) -> ExtendedGain:
    """Fit the trajectories with the causes as border columns, and without them, and compare.

    Both see the same forces: all that were recorded and that no person took out. Of these, blocks are
    held out from two further fits and predicted; where a cause has its own time history in time, which
    nothing but the frames around can tell, the blocks are short.

    Args:
        fit: of the markers, or of the forces as well; only its marker fit is of use.
        extension: of the same trials.
        settings: of the solve.
        progress: told the fraction done; may raise `Cancelled`.

    Raises:
        FitError: no trial of the extension has forces enough.
    """
    base, match = _base(fit)
    cases = _cases(fit, match, base, extension, settings)
    if not cases:
        raise FitError(f"{fit.subject.folder}: too few frames with forces to fit an extension to.")
    before = _fit(cases, base, settings, part(progress, 0.0, 0.25))
    after = _fit(cases, base, settings, part(progress, 0.25, 0.5), extension=extension)
    held_out = _fit(cases, base, settings, part(progress, 0.5, 0.75), held_out=True)
    held_out_extended = _fit(
        cases, base, settings, part(progress, 0.75, 1.0), held_out=True, extension=extension
    )
    blocks = _blocks(cases, held_out_extended.dynamics)
    change = _torque_change(base, before, after)
    linear, angular = (
        _held_out(blocks, held_out, held_out_extended, axes) for axes in (slice(0, 3), slice(3, 6))
    )
    return ExtendedGain(
        held_out_linear_residual_N=linear[0],
        held_out_angular_residual_Nm=angular[0],
        held_out_linear_drop_N=linear[1],
        held_out_angular_drop_Nm=angular[1],
        marker_rms_m=Gain(_marker_rms(before, cases), _marker_rms(after, cases)),
        mass_kg=Gain(before.fit.skeleton.mass, after.fit.skeleton.mass),
        joint_torque_change=change,
        joint_torque_rms=_torque_rms(base, before, tuple(change)),
        held_out_frames=sum(end - start for _, start, end in blocks),
        held_out_blocks=len(blocks),
        fit=after.fit,
        before=before.dynamics,
        after=after.dynamics,
        notes=(*_placing_notes(cases, after), *_cancelling_notes(cases, after)),
    )


@dataclass(frozen=True, eq=False)
class _Case:
    """A trial with all of its evidence."""

    trial: TrialFit  # the marker fit, masked as the evidence is
    plain: TrialData  # without forces of its own time history
    extra: TrialExtension
    gain: float
    held_out: Bool[np.ndarray, " frames"]

    def data(self, skeleton: Skeleton, settings: Settings, *, held_out: bool, extended: bool) -> TrialData:
        counts = self.plain.counts & ~self.held_out if held_out else self.plain.counts
        data = begin_at_forces(replace(self.plain, counts=counts), self.trial, skeleton, settings)
        return self.extra.added_to(data, self.gain) if extended else data


def _base(fit: Fit) -> tuple[Skeleton, MarkerMatch]:
    """The skeleton that trajectory fits begin with, and which markers it has."""
    ground = fit.groundwork
    if ground is not None and ground.mass_kg is not None:
        return with_mass(ground.skeleton, ground.mass_kg), ground.match
    match = match_markers(fit.skeleton, [trial.capture.markers for trial in fit.trials])
    return match.skeleton(fit.skeleton), match


def _cases(
    fit: Fit, match: MarkerMatch, skeleton: Skeleton, extension: Extension, settings: Settings
) -> list[_Case]:
    own = (t for t in fit.trials if t.contacts is not None and t.capture.name in extension.trials)
    trials = [before_forces(trial) if trial.kinematics_only else trial for trial in own]
    trials = [
        replace(trial, motion=trial.motion.filled()) for trial in trials
    ]  # frames of nobody do not count
    gains = estimate_mass_and_gains(trials, skeleton, settings, extended=True).gains
    cases = []
    for trial, gain in zip(trials, gains, strict=True):
        extra = extension.trials[trial.capture.name]
        assert trial.contacts is not None
        evidence = extra.evidence & extra.known & trial.contacts.observed
        if trial.contacts.unassigned is not None:
            evidence &= ~trial.contacts.unassigned
        if evidence.sum() < settings.trajectory.fewest_frames:
            continue
        feet = len(trial.contacts.foot_bodies)
        masked = replace(trial, mask=FrameMask(np.repeat(evidence[:, None], feet, axis=1)))
        data = trial_data(masked, match, gain)
        cases.append(_Case(masked, data, extra, gain, _frames_held_out(data, extra, settings)))
    return cases


def _frames_held_out(
    data: TrialData, extra: TrialExtension, settings: Settings
) -> Bool[np.ndarray, " frames"]:
    """Blocks of the usual length, and short ones where a cause has a time history of its own."""
    rate, trajectory = data.start.rate, settings.trajectory
    acts = np.abs(extra.columns_ground).max(axis=1) > 0
    brief = acts.sum(axis=0) <= OWN_TIME_HISTORY_BLOCKS * trajectory.held_out_block_s * rate
    own = acts[:, brief].any(axis=1)
    short = replace(trajectory, held_out_block_s=SUB_BLOCK_S)
    return hold_out_blocks(data.counts & ~own, rate, trajectory) | hold_out_blocks(
        data.counts & own, rate, short
    )


@dataclass(frozen=True, eq=False)
class _Fitted:
    """Trajectories of all cases, and what they leave at the root."""

    fit: TrajectoryFit
    dynamics: tuple[Dynamics, ...]


def _fit(
    cases: Sequence[_Case],
    skeleton: Skeleton,
    settings: Settings,
    progress: Progress,
    *,
    held_out: bool = False,
    extension: Extension | None = None,
) -> _Fitted:
    data = [
        case.data(skeleton, settings, held_out=held_out, extended=extension is not None) for case in cases
    ]
    parameters = extension.parameters if extension is not None else None
    fit = fit_trajectories(skeleton, data, settings.trajectory, progress, extra=parameters)
    found = []
    for case, motion in zip(cases, fit.motions, strict=True):
        contacts, mask = case.trial.contacts, case.trial.mask
        assert contacts is not None
        assert mask is not None
        own = inverse_dynamics(fit.skeleton, motion, contacts, mask, settings.dynamics)
        if extension is not None:
            acting = case.extra.loads(fit.extra)
            torques = torques_under(fit.skeleton, own, contacts, mask, acting=acting)
            own = replace(with_extra_wrench(own, case.extra, fit.extra), joint_torques=torques)
        found.append(own)
    return _Fitted(fit, tuple(found))


def _blocks(cases: Sequence[_Case], dynamics: Sequence[Dynamics]) -> list[Block]:
    """Runs of held-out frames that figures count."""
    return [
        (k, start, end)
        for k, (case, own) in enumerate(zip(cases, dynamics, strict=True))
        for start, end in runs(case.held_out & own.used)
    ]


def _held_out(
    blocks: Sequence[Block], before: _Fitted, after: _Fitted, axes: slice
) -> tuple[Gain, tuple[float, float] | None]:
    """RMS norms over the blocks' frames; intervals of the latter and of the drop from drawing blocks anew."""
    if not blocks:
        return Gain(np.nan, np.nan), None
    counts = np.array([end - start for _, start, end in blocks])
    squares = [
        [(of.dynamics[k].residual_root[start:end, axes] ** 2).sum() for k, start, end in blocks]
        for of in (before, after)
    ]
    everything = np.arange(len(blocks))[None]
    draws = np.random.default_rng(0).integers(len(blocks), size=(BOOTSTRAPS, len(blocks)))
    (whole,), drawn = (
        np.sqrt(np.array(squares)[:, d].sum(axis=2) / counts[d].sum(axis=1)).T for d in (everything, draws)
    )
    before_after = float(whole[0]), float(whole[1])
    if len(blocks) < FEWEST_BLOCKS:
        return Gain(*before_after), None
    later, drop = (np.percentile(of, [2.5, 97.5]).tolist() for of in (drawn[:, 1], drawn[:, 0] - drawn[:, 1]))
    return Gain(*before_after, (later[0], later[1])), (drop[0], drop[1])


def _marker_rms(fitted: _Fitted, cases: Sequence[_Case]) -> float:
    fit = fitted.fit
    errors = [
        np.linalg.norm(marker_positions(fit.skeleton, motion.q) - case.plain.observed_ground, axis=2).ravel()
        for motion, case in zip(fit.motions, cases, strict=True)
    ]
    return float(np.sqrt(np.nanmean(np.concatenate(errors) ** 2)))


def _torque_change(skeleton: Skeleton, before: _Fitted, after: _Fitted) -> dict[str, float]:
    """RMS over all frames that figures count, joints only, greatest first."""
    pairs = zip(before.dynamics, after.dynamics, strict=True)
    change = np.concatenate([(a.joint_torques - b.joint_torques)[a.used] for b, a in pairs])
    rms = np.sqrt((change**2).mean(axis=0))
    root = set(root_joint(skeleton).dofs)
    joints = [d for d in np.argsort(-rms) if d not in root]
    return {skeleton.dofs[d]: float(rms[d]) for d in joints}


def _torque_rms(skeleton: Skeleton, fitted: _Fitted, dofs: Sequence[str]) -> dict[str, float]:
    torques = np.concatenate([own.joint_torques[own.used] for own in fitted.dynamics])
    rms = np.sqrt((torques**2).mean(axis=0))
    return {name: float(rms[skeleton.dofs.index(name)]) for name in dofs}


def _placing_notes(cases: Sequence[_Case], fitted: _Fitted) -> tuple[Note, ...]:
    """Where torques hear of a cause only through the motion."""
    lost = [p.at(fitted.fit.extra)[:, :3] for case in cases for p in case.extra.parts if p.body is None]
    size = max((float(np.abs(force).max()) for force in lost), default=0.0)
    if size < LEAST_PLACED_N:
        return ()
    return noted(
        Kind.OTHER,
        f"up to {size:.0f} N of what the causes add act on no segment in particular: joint torques change "
        "only through the motion there",
    )


def _cancelling_notes(cases: Sequence[_Case], fitted: _Fitted) -> tuple[Note, ...]:
    """Where the causes take away what was recorded, residuals fall whatever is true."""
    recorded, left = 0.0, 0.0
    for case in cases:
        counts, force = case.plain.counts, case.plain.wrench_ground[:, :3]
        added = case.extra.fixed_ground + case.extra.columns_ground @ fitted.fit.extra
        recorded += float((force[counts] ** 2).sum())
        left += float(((force + added[:, :3] / case.gain)[counts] ** 2).sum())
    share = np.sqrt(left / recorded) if recorded else 1.0
    if share >= LEAST_LEFT:
        return ()
    return noted(
        Kind.OTHER,
        f"the causes leave {100 * share:.0f} % of the recorded force: a residual that falls because the "
        "force is gone is no gain",
    )
