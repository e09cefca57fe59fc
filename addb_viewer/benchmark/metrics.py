"""Errors frame by frame, as the paper's benchmark defines them, and further ones.

Everything per kilogram is divided by the mass of the fitted skeleton, as the paper's table is per kilogram.
NaN marks frames on which a figure has no meaning.
"""

import numpy as np
from jaxtyping import Float, Int

from addb_viewer.benchmark.completing import WholeAnswer
from addb_viewer.benchmark.task import Measured
from solver.skeleton.skeleton import Skeleton

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
