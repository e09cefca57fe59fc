"""Path of the pressure: where a plate says the foot presses, against where the foot's markers press.

Of eight turns and mirrors of the plate the one is sought under which its pressure goes as the foot does; the
shift that is left then tells where the plate is. A treadmill is no exception: both travel with the belt.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.capture.capture import ForcePlate
from solver.common.runs import runs
from solver.diagnosis.causes.effect import Turn
from solver.diagnosis.causes.rearranged_plate import turn_of
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.pressing_feet import PressingFoot, pressing_feet
from solver.diagnosis.direct_checks.settings import DIRECT_CHECKES, DirectCheckSettings
from solver.diagnosis.direct_checks.statement import MOST_NATS, About, Statement, nats_of

DIRECT_CHECK = "path of the pressure"
AS_IT_IS = "as it is"
TURNS = {  # of x and z, seen from above
    AS_IT_IS: np.array([[1.0, 0.0], [0.0, 1.0]]),
    "turned by a quarter": np.array([[0.0, 1.0], [-1.0, 0.0]]),
    "turned by half": np.array([[-1.0, 0.0], [0.0, -1.0]]),
    "turned by three quarters": np.array([[0.0, -1.0], [1.0, 0.0]]),
    "with x mirrored": np.array([[-1.0, 0.0], [0.0, 1.0]]),
    "with z mirrored": np.array([[1.0, 0.0], [0.0, -1.0]]),
    "with x and z exchanged": np.array([[0.0, 1.0], [1.0, 0.0]]),
    "with x and z exchanged and turned round": np.array([[0.0, -1.0], [-1.0, 0.0]]),
}
FEWEST_FRAMES = 5  # of a stance
BOTH_DOWN_M = 0.005  # a foot that swings is lifted by more, on average over the other's stance
MOSTLY = 0.7  # of a stance, in which another plate is loaded too, or a foot is seen


@dataclass(frozen=True)
class _Stance:
    """One load of one plate at the markers' frames, and the foot that bears it [m]."""

    pressure: Float[np.ndarray, "frames 2"]
    foot: Float[np.ndarray, "frames 2"]


def pressure_path(trials: Sequence[Measured]) -> list[Statement]:
    """Each plate over all trials that loaded it."""
    return [_of_plate(trials[0], k + 1, stances) for k, stances in _all_stances(trials).items()]


def turns_by_path(
    trials: Sequence[Measured], settings: DirectCheckSettings = DIRECT_CHECKES
) -> dict[str, dict[Turn, float]]:
    """By plate, how much better its pressures go with the foot under each turn than as they are [nats].

    The best of them is held to what refutes, and the others keep their distance from it, down to as much
    against them: beside the balance, which has the same pressures in its moments, this is to decide between
    turns and what else may be wrong with a plate, and not alone.
    """
    most, told = settings.refuting_nats, {}
    for k, stances in _all_stances(trials).items():
        errors, _ = _errors(stances)
        gains = {name: _worth(settings) * (errors[AS_IT_IS] - error) for name, error in errors.items()}
        over = max(0.0, max(gains.values()) - most)
        told[f"plate_{k + 1}"] = {
            turn_of(TURNS[name]): max(-most, gain - over) for name, gain in gains.items()
        }
    return told


def _all_stances(trials: Sequence[Measured]) -> dict[int, list[_Stance]]:
    """By plate, counted from 0, of all trials that loaded it."""
    count = max((len(t.capture.plates) for t in trials), default=0)
    feet = [pressing_feet(t.capture.markers, t.settings) for t in trials]
    found: dict[int, list[_Stance]] = {}
    for k in range(count):
        for trial, seen in zip(trials, feet, strict=True):
            if k < len(trial.capture.plates) and seen:
                found.setdefault(k, []).extend(_stances(trial, k, seen))
    return {k: stances for k, stances in found.items() if stances}


def _errors(stances: Sequence[_Stance]) -> tuple[dict[str, float], dict[str, Float[np.ndarray, "2"]]]:
    """Under each turn: squared distances of foot and pressure about their mean [m²], and that mean [m]."""
    errors, shifts = {}, {}
    for name, R in TURNS.items():
        moved = [s.foot - s.pressure @ R.T for s in stances]
        shift = np.mean([m.mean(axis=0) for m in moved], axis=0)
        errors[name] = float(sum(((m - shift) ** 2).sum(axis=1).mean() for m in moved))
        shifts[name] = shift
    return errors, shifts


def _worth(settings: DirectCheckSettings) -> float:
    """Of a square metre [nats]."""
    return settings.path_worth / (2 * settings.path_scatter_m**2)


def _of_plate(trial: Measured, number: int, stances: Sequence[_Stance]) -> Statement:
    settings = trial.settings
    errors, shifts = _errors(stances)
    worth = _worth(settings)
    best = min(errors, key=lambda name: errors[name])
    others = min(error for name, error in errors.items() if name != AS_IT_IS)
    turned = float(np.clip(worth * (errors[AS_IT_IS] - others), -MOST_NATS, MOST_NATS))
    off = float(np.linalg.norm(shifts[AS_IT_IS]))
    std = settings.path_scatter_m / np.sqrt(settings.path_worth * len(stances))
    place = nats_of(off, std, settings.place_scatter_m, settings.place_usual_m, axes=2)
    scatter = np.sqrt(errors[AS_IT_IS] / len(stances))
    told = f"{100 * off:.0f} cm off the foot on average, scattering by {100 * scatter:.0f} cm"
    if turned > settings.told_nats:
        rest = np.sqrt(errors[best] / len(stances))
        told += f"; {best} it would scatter by {100 * rest:.0f} cm"
    stood = "stance" if len(stances) == 1 else "stances"
    return Statement(
        DIRECT_CHECK,
        f"plate {number}: its pressure is {told} ({len(stances)} {stood}; normal: up to 7 cm off, "
        "scattering by 5).",
        {About.PLATE_TURN: turned, About.PLATE_PLACE: place},
        {"off_m": off, "off_x_m": float(-shifts[AS_IT_IS][0]), "off_z_m": float(-shifts[AS_IT_IS][1])}
        | {"scatter_m": float(scatter), "std_m": float(std)},
        target=f"plate_{number}",
    )


def _stances(trial: Measured, k: int, feet: Sequence[PressingFoot]) -> list[_Stance]:
    """Of plate k, each with the foot that bears it."""
    centres = [_pressed(trial, plate) for plate in trial.capture.plates]
    centre, found = centres[k], []
    for start, end in runs(np.isfinite(centre).all(axis=1)):
        if end - start < FEWEST_FRAMES or not all(_seen(foot, start, end) for foot in feet):
            continue  # a foot that is not seen may bear it as well as one that is
        others = [c[start:end] for j, c in enumerate(centres) if j != k]
        middle = _bearing(feet, start, end, centre[start:end], others).middle[start:end]
        known = np.isfinite(middle).all(axis=1)
        if known.sum() >= FEWEST_FRAMES:
            found.append(_Stance(centre[start:end][known], middle[known]))
    return found


def _pressed(trial: Measured, plate: ForcePlate) -> Float[np.ndarray, "frames 2"]:
    """Centre of pressure at the markers' frames; NaN where little presses [m]."""
    times = trial.capture.markers.times
    nearest = np.round((times - plate.start_time) * plate.rate).astype(int)
    inside = (nearest >= 0) & (nearest < plate.samples)
    nearest = nearest.clip(0, plate.samples - 1)
    force, centre = plate.force_ground[nearest, 1], plate.cop_ground[nearest][:, [0, 2]]
    with np.errstate(invalid="ignore"):
        least = max(5 * trial.settings.loaded_N, trial.settings.loaded_share * np.nanmax(force, initial=0.0))
        loaded = inside & (force > least)
    return np.where(loaded[:, None], centre, np.nan)


def _bearing(
    feet: Sequence[PressingFoot],
    start: int,
    end: int,
    centre: Float[np.ndarray, "frames 2"],
    others: Sequence[Float[np.ndarray, "frames 2"]],
) -> PressingFoot:
    """The foot that is down all through a stance.

    Of two that are, the nearer one; where a second plate is loaded, each plate has a foot of its own.
    """
    lifts = [float(np.nanmean(f.lift[start:end])) for f in feet]
    down = [f for f, lift in zip(feet, lifts, strict=True) if lift < min(lifts) + BOTH_DOWN_M]
    if len(down) == 1:
        return down[0]
    away = [_away(f.middle[start:end], centre) for f in down]
    shared = [other for other in others if np.isfinite(other).all(axis=1).mean() > MOSTLY]
    if len(shared) == 1:
        of_other = [_away(f.middle[start:end], shared[0]) for f in down]
        return down[int(away[0] + of_other[1] > away[1] + of_other[0])]
    return down[int(np.argmin(away))]


def _seen(foot: PressingFoot, start: int, end: int) -> bool:
    """Whether it is known, through most of a stance, how high it is."""
    return bool(np.isfinite(foot.lift[start:end]).mean() > MOSTLY)


def _away(middle: Float[np.ndarray, "frames 2"], centre: Float[np.ndarray, "frames 2"]) -> float:
    gaps = np.linalg.norm(middle - centre, axis=1)
    return float(np.nanmean(gaps)) if np.isfinite(gaps).any() else np.inf
