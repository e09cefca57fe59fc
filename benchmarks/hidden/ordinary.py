"""Ordinary methods on the wrench balance of a fit to the markers: required and measured, frame by frame.

The best single cause by least squares: each cause would leave columns in the balance, to first order, one
candidate a target; each is fitted alone and compared by BIC, without a prior and nothing unknown. And
residual reduction by the torso's mass and centre, the idea of OpenSim's RRA, which names nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import make_interp_spline

from benchmarks.hidden.format import NONE
from solver.capture.capture import Capture, ForcePlate
from solver.capture.subject.opened_subject import open_subject
from solver.common.filters import low_pass
from solver.fitting.fit_result import TrialFit
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


FORWARD, UP, SIDEWAYS = np.eye(3)
TRUNK = ("pelvis", "torso")
TOUCHED = ("hand_r", "hand_l", "pelvis", "torso", "femur_r", "femur_l")
LOADED = ("torso", "pelvis", "hand_r", "hand_l", "tibia_r", "tibia_l")
LEGS = ("femur_r", "femur_l", "tibia_r", "tibia_l")
WINDOWS = ((0.1, 0.4), (0.2, 0.6), (0.3, 0.7), (0.5, 0.8))  # of the trial, in which something may touch
BELT_KNOT_S = 0.25
FILTER_Hz = (3.0, 4.0, 6.0)
MISREAD = (np.diag([-1.0, 1, 1]), np.diag([1.0, 1, -1]), np.eye(3)[::-1])  # a sign, or two axes exchanged


@dataclass(frozen=True)
class Candidate:
    """One cause at one target: residual = fixed + columns · x. What a plate causes ends with its data."""

    id: str
    columns: Float[np.ndarray, "frames 6 parameters"]
    fixed: Float[np.ndarray, "frames 6"]
    searched: int = 0  # places or times that were tried for it
    parameters: tuple[str, ...] = ()  # public names of the columns' factors
    offset: float = 0.0  # of the parameters where the factors are nothing


def candidates(b: MarkerBalance) -> list[Candidate]:
    """Every cause that shows in the wrench, at every target; marker faults do not."""
    return [candidate for make in (_time, _plates, _person, _body) for candidate in make(b)]


def _linear(id: str, columns: list[np.ndarray], **about: object) -> Candidate:
    return Candidate(id, np.stack(columns, axis=2), np.zeros_like(columns[0]), **about)  # type: ignore[arg-type]


def _time(b: MarkerBalance) -> Iterator[Candidate]:
    ground = derivative(b.times, b.about_origin(b.required), 1)
    change = np.concatenate([ground[:, :3], ground[:, 3:] - cross(b.com, ground[:, :3])], axis=1)
    yield _linear("clock_offset", [change], parameters=("offset_s",))
    since = b.times - b.times[0]
    yield _linear("sample_rate", [since[:, None] * change], parameters=("stretch",))
    rate = 1 / (b.times[1] - b.times[0])
    for cutoff in FILTER_Hz:
        lost = b.required - low_pass(b.required, rate, cutoff)
        yield Candidate("filter_mismatch", np.zeros((*lost.shape, 0)), lost, searched=len(FILTER_Hz))


def _plates(b: MarkerBalance) -> Iterator[Candidate]:
    used = [k for k in range(len(b.plates)) if (_load(b, k) > LOADED_N).any()]
    for k in used:
        on = (_load(b, k) > LOADED_N)[:, None]
        force, point = b.plates[k, :, :3], b.pressure[k]
        centre = np.where(on, point[on[:, 0]].mean(axis=0), 0.0)
        about = {"searched": len(used)}
        yield _linear("plate_gain", [-b.plates[k]], parameters=("gain_error",), **about)
        biases = [-b.at(on * axis, centre) for axis in np.eye(3)]
        yield _linear("plate_bias", biases, parameters=("bias_x_N", "bias_y_N", "bias_z_N"), **about)
        shifts = [
            np.concatenate([0 * force, -cross(axis + 0 * force, force)], axis=1)
            for axis in (FORWARD, SIDEWAYS)
        ]
        yield _linear("plate_position", shifts, parameters=("shift_x_m", "shift_z_m"), **about)
        turned = b.at(cross(UP + 0 * force, force), point)
        turned[:, 3:] += cross(cross(UP + 0 * force, point - centre), force)
        yield _linear("plate_yaw", [-np.radians(1) * turned], parameters=("yaw_deg",), **about)
    tilts = [
        -np.radians(1) * sum(b.at(cross(axis + b.com * 0, b.plates[k, :, :3]), b.pressure[k]) for k in used)
        for axis in (FORWARD, SIDEWAYS)
    ]
    if used:
        yield _linear("gravity_tilt", tilts, parameters=("tilt_x_deg", "tilt_z_deg"))
    yield from _conventions(b, used)
    light = b.known & (b.measured[:, 1] < 0.5 * b.required[:, 1])
    if light.any():
        yield _linear("off_plate_step", [b.required * light[:, None]])


def _conventions(b: MarkerBalance, used: list[int]) -> Iterator[Candidate]:
    """Faults without a size: what the residual would be is known outright."""
    nothing = np.zeros((len(b.times), 6, 0))
    for right_way in MISREAD:
        lost = [b.at(b.plates[k, :, :3] @ (right_way - np.eye(3)), b.pressure[k]) for k in used]
        yield Candidate("axis_convention", nothing, sum(lost) + 0 * b.required, searched=len(MISREAD))
    if len(used) == 2:
        one, other = (b.plates[k, :, :3] for k in used)
        there, here = (b.pressure[k] for k in used)
        right = b.at(one, here) + b.at(other, there)
        yield Candidate("plate_swap", nothing, right - b.at(one, there) - b.at(other, here))


def _person(b: MarkerBalance) -> Iterator[Candidate]:
    still = np.zeros_like(b.com)
    for name in TRUNK:
        point, about = b.body_com[:, b.body(name)], {"searched": len(TRUNK)}
        yield _linear("body_weight_support", [b.at(UP + still, point)], parameters=("force_N",), **about)
        velocity = derivative(b.times, point, 1)
        yield _linear("drag", [b.at(-velocity, point)], parameters=("b_Ns_per_m",), **about)
        away = (point - point.mean(axis=0))[:, :1]
        yield _linear("elastic_tether", [b.at(FORWARD + still, point), b.at(FORWARD * away, point)], **about)
    for name in TOUCHED:
        point = b.body_com[:, b.body(name)]
        for first, last in WINDOWS:
            share = np.linspace(0, 1, len(b.times))
            inside = ((share >= first) & (share < last))[:, None]
            columns = [b.at(inside * axis, point) for axis in np.eye(3)]
            names = ("force_x_N", "force_y_N", "force_z_N")
            tried = len(TOUCHED) * len(WINDOWS)
            yield _linear("external_contact", columns, parameters=names, searched=tried)
    for name in LOADED:
        k = b.body(name)
        lifted = b.at(b.acceleration(k) - GRAVITY, b.body_com[:, k])
        yield _linear("carried_mass", [-lifted], parameters=("mass_kg",), searched=len(LOADED))


def _body(b: MarkerBalance) -> Iterator[Candidate]:
    yield _linear("subject_mass", [-b.required], parameters=("mass_factor",), offset=1.0)
    legs = sum(
        b.body_masses[k] * b.at(b.acceleration(k) - GRAVITY, b.body_com[:, k]) for k in map(b.body, LEGS)
    )
    yield _linear("segment_mass", [-legs], parameters=("mass_factor",), offset=1.0)
    mass, still = b.body_masses.sum(), np.zeros_like(b.com)
    knots = np.arange(b.times[0], b.times[-1] + BELT_KNOT_S, BELT_KNOT_S)
    hats = [np.clip(1 - np.abs(b.times - knot) / BELT_KNOT_S, 0, None)[:, None] for knot in knots]
    yield _linear("belt_acceleration", [mass * b.at(hat * FORWARD + still, b.com) for hat in hats])


def _load(b: MarkerBalance, k: int) -> np.ndarray:
    return b.plates[k, :, 1]


INDEPENDENT_S = 0.1  # frames nearer than this share what the low-pass at 10 Hz leaves
LEAST_SPREAD = 1e-9


@dataclass(frozen=True)
class Explained:
    """A candidate fitted to the trials of a case, which share its factors."""

    id: str
    bic: float
    parameters: dict[str, float]
    left_out: list[Float[np.ndarray, "frames 6"]]  # by trial, what the cause adds to the residual, all frames


def best_single_cause(balances: Sequence[MarkerBalance]) -> tuple[dict[str, float], Explained]:
    """Probabilities of all names from exp(−BIC/2), each name's best target, and the likeliest explained."""
    spread = np.sqrt(np.mean(np.concatenate([b.residual[b.known] for b in balances]) ** 2, axis=0))
    spread = np.maximum(spread, LEAST_SPREAD)
    nothing = [Candidate(NONE, np.zeros((*b.required.shape, 0)), np.zeros_like(b.required)) for b in balances]
    per_trial = [candidates(b) for b in balances]
    together = [nothing, *_by_target(per_trial)]
    fitted = [_fitted(balances, of_trials, spread) for of_trials in together]
    best: dict[str, Explained] = {}
    for one in fitted:
        if one.id not in best or one.bic < best[one.id].bic:
            best[one.id] = one
    lowest = min(one.bic for one in best.values())
    weights = {name: float(np.exp(-(one.bic - lowest) / 2)) for name, one in best.items()}
    total = sum(weights.values())
    return {n: w / total for n, w in weights.items()}, min(best.values(), key=lambda one: one.bic)


def _by_target(per_trial: Sequence[Sequence[Candidate]]) -> list[list[Candidate]]:
    """The same candidate in all trials; where trials offer different ones, those of the first alone."""
    first = per_trial[0]
    if all([c.id for c in other] == [c.id for c in first] for other in per_trial):
        shapes = [{c.columns.shape[2] for c in of_trials} for of_trials in zip(*per_trial, strict=True)]
        rows = zip(*per_trial, strict=True)
        return [list(of_trials) for of_trials, shape in zip(rows, shapes, strict=True) if len(shape) == 1]
    shared = {c.id for c in first}.intersection(*({c.id for c in other} for other in per_trial))
    return [[_first(of_trial, id) for of_trial in per_trial] for id in sorted(shared)]


def _first(of_trial: Sequence[Candidate], id: str) -> Candidate:
    return next(c for c in of_trial if c.id == id)


def _fitted(
    balances: Sequence[MarkerBalance], of_trials: Sequence[Candidate], spread: Float[np.ndarray, "6"]
) -> Explained:
    rows, columns = [], []
    for b, c in zip(balances, of_trials, strict=True):
        step = max(1, round(INDEPENDENT_S / (b.times[1] - b.times[0])))
        kept = np.flatnonzero(b.known)[::step]
        rows.append(((b.residual - c.fixed)[kept] / spread).ravel())
        columns.append((c.columns[kept] / spread[:, None]).reshape(6 * len(kept), c.columns.shape[2]))
    y, A = np.concatenate(rows), np.concatenate(columns)
    x = np.linalg.lstsq(A, y, rcond=None)[0]
    left = float(np.sum((y - A @ x) ** 2))
    first = of_trials[0]
    bic = len(y) * np.log(left / len(y)) + A.shape[1] * np.log(len(y)) + 2 * np.log(max(first.searched, 1))
    stated = {name: first.offset + float(value) for name, value in zip(first.parameters, x, strict=False)}
    return Explained(first.id, float(bic), stated, [c.fixed + c.columns @ x for c in of_trials])


TORSO = "torso"


def with_torso_shifted(balances: Sequence[MarkerBalance]) -> list[Float[np.ndarray, "frames 6"]]:
    """The wrenches required once the torso's mass, and its centre along its own x and z, are shifted.

    The three numbers make the mean vertical force and the mean moments about the two horizontal axes vanish.
    """
    columns = [_columns(b) for b in balances]
    known = np.concatenate([b.known for b in balances])
    mean = np.concatenate([b.residual for b in balances])[known].mean(axis=0)
    slopes = np.concatenate(columns)[known].mean(axis=0)
    balanced = [1, 3, 5]  # vertical force, moments about x and z
    x = np.linalg.lstsq(slopes[balanced], -mean[balanced], rcond=None)[0]
    return [b.required + c @ x for b, c in zip(balances, columns, strict=True)]


def _columns(b: MarkerBalance) -> Float[np.ndarray, "frames 6 3"]:
    """By a kilogram more at the torso's centre, and by a metre of its centre along its x and z."""
    k = b.body(TORSO)
    push = b.acceleration(k) - GRAVITY
    heavier = b.at(push, b.body_com[:, k])
    axes = (b.body_R[:, k, :, 0], b.body_R[:, k, :, 2])
    moved = [np.concatenate([0 * push, b.body_masses[k] * cross(axis, push)], axis=1) for axis in axes]
    return np.stack([heavier, *moved], axis=2)
