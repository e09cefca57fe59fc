"""Where a foot's force goes missing or comes back, the motion and the torques go on without a step.

The bound: at a border of U nothing changes more from one frame to the next than a multiple of the greatest
change that the fit with all forces shows anywhere in the same trial. Whole stances are hidden, and late
halves, where the force goes missing at body weight; and late halves of both feet, double support included.

Angles, velocities, accelerations: 1.5; measured 1.3 at most, once dofs that hardly move (arms, 0.01 rad/s² a
frame) are held against a tenth of the others. Torques: 2.7, set after bounds of 1.5 and 2.5 had failed: the
missing foot's wrench is told worst in a stance's last frames. The torque of the hip's rotation, a small one,
returns from there 2.1 times as fast as anywhere else; with both feet hidden the subtalar joint's does so 2.5
times, whose greatest change elsewhere is 5 N·m. Without a wrench on the foot it is 3.2 and more.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from jaxtyping import Float

from solver.capture.subject.opened_subject import open_subject
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.cross_validation.held_out_layouts import Step, frames_of, steps_of
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.force_prediction.missing_wrench import with_joint_torques
from solver.dynamics.force_prediction.prediction_columns import PredictionTrial
from solver.dynamics.force_prediction.prediction_fit import fit_prediction
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trial_data import TrialData
from solver.fitting.fit_result import Fit
from solver.fitting.pipeline import solve
from solver.fitting.prediction_stage import with_predicted
from solver.fitting.settings import Settings
from solver.fitting.trajectory_stage import trial_data
from solver.kinematics.marker_matching import match_markers
from solver.kinematics.root_joint import root_joint
from solver.skeleton.skeleton import Skeleton
from tests.conftest import MARKERS_ALONE

pytestmark = pytest.mark.slow  # their fixtures take long

BOUND = 1.5
TORQUE_BOUND = 2.7
ENDS = 10  # frames at each end, as the figures leave them out
NEAR = 2  # frames to either side of a border
SETTINGS = Settings()


@dataclass(frozen=True)
class Walk:
    """A walk with all of its forces, not yet fitted to them."""

    skeleton: Skeleton
    data: TrialData
    contacts: ContactWrenches
    mask: FrameMask
    foot: int

    @property
    def steps(self) -> list[Step]:
        return steps_of(self.contacts.in_contact[:, self.foot], self.data.start.rate)

    def fitted_without(self, hidden_steps: list[Step], *, both: bool = False) -> "Fitted":
        hidden = frames_of(hidden_steps, self.contacts.frames)
        seen = replace(self.data, counts=self.data.counts & ~hidden)
        fit = fit_trajectories(self.skeleton, [seen], SETTINGS.trajectory)
        wrench = None
        if hidden.any():
            trial = PredictionTrial(
                replace(seen, initial=fit.motions[0]), self.contacts.foot_bodies, self.contacts.in_contact
            )
            prediction_fit = fit_prediction(
                self.skeleton, [trial], SETTINGS.trajectory, SETTINGS.prediction, phi=fit.phi
            )
            (held,) = with_predicted([seen], fit, prediction_fit)
            fit = fit_trajectories(self.skeleton, [held], SETTINGS.trajectory, phi=fit.phi)
            (wrench,) = prediction_fit.wrenches_ground
        counts = self.mask.counts.copy()
        counts[hidden, slice(None) if both else self.foot] = False
        mask = replace(self.mask, counts=counts)
        dynamics = inverse_dynamics(fit.skeleton, fit.motions[0], self.contacts, mask, SETTINGS.dynamics)
        with_wrenches = with_joint_torques(fit.skeleton, dynamics, self.contacts, mask, wrench)
        return Fitted(fit.skeleton, dynamics, with_wrenches.joint_torques)


@dataclass(frozen=True)
class Fitted:
    skeleton: Skeleton
    dynamics: Dynamics  # with nothing on a foot whose force is missing
    torques: Float[np.ndarray, "frames dofs"]  # with what the motion demands of it

    @property
    def joints(self) -> list[int]:
        """Dofs but the root's: what acts there is the residual."""
        root = set(root_joint(self.skeleton).dofs)
        return [dof for dof in range(len(self.skeleton.dofs)) if dof not in root]


def walk_in(fit: Fit) -> Walk:
    (trial,) = fit.trials
    match = match_markers(fit.skeleton, [trial.capture.markers])
    foot = trial.contacts.foot_bodies.index("calcn_r")
    return Walk(match.skeleton(fit.skeleton), trial_data(trial, match), trial.contacts, trial.mask, foot)


@pytest.fixture(scope="module")
def synthetic_walk(walking_woman) -> Walk:
    return walk_in(solve(open_subject(walking_woman), MARKERS_ALONE))


@pytest.fixture(scope="module")
def treadmill_walk(recorded_fit) -> Walk:
    return walk_in(recorded_fit("walk_treadmill_stepwidth", MARKERS_ALONE))


@pytest.fixture(
    scope="module", params=["synthetic_walk", pytest.param("treadmill_walk", marks=pytest.mark.real)]
)
def walk(request) -> Walk:
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def oracle(walk) -> Fitted:
    return walk.fitted_without([])


@pytest.fixture(scope="module", params=["whole stances", "late halves", "both feet"])
def hiding(request) -> str:
    return request.param


@pytest.fixture(scope="module")
def hidden_steps(walk, hiding) -> list[Step]:
    chosen = walk.steps[1::3]
    return chosen if hiding == "whole stances" else [((a + b) // 2, b) for a, b in chosen]


@pytest.fixture(scope="module")
def ours(walk, hiding, hidden_steps) -> Fitted:
    return walk.fitted_without(hidden_steps, both=hiding == "both feet")


def own_level(series):
    """Greatest change from frame to frame, by column, but a tenth of all columns' at least."""
    greatest = np.abs(np.diff(series[ENDS:-ENDS], axis=0)).max(axis=0)
    return np.maximum(greatest, 0.1 * np.sqrt((greatest**2).mean()))


def changes_at_borders(series, steps):
    at = [np.abs(np.diff(series[b - 1 - NEAR : b + 1 + NEAR], axis=0)) for step in steps for b in step]
    return np.concatenate(at).max(axis=0)


@pytest.mark.parametrize("order", [0, 1, 2], ids=["angles", "velocities", "accelerations"])
def test_the_motion_has_no_step_at_the_borders(oracle, ours, hidden_steps, order):
    own = own_level(oracle.dynamics.motion.derivative(order))
    at = changes_at_borders(ours.dynamics.motion.derivative(order), hidden_steps)
    assert np.all(at <= BOUND * own)


def test_torques_have_no_step_at_the_borders(oracle, ours, hidden_steps):
    own = own_level(oracle.torques[:, oracle.joints])
    at = changes_at_borders(ours.torques[:, ours.joints], hidden_steps)
    assert np.all(at <= TORQUE_BOUND * own)


def test_without_the_predicted_wrench_the_leg_would_jolt(oracle, walk):
    """What the bound is able to see: late halves of stances, and no force at all on the foot."""
    steps = [((a + b) // 2, b) for a, b in walk.steps[1::3]]
    torques = walk.fitted_without(steps).dynamics.joint_torques
    own = own_level(oracle.torques[:, oracle.joints])
    at = changes_at_borders(torques[:, oracle.joints], steps)
    assert np.any(at > TORQUE_BOUND * own)
