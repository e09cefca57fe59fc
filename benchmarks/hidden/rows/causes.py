"""What each cause would leave in the balance: columns to first order, one candidate a target."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from benchmarks.hidden.rows.balance import GRAVITY, LOADED_N, MarkerBalance, derivative
from solver.common.filters import low_pass
from solver.skeleton.forward import cross

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
