"""Errors frame by frame, as the paper's benchmark defines them, and further ones; their rows and their bands.

Everything per kilogram is divided by the mass of the fitted skeleton, as the paper's table is per kilogram.
NaN marks frames on which a figure has no meaning.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from addb_viewer.benchmark.task import BenchmarkError, Example, Measured, Predicted, Seen, central_differences
from solver.common.filters import low_pass
from solver.kinematics.root_joint import RootJoint, root_joint
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

CUTOFF_HZ = 30.0  # the paper's supplement, of the differenced motion; order 3


@dataclass(frozen=True)
class WholeAnswer:
    """Everything that is scored of an answer; arrays as in `Predicted`."""

    force: Float[np.ndarray, "frames feet 3"]  # [N]
    moment: Float[np.ndarray, "frames feet 3"]  # about the foot bodies' origins [N·m]
    foot_ground: Float[np.ndarray, "frames feet 3"]  # those origins [m]
    acceleration: Float[np.ndarray, "frames dofs"]
    com_acceleration: Float[np.ndarray, "frames 3"]  # of that acceleration, with gravity not taken off [m/s²]
    torque: Float[np.ndarray, "frames dofs"]
    remainder: Float[np.ndarray, "frames dofs"]  # of τ = M q̈ + C + g − Jᵀ f that the answer leaves
    root_dofs: tuple[int, ...]
    force_sd: Float[np.ndarray, "frames feet 3"] | None


def completed(seen: Seen, predicted: Predicted) -> WholeAnswer:
    """What the predictor did not say is added.

    Args:
        seen: what it was shown.
        predicted: what it said.

    Raises:
        BenchmarkError: an array has another shape, or values that are no numbers.
    """
    _check(seen, predicted)
    model, root = RigidBodyModel(seen.skeleton), root_joint(seen.skeleton)
    q, velocity, acceleration = motion_of(seen, predicted)
    com = model.centre_of_mass_acceleration(q, velocity, acceleration)
    if predicted.acceleration is None:
        required = predicted.force.sum(axis=1) / seen.mass_kg + seen.skeleton.gravity
        acceleration = acceleration.copy()
        acceleration[:, root.translation_dofs] += (required - com) @ np.linalg.inv(_ground_axes(root)).T
        com = required
    right_left = list(seen.feet)
    feet = body_poses(seen.skeleton, seen.q)[1][:, right_left]
    wrenches = np.concatenate(
        [predicted.force, predicted.moment + np.cross(feet, predicted.force)], axis=2
    )  # about the ground origin
    by_equation = model.inverse_dynamics(q, velocity, acceleration, wrenches, right_left)
    torque = by_equation if predicted.torque is None else predicted.torque
    return WholeAnswer(
        force=predicted.force,
        moment=predicted.moment,
        foot_ground=feet,
        acceleration=acceleration,
        com_acceleration=com,
        torque=torque,
        remainder=torque - by_equation,
        root_dofs=tuple(int(dof) for dof in root.dofs),
        force_sd=predicted.force_sd,
    )


def motion_of(
    seen: Seen, predicted: Predicted
) -> tuple[
    Float[np.ndarray, "frames dofs"], Float[np.ndarray, "frames dofs"], Float[np.ndarray, "frames dofs"]
]:
    """Coordinates and derivatives: the predictor's where it gives them, else of the filtered motion.

    Args:
        seen: what it was shown.
        predicted: what it said.
    """
    q = seen.q if predicted.q is None else predicted.q
    velocity, acceleration = central_differences(low_pass(q, seen.rate, CUTOFF_HZ), seen.rate)
    return (
        q,
        velocity if predicted.velocity is None else predicted.velocity,
        acceleration if predicted.acceleration is None else predicted.acceleration,
    )


def _ground_axes(root: RootJoint) -> Float[np.ndarray, "3 3"]:
    """Columns: where the root goes, in the ground frame, as each of its translations grows by one."""
    columns = []
    for axis in root.translations:
        at = axis.function(np.array([0.0, 1.0]))[0]
        columns.append(root.joint.R_parent_frame @ axis.axis * (at[1] - at[0]))
    return np.column_stack(columns)


def _check(seen: Seen, predicted: Predicted) -> None:
    feet, dofs = (seen.frames, 2, 3), seen.q.shape
    wanted = {"force": feet, "moment": feet, "force_sd": feet} | dict.fromkeys(
        ("acceleration", "velocity", "q", "torque"), dofs
    )
    for name, shape in wanted.items():
        value = getattr(predicted, name)
        if value is None:
            continue
        if np.shape(value) != shape:
            raise BenchmarkError(f"the predictor's {name} has shape {np.shape(value)}; it must be {shape}")
        if not np.isfinite(value).all():
            frame = int(np.flatnonzero(~np.isfinite(value).reshape(len(value), -1).all(axis=1))[0])
            raise BenchmarkError(f"the predictor's {name} is no number on frame {frame} of the stretch")


LOADED_N = 50.0  # vertical force of a foot from which centre of pressure and free moment are compared
CONTACT_N = 20.0  # as for the release's phases
GRAVITY = np.array([0.0, -9.80665, 0.0])  # [m/s²]
PHASES = (0, 1, 2, 3)
# Probability within ± so many standard deviations of a Gaussian.
BANDS = {50: 0.6744897501960817, 80: 1.2815515655446004, 95: 1.959963984540054}

UNITS = {
    "com_acc": "m/s²",
    "torque": "N·m/kg",
    "grm": "N·m/kg",
    "grf": "N/kg",
    "grf_vertical": "N/kg",
    "grf_total": "N/kg",
    "grf_stacked": "N/kg",
    "com_acc_by_force": "m/s²",
    "torque_with_root": "N·m/kg",
    "remainder": "N·m/kg",
    "free_moment": "N·m/kg",
    "free_moment_zero": "N·m/kg",
    "cop": "m",
    "share_right": "1",
    "phase": "1",
    "coverage_50": "1",
    "coverage_80": "1",
    "coverage_95": "1",
    "interval_95": "N/kg",
    "nll": "nat",
}
PAPER = ("grf", "grm", "torque", "com_acc")  # the paper's; first what plates judge

Errors = dict[str, Float[np.ndarray, " frames"]]


def frame_errors(measured: Measured, answer: WholeAnswer, skeleton: Skeleton) -> Errors:
    """All figures by name.

    Args:
        measured: NaN forces where they do not count.
        answer: of the same frames.
        skeleton: that gives the coordinates their names.
    """
    m = measured.mass_kg
    off = answer.force - measured.force
    moment = carried(answer, measured.foot_ground)
    torque = np.abs(answer.torque - measured.torque) / m
    below = [dof for dof in range(torque.shape[1]) if dof not in answer.root_dofs]
    by_force = answer.force.sum(axis=1) / m + GRAVITY
    errors = {
        "com_acc": _norm(answer.com_acceleration - measured.com_acceleration),
        "torque": torque[:, below].mean(axis=1),
        "grm": _norm(moment - measured.moment).mean(axis=1) / m,
        "grf": _norm(off).mean(axis=1) / m,
        "grf_vertical": np.abs(off[..., 1]).mean(axis=1) / m,
        "grf_total": _norm(off.sum(axis=1)) / m,
        "grf_stacked": _norm(off.reshape(len(off), 6)) / m,
        "com_acc_by_force": _norm(by_force - measured.com_acceleration),
        "torque_with_root": torque.mean(axis=1),
        "remainder": np.abs(answer.remainder).mean(axis=1) / m,
    }
    errors |= {f"torque:{skeleton.dofs[dof]}": torque[:, dof] for dof in below}
    return (
        errors
        | _of_pressure(measured, answer, moment)
        | _of_phases(measured, answer)
        | _bands(answer, off, m)
    )


def carried(
    answer: WholeAnswer, foot_ground: Float[np.ndarray, "frames feet 3"]
) -> Float[np.ndarray, "frames feet 3"]:
    """The answer's moments about other points [N·m]: n + (o − o') × f.

    Args:
        answer: with moments about its own feet's origins o.
        foot_ground: the points o' [m].
    """
    return answer.moment + np.cross(answer.foot_ground - foot_ground, answer.force)


def centre_of_pressure(
    force: Float[np.ndarray, "frames feet 3"],
    moment: Float[np.ndarray, "frames feet 3"],
    origin: Float[np.ndarray, "frames feet 3"],
    height: Float[np.ndarray, "frames feet"],
) -> tuple[Float[np.ndarray, "frames feet 3"], Float[np.ndarray, "frames feet"]]:
    """Where forces act at a height, and the moment about the vertical that is left there; NaN below LOADED_N.

    Args:
        force: [N].
        moment: about the origin [N·m].
        origin: [m].
        height: of the ground [m].
    """
    vertical = np.where(force[..., 1] > LOADED_N, force[..., 1], np.nan)
    up = height - origin[..., 1]
    x = (moment[..., 2] + up * force[..., 0]) / vertical
    z = (up * force[..., 2] - moment[..., 0]) / vertical
    free = moment[..., 1] - (z * force[..., 0] - x * force[..., 2])
    return origin + np.stack([x, up, z], axis=-1), free


def phases_of(force: Float[np.ndarray, "frames feet 3"]) -> Int[np.ndarray, " frames"]:
    """0 flight, 1 right foot alone, 2 left foot alone, 3 both.

    Args:
        force: on the right and the left foot [N].
    """
    loaded = force[..., 1] >= CONTACT_N
    return loaded[:, 0] + 2 * loaded[:, 1]


def _of_pressure(
    measured: Measured, answer: WholeAnswer, moment: Float[np.ndarray, "frames feet 3"]
) -> Errors:
    """Centre of pressure and free moment where both say that the foot carries; and the right foot's share."""
    m, height = measured.mass_kg, measured.cop_ground[..., 1]
    true = np.where(measured.force[..., 1:2] > LOADED_N, measured.cop_ground, np.nan)
    told, free = centre_of_pressure(answer.force, moment, measured.foot_ground, height)
    own_free = centre_of_pressure(measured.force, measured.moment, measured.foot_ground, height)[1]
    both = np.isfinite(free) & np.isfinite(own_free)
    of_body = [np.where(f[..., 1].sum(axis=1) > LOADED_N, f[..., 1].sum(axis=1), np.nan)
               for f in (measured.force, answer.force)]  # fmt: skip
    shares = [f[:, 0, 1] / whole for f, whole in zip((measured.force, answer.force), of_body, strict=True)]
    return {
        "cop": _mean_over_feet(_norm(told - true)),
        "free_moment": _mean_over_feet(np.abs(free - own_free)) / m,
        "free_moment_zero": _mean_over_feet(np.where(both, np.abs(own_free), np.nan)) / m,
        "share_right": np.abs(shares[1] - shares[0]),
    }


def _of_phases(measured: Measured, answer: WholeAnswer) -> Errors:
    """Whether the phase is right, and one indicator for each true and each told one."""
    told, known = phases_of(answer.force), measured.phase >= 0
    right = {"phase": np.where(known, told == measured.phase, np.nan)}
    return right | {
        f"phase:{one}>{other}": np.where(known, (measured.phase == one) & (told == other), np.nan)
        for one in PHASES
        for other in PHASES
    }


def _bands(answer: WholeAnswer, off: Float[np.ndarray, "frames feet 3"], m: float) -> Errors:
    """How often forces lie within the bands that are given, how wide these are, and the log density."""
    if answer.force_sd is None:
        return {}
    sd = np.maximum(answer.force_sd, 1e-6)
    unknown = np.isnan(off).any(axis=(1, 2))
    z = off / sd
    density = 0.5 * z**2 + np.log(sd) + 0.5 * np.log(2 * np.pi)
    figures = {f"coverage_{p}": (np.abs(z) < k).mean(axis=(1, 2)) for p, k in BANDS.items()}
    figures |= {"interval_95": 2 * BANDS[95] * sd.mean(axis=(1, 2)) / m, "nll": density.mean(axis=(1, 2))}
    return {name: np.where(unknown, np.nan, value) for name, value in figures.items()}


def _norm(vectors: Float[np.ndarray, "*frames 3"]) -> Float[np.ndarray, "*frames"]:
    return np.linalg.norm(vectors, axis=-1)


def _mean_over_feet(values: Float[np.ndarray, "frames feet"]) -> Float[np.ndarray, " frames"]:
    """Over the feet that have one; NaN where none has."""
    there = np.isfinite(values)
    total = np.where(there, values, 0.0).sum(axis=1)
    return total / np.where(there.any(axis=1), there.sum(axis=1), np.nan)


HISTORY, STRIDE = (
    50,
    5,
)  # frames that have to count before a scored one, and every how many (the MLP's window)
PEEKING_N_PER_KG = 0.01  # a hundredth of what plates are good for; nobody predicts forces so well

Frames = Literal["scored", "all"]


@dataclass(frozen=True)
class Score:
    """The mean of one figure over a stretch's frames with one activity."""

    person_id: str
    subject_id: str
    trial_id: str
    activity: str
    metric: str
    mean: float
    frames: int


def scored_frames(counts: Bool[np.ndarray, " frames"]) -> Bool[np.ndarray, " frames"]:
    """Frames that count and whose window of every 5th of the last 50 frames counts: alike for all predictors.

    Args:
        counts: of consecutive frames.
    """
    scored = counts.copy()
    for back in range(STRIDE, HISTORY, STRIDE):
        scored[back:] &= counts[:-back]
        scored[:back] = False
    return scored


def scores_of(example: Example, predicted: Predicted, frames: Frames = "scored") -> Iterator[Score]:
    """A row for each figure and activity.

    Args:
        example: what was shown and measured.
        predicted: what a predictor said.
        frames: "scored", or "all" that count.

    Raises:
        BenchmarkError: the answer has wrong shapes; or it is the measured force, which nobody can predict.
    """
    counts = example.measured.counts
    chosen = scored_frames(counts) if frames == "scored" else counts
    if not chosen.any():
        return
    errors = frame_errors(example.measured, completed(example.seen, predicted), example.seen.skeleton)
    loaded = np.nansum(example.measured.force[..., 1], axis=1) > LOADED_N
    _refuse_peeking(errors["grf"][chosen & loaded], example)
    for activity in sorted(set(example.measured.activity[chosen])):
        rows = chosen & (example.measured.activity == activity)
        for metric, values in errors.items():
            there = values[rows][np.isfinite(values[rows])]
            if len(there):
                who = (example.person_id, example.subject_id, example.trial_id)
                yield Score(*who, str(activity), metric, float(there.mean()), len(there))


def _refuse_peeking(grf: np.ndarray, example: Example) -> None:
    if len(grf) and np.median(grf) < PEEKING_N_PER_KG:
        raise BenchmarkError(
            f"{example.trial_id}: half of the forces on loaded feet are predicted within "
            f"{PEEKING_N_PER_KG} N/kg. No motion tells that; the predictor has seen the forces."
        )


EDGES_N_PER_KG = (0.3, 3.0, 7.0, 11.0)  # of the told vertical force, between bins
FEWEST_FRAMES = 20  # of a bin, or all bins' error stands for it
MOST_STRETCHES = 60


@dataclass(frozen=True)
class ErrorBands:
    """Root mean square errors of a foot's force over persons who are not tested, each weighing alike."""

    sd: Float[np.ndarray, "bins 2"]  # of a level component, of the vertical one [N/kg]

    def of(
        self, force: Float[np.ndarray, "frames feet 3"], mass_kg: float
    ) -> Float[np.ndarray, "frames feet 3"]:
        """Standard deviations of told forces [N].

        Args:
            force: told [N].
            mass_kg: of the shown body.
        """
        level, vertical = np.moveaxis(self.sd[_bins(force, mass_kg)], -1, 0)
        return mass_kg * np.stack([level, vertical, level], axis=-1)


def error_bands(answer: Callable[[Example], Predicted], examples: Iterable[Example]) -> ErrorBands | None:
    """What a predictor's errors are on some persons; None where nothing of them was measured.

    Args:
        answer: of the predictor, by what it is shown of the example.
        examples: of persons who are not tested, MOST_STRETCHES at most; best of such that it has not learnt.
    """
    bins = len(EDGES_N_PER_KG) + 1
    sums: dict[str, np.ndarray] = defaultdict(lambda: np.zeros((bins, 3)))
    for example in islice(examples, MOST_STRETCHES):
        counts = scored_frames(example.measured.counts)
        if not counts.any():
            continue
        force = answer(example).force[counts]
        square = ((force - example.measured.force[counts]) / example.measured.mass_kg) ** 2
        there = np.isfinite(square).all(axis=2)
        at = _bins(force, example.seen.mass_kg)[there]
        own = square[there]
        values = np.stack([np.ones(len(at)), own[:, [0, 2]].mean(axis=1), own[:, 1]], axis=1)
        np.add.at(sums[example.person_id], at, values)
    if not sums:
        return None
    return ErrorBands(np.sqrt(_over_persons(np.stack(list(sums.values())))))


def _over_persons(sums: Float[np.ndarray, "persons bins 3"]) -> Float[np.ndarray, "bins 2"]:
    """Mean squares: over frames of a person, then over persons that have frames in the bin."""
    whole = sums.sum(axis=1, keepdims=True)
    overall = (whole[..., 1:] / np.maximum(whole[..., :1], 1.0)).mean(axis=(0, 1))
    frames, squares = sums[..., :1], sums[..., 1:]
    there = (frames > 0).astype(float)
    means = (squares / np.maximum(frames, 1.0)).sum(axis=0) / np.maximum(there.sum(axis=0), 1.0)
    return np.where(frames.sum(axis=0) >= FEWEST_FRAMES, means, overall)


def _bins(force: Float[np.ndarray, "frames feet 3"], mass_kg: float) -> Int[np.ndarray, "frames feet"]:
    return np.searchsorted(EDGES_N_PER_KG, force[..., 1] / mass_kg)
