"""The wrench balance of a fit to the markers: required and measured, at the markers' frames."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import make_interp_spline

from solver.capture.capture import Capture, ForcePlate
from solver.capture.subject.subject import open_subject
from solver.common.filters import low_pass
from solver.fitting.fit import TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.settings import settings_for
from solver.simulate.ground_demand import GroundDemand
from solver.skeleton.forward import ForwardKinematics, cross
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

CUTOFF_Hz = 10.0  # of motion and forces alike
GRAVITY = np.array([0.0, -9.80665, 0.0])  # [m/s²]
EDGE_FRAMES = 5  # accelerations at the trial's ends are not used
LOADED_N = 20.0


@dataclass(frozen=True)
class MarkerBalance:
    """One trial; wrenches are force [N] and moment about the model's centre of mass [N·m], ground frame."""

    trial: str
    times: Float[np.ndarray, " frames"]  # [s]
    com: Float[np.ndarray, "frames 3"]  # [m]
    required: Float[np.ndarray, "frames 6"]
    plates: Float[np.ndarray, "plates frames 6"]  # zero where nothing is handed out
    pressure: Float[np.ndarray, "plates frames 3"]  # [m]; zero where unloaded
    known: Bool[np.ndarray, " frames"]  # forces are handed out, and no end is near
    body_names: tuple[str, ...]
    body_masses: Float[np.ndarray, " bodies"]  # [kg]
    body_com: Float[np.ndarray, "frames bodies 3"]  # [m]
    body_R: Float[np.ndarray, "frames bodies 3 3"]

    @property
    def measured(self) -> Float[np.ndarray, "frames 6"]:
        """All plates together."""
        return self.plates.sum(axis=0)

    @property
    def residual(self) -> Float[np.ndarray, "frames 6"]:
        """Required less measured."""
        return self.required - self.measured

    def at(self, force: Float[np.ndarray, "frames 3"], point: Float[np.ndarray, "frames 3"]) -> np.ndarray:
        """The wrench of a force at a point."""
        return np.concatenate([force, cross(point - self.com, force)], axis=1)

    def body(self, name: str) -> int:
        """Which body is called so."""
        return self.body_names.index(name)

    def acceleration(self, body: int) -> Float[np.ndarray, "frames 3"]:
        """Of a body's centre of mass [m/s²]."""
        return derivative(self.times, self.body_com[:, body], 2)

    def about_origin(self, wrench: Float[np.ndarray, "frames 6"]) -> Float[np.ndarray, "frames 6"]:
        """The same wrench with its moment about the ground origin."""
        force = wrench[:, :3]
        return np.concatenate([force, wrench[:, 3:] + cross(self.com, force)], axis=1)


def marker_balances(folder: Path) -> list[MarkerBalance]:
    """Fit a case's markers without its forces, and set up the balance of each trial."""
    settings = settings_for(folder)
    alone = replace(settings, trajectory=replace(settings.trajectory, enabled=False))
    fit = solve(open_subject(folder), alone)
    return [_balance(fit.skeleton, trial) for trial in fit.trials]


def derivative(times: np.ndarray, values: np.ndarray, order: int) -> np.ndarray:
    """Of the quintic spline through the values."""
    return make_interp_spline(times, values, k=5)(times, nu=order)


def _balance(skeleton: Skeleton, trial: TrialFit) -> MarkerBalance:
    motion = trial.motion.low_passed(CUTOFF_Hz)
    demand = GroundDemand(RigidBodyModel(skeleton)).wrench(motion.q, motion.velocity, motion.acceleration)
    poses = ForwardKinematics(skeleton).poses(motion.q)
    offsets = np.array([b.com_body for b in skeleton.bodies])
    body_com = poses.p_ground_body + np.einsum("fbij,bj->fbi", poses.R_ground_body, offsets)
    masses = np.array([b.mass for b in skeleton.bodies])
    com = np.einsum("b,fbi->fi", masses, body_com) / masses.sum()
    plates = np.array([_about(com, _sampled(plate, motion.times)) for plate in trial.capture.plates])
    known = _known(trial.capture, motion.times)
    return MarkerBalance(
        trial=trial.capture.name,
        times=motion.times,
        com=com,
        required=_about(com, demand),
        plates=np.where(known[:, None], plates, 0.0),
        pressure=np.array([_pressure(plate, motion.times) for plate in trial.capture.plates]),
        known=known,
        body_names=tuple(b.name for b in skeleton.bodies),
        body_masses=masses,
        body_com=body_com,
        body_R=poses.R_ground_body,
    )


def _about(com: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    return np.concatenate([wrench[:, :3], wrench[:, 3:] - cross(com, wrench[:, :3])], axis=1)


def _sampled(plate: ForcePlate, times: np.ndarray) -> np.ndarray:
    read = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    smooth = low_pass(read, plate.rate, CUTOFF_Hz)
    return np.stack([np.interp(times, plate.times, column) for column in smooth.T], axis=1)


def _pressure(plate: ForcePlate, times: np.ndarray) -> np.ndarray:
    nearest = np.clip(np.round((times - plate.start_time) * plate.rate).astype(int), 0, plate.samples - 1)
    point = np.nan_to_num(plate.cop_ground[nearest])
    return np.where(plate.force_ground[nearest, 1:2] > LOADED_N, point, 0.0)


def _known(capture: Capture, times: np.ndarray) -> np.ndarray:
    known = np.ones(len(times), dtype=bool)
    for plate in capture.plates:
        known &= (times >= plate.times[0]) & (times <= plate.times[-1])
    last = int(np.flatnonzero(known)[-1])
    known[max(last - EDGE_FRAMES, 0) :] = False  # the low-pass has no neighbours there
    known[:EDGE_FRAMES] = False
    return known
