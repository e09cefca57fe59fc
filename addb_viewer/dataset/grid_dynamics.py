"""Torques and residuals on the release's grid: computed there, never interpolated."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from addb_viewer.dataset.grid import Grid
from solver.common.runs import runs
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.force_prediction.missing_wrench import torques_under
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.fitting.fit import TrialFit
from solver.fitting.settings import Settings
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

_ROUNDING = 1e-6  # [N, N·m] below it nothing acts beside the forces


@dataclass(frozen=True)
class Extra:
    """What accepted causes add to a trial, at some frames."""

    root: Float[np.ndarray, "frames 6"]  # [N, N·m about the root joint's centre]
    torques: Float[np.ndarray, "frames dofs"]  # that they take from the joint torques [N·m or N]

    def on(self, grid: Grid) -> "Extra":
        """By cubic splines, at the grid's frames."""
        return Extra(grid.interpolated(self.root), grid.interpolated(self.torques))


def extra_of(trial: TrialFit, skeleton: Skeleton, settings: Settings) -> Extra:
    """By how much the fit's dynamics differ from those under the recorded and predicted forces alone.

    Args:
        trial: at the recording's frames, with dynamics.
        skeleton: fitted.
        settings: of the fit.
    """
    contacts, mask, dynamics = _parts(trial)
    alone = inverse_dynamics(skeleton, dynamics.motion, contacts, mask, settings.dynamics)
    root = alone.residual_root - dynamics.residual_root
    if not np.abs(root).max(initial=0.0) > _ROUNDING:
        return Extra(np.zeros_like(root), np.zeros_like(dynamics.joint_torques))
    torques = torques_under(skeleton, alone, contacts, mask, joined_wrenches(trial))
    return Extra(root, torques - dynamics.joint_torques)


def joined_wrenches(trial: TrialFit) -> Float[np.ndarray, "frames feet 6"]:
    """Measured where they count, predicted elsewhere [N, N·m about the ground origin].

    The inference joined both without a jump.
    """
    contacts, mask, dynamics = _parts(trial)
    predicted = dynamics.wrench_predicted_ground
    other = np.zeros_like(contacts.wrench_ground) if predicted is None else predicted
    return np.where(mask.counts[:, :, None], contacts.wrench_ground, other)


def dynamics_on_grid(
    trial: TrialFit,
    motion: Motion,
    contacts: ContactWrenches,
    mask: FrameMask,
    *,
    grid: Grid,
    extra: Extra,
    skeleton: Skeleton,
    settings: Settings,
) -> Dynamics:
    """Inverse dynamics of the motion on the grid, under the wrenches there.

    Where a foot's wrench is missing, torques rest on the predicted one, by the spline of `joined_wrenches`.

    Args:
        trial: at the recording's frames, with dynamics.
        motion: on the grid.
        contacts: on the grid.
        mask: on the grid.
        grid: of the release.
        extra: on the grid.
        skeleton: fitted.
        settings: of the fit.
    """
    there = inverse_dynamics(skeleton, motion, contacts, mask, settings.dynamics)
    ends = min(settings.dynamics.end_frames, grid.native_frames // 4)
    inside = np.zeros(grid.frames, dtype=bool)
    for start, end in runs(trial.motion.posed):
        inside |= (grid.places >= start + ends) & (grid.places <= end - 1 - ends)
    there = replace(there, used=contacts.observed & mask.all_feet & inside)
    if not mask.counts.all():
        counted = mask.counts[:, :, None]
        predicted = grid.interpolated(joined_wrenches(trial))
        wrenches = np.where(counted, contacts.wrench_ground, predicted)
        there = replace(
            there,
            joint_torques=torques_under(skeleton, there, contacts, mask, wrenches),
            wrench_is_predicted=~mask.counts,
            wrench_predicted_ground=np.where(counted, 0.0, predicted),
        )
    return replace(
        there,
        joint_torques=there.joint_torques - extra.torques,
        residual_root=there.residual_root - extra.root,
        residual_raw_root=there.residual_raw_root - extra.root,
    )


def _parts(trial: TrialFit) -> tuple[ContactWrenches, FrameMask, Dynamics]:
    assert trial.contacts is not None
    assert trial.mask is not None
    assert trial.dynamics is not None
    return trial.contacts, trial.mask, trial.dynamics
