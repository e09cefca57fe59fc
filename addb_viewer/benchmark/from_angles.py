"""Our own entry: what the solver says of a trial without force plates, from angles alone."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from addb_viewer.benchmark.task import Foretold, Log, Seen, Trials
from solver.capture.conditioning import shared_cutoff
from solver.dynamics.divided_wrench import divided
from solver.dynamics.root_wrench import root_wrench
from solver.dynamics.unmeasured_forces import unmeasured_forces
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.settings import Settings
from solver.skeleton.forward import ForwardKinematics, body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel


@dataclass(frozen=True)
class FromAngles:
    """Smoothed momentum that the ground only pushes, nothing in flight; divided between the soles."""

    name: str = "fit-from-angles"
    settings: Settings = field(default_factory=Settings, repr=False)

    def fit(self, train: Trials, dev: Trials, log: Log) -> None:
        """Nothing is learnt."""

    def predict(self, seen: Seen) -> Foretold:
        """See the class."""
        motion = Motion(seen.skeleton.dofs, seen.q, seen.rate)
        smooth = motion.low_passed(self.settings.dynamics.unmeasured_cutoff_Hz)
        total = self.total_wrench(seen, motion)
        everybody = np.ones((seen.frames, 2), dtype=bool)
        wrenches = divided(seen.skeleton, seen.foot_bodies, smooth.q, total, everybody)
        feet = body_poses(seen.skeleton, seen.q)[1][:, list(seen.feet)]
        force = wrenches[..., :3]
        return Foretold(force, wrenches[..., 3:] - np.cross(feet, force), q=smooth.q)

    def total_wrench(self, seen: Seen, motion: Motion) -> Float[np.ndarray, "frames 6"]:
        """Of both feet together [N, N·m about the ground origin].

        Args:
            seen: what is shown.
            motion: the same coordinates.
        """
        cutoff = shared_cutoff(seen.rate, self.settings.conditioning)
        gentle = motion.low_passed(cutoff, self.settings.conditioning.order)
        model, root = RigidBodyModel(seen.skeleton), root_joint(seen.skeleton)
        torque = model.inverse_dynamics(gentle.q, gentle.velocity, gentle.acceleration)
        kinematics = ForwardKinematics(seen.skeleton)
        demand = root_wrench(root, kinematics.chain, kinematics.poses(gentle.q), torque)
        com = model.centre_of_mass(gentle.q)
        smoothing = self.settings.dynamics.unmeasured_cutoff_Hz
        return unmeasured_forces(demand, com, seen.rate, smoothing).wrench_ground
