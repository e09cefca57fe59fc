"""Where plates say that feet press, against where the feet's markers do: paths of stances, and standing.

Markers that are down bear more than those that are up. A foot strikes with the toes up and leaves with the
heel up, so that the middle of what is down goes from heel to toe as the pressure does. Low markers that keep
their distance are one foot. So do two feet that both stand still: these are told apart by the sides in their
labels, or not at all. Of eight turns and mirrors of a plate the one is sought under which its pressure goes
as the foot does; the shift that is left then tells where the plate is. A treadmill is no exception: both
travel with the belt.

While somebody stands, the load shifts to and fro between the feet. How the moment changes with the force
tells about which point, free of every constant; where the mean pressure lies elsewhere, a constant is in it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from solver.capture.capture import ForcePlate, Markers
from solver.capture.plates.centre_of_pressure import surface_of
from solver.capture.plates.loads_under_feet import FOOT_HEIGHT_M, FOOT_LENGTH_M
from solver.common.plate_figures import CONTACT_N
from solver.common.true_runs import runs
from solver.diagnosis.causes.effect import Turn
from solver.diagnosis.causes.rearranged_plate import turn_of
from solver.diagnosis.direct_checks.measured import STANDING_S, Measured
from solver.diagnosis.direct_checks.statement import (
    MOST_NATS,
    REFUTING_NATS,
    STATED_NATS,
    About,
    Statement,
    nats_of,
)
from solver.markers.label_parts import sides

PATH, STANDING = "path of the pressure", "point of the changes"
FOOT_RIGID_M = 0.015  # by which distances on a foot scatter, toes that bend included
PRESSING_M = 0.015  # a marker so much above its own lowest bears a third of what it bears there
LOADED_SHARE = 0.3  # of a plate's largest load; below, pressures are noise
PATH_SCATTER_M = 0.03  # of the pressure about the foot's pressing markers, as in eight sound stances
PATH_WORTH = 3.0  # independent places of one stance: heel, middle, toes
PLACE_SCATTER_M = 0.02  # of the middle of all stances, each way: shoes, markers on one side of the foot
PLACE_USUAL_M = 0.15  # a plate entered at the wrong place
STANDING_SCATTER_M = 0.04  # of the point about which a standing foot's load changes: heel to ball

FEWEST_MARKERS = 2  # one marker has no heel and toe
MOST_MARKERS = 24  # of somebody who lies down, all would be low


@dataclass(frozen=True)
class PressingFoot:
    """One foot over time."""

    middle: Float[np.ndarray, "frames 2"]  # [m] x and z of what is down; NaN where unseen
    lift: Float[np.ndarray, " frames"]  # [m] of its lowest marker above its own lowest; NaN where unseen


def pressing_feet(markers: Markers) -> Sequence[PressingFoot]:
    """Both feet; none unless both have two markers: one that is not seen may bear a plate as well."""
    height = markers.positions_ground[:, :, 1]
    seen = np.flatnonzero(np.isfinite(height).any(axis=0))
    if not len(seen):
        return ()
    lowest = np.nanpercentile(height[:, seen], 2, axis=0)
    low = seen[lowest < lowest.min() + FOOT_HEIGHT_M]
    low = low[np.argsort(np.nanpercentile(height[:, low], 2, axis=0))][:MOST_MARKERS]
    still = _that_keep_their_distance(markers.positions_ground[:, low])
    side_of = sides(tuple(markers.names))
    groups = [g for kept in still for g in _one_foot_each(markers, low[kept], side_of)]
    groups = [g for g in sorted(groups, key=len, reverse=True) if len(g) >= FEWEST_MARKERS]
    return [_foot(markers.positions_ground[:, g]) for g in groups[:2]] if len(groups) > 1 else []


def _one_foot_each(
    markers: Markers, group: Int[np.ndarray, " markers"], side_of: Mapping[str, str]
) -> list[Int[np.ndarray, " markers"]]:
    """The same, or those of each side where both are in it; none where it is longer than a foot."""
    of_side = [group[[side_of.get(markers.names[k]) == side for k in group]] for side in ("r", "l")]
    if all(map(len, of_side)):
        return of_side
    flat = markers.positions_ground[:, group][:, :, [0, 2]]
    apart = [np.linalg.norm(flat[:, i] - flat[:, k], axis=1) for i in range(len(group)) for k in range(i)]
    lengths = [np.median(a[np.isfinite(a)]) for a in apart if np.isfinite(a).any()]
    return [group] if max(lengths, default=0.0) < FOOT_LENGTH_M else []


def _that_keep_their_distance(places: Float[np.ndarray, "frames markers 3"]) -> list[list[int]]:
    count = places.shape[1]
    group = list(range(count))
    for i in range(count):
        for j in range(i):
            apart = np.linalg.norm(places[:, i] - places[:, j], axis=1)
            apart = apart[np.isfinite(apart)]
            if len(apart) and apart.max() < FOOT_LENGTH_M and apart.std() < FOOT_RIGID_M:
                old, new = group[i], group[j]
                group = [new if g == old else g for g in group]
    return [[k for k in range(count) if group[k] == g] for g in sorted(set(group))]


def _foot(places: Float[np.ndarray, "frames markers 3"]) -> PressingFoot:
    above = places[:, :, 1] - np.nanpercentile(places[:, :, 1], 2, axis=0)
    bears = np.exp(-np.clip(np.nan_to_num(above, nan=1.0), -PRESSING_M, 1.0) / PRESSING_M)
    bears = np.where(np.isfinite(above), bears, 0.0)
    total = bears.sum(axis=1)
    flat = np.nan_to_num(places[:, :, [0, 2]])
    with np.errstate(invalid="ignore", divide="ignore"):
        middle = (bears[:, :, None] * flat).sum(axis=1) / total[:, None]
    middle[total <= 0] = np.nan
    lift = np.min(np.where(np.isfinite(above), above, np.inf), axis=1)
    return PressingFoot(middle, np.where(np.isfinite(lift), lift, np.nan))


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


def turns_by_path(trials: Sequence[Measured]) -> dict[str, dict[Turn, float]]:
    """By plate, how much better its pressures go with the foot under each turn than as they are [nats].

    The best of them is held to what refutes, and the others keep their distance from it, down to as much
    against them: beside the balance, which has the same pressures in its moments, this is to decide between
    turns and what else may be wrong with a plate, and not alone.
    """
    most, found = REFUTING_NATS, {}
    for k, stances in _all_stances(trials).items():
        errors, _ = _errors(stances)
        gains = {name: _worth() * (errors[AS_IT_IS] - error) for name, error in errors.items()}
        over = max(0.0, max(gains.values()) - most)
        found[f"plate_{k + 1}"] = {
            turn_of(TURNS[name]): max(-most, gain - over) for name, gain in gains.items()
        }
    return found


def _all_stances(trials: Sequence[Measured]) -> dict[int, list[_Stance]]:
    """By plate, counted from 0, of all trials that loaded it."""
    count = max((len(t.capture.plates) for t in trials), default=0)
    feet = [pressing_feet(t.capture.markers) for t in trials]
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


def _worth() -> float:
    """Of a square metre [nats]."""
    return PATH_WORTH / (2 * PATH_SCATTER_M**2)


def _of_plate(trial: Measured, number: int, stances: Sequence[_Stance]) -> Statement:
    errors, shifts = _errors(stances)
    worth = _worth()
    best = min(errors, key=lambda name: errors[name])
    others = min(error for name, error in errors.items() if name != AS_IT_IS)
    turned = float(np.clip(worth * (errors[AS_IT_IS] - others), -MOST_NATS, MOST_NATS))
    off = float(np.linalg.norm(shifts[AS_IT_IS]))
    std = PATH_SCATTER_M / np.sqrt(PATH_WORTH * len(stances))
    place = nats_of(off, std, PLACE_SCATTER_M, PLACE_USUAL_M, axes=2)
    scatter = np.sqrt(errors[AS_IT_IS] / len(stances))
    words = f"{100 * off:.0f} cm off the foot on average, scattering by {100 * scatter:.0f} cm"
    if turned > STATED_NATS:
        rest = np.sqrt(errors[best] / len(stances))
        words += f"; {best} it would scatter by {100 * rest:.0f} cm"
    stood = "stance" if len(stances) == 1 else "stances"
    return Statement(
        PATH,
        f"plate {number}: its pressure is {words} ({len(stances)} {stood}; normal: up to 7 cm off, "
        "scattering by 5).",
        {About.PLATE_TURN: turned, About.PLATE_PLACE: place},
        {"off_m": off, "off_x_m": float(-shifts[AS_IT_IS][0]), "off_z_m": float(-shifts[AS_IT_IS][1])}
        | {"scatter_m": float(scatter), "std_m": float(std)},
        target=f"plate_{number}",
    )


def _stances(trial: Measured, k: int, feet: Sequence[PressingFoot]) -> list[_Stance]:
    """Of plate k, each with the foot that bears it."""
    centres = [_pressed_points(trial, plate) for plate in trial.capture.plates]
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


def _pressed_points(trial: Measured, plate: ForcePlate) -> Float[np.ndarray, "frames 2"]:
    """Centre of pressure at the markers' frames; NaN where little presses [m]."""
    times = trial.capture.markers.times
    nearest = np.round((times - plate.start_time) * plate.rate).astype(int)
    inside = (nearest >= 0) & (nearest < plate.samples)
    nearest = nearest.clip(0, plate.samples - 1)
    force, centre = plate.force_ground[nearest, 1], plate.cop_ground[nearest][:, [0, 2]]
    with np.errstate(invalid="ignore"):
        least = max(5 * CONTACT_N, LOADED_SHARE * np.nanmax(force, initial=0.0))
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


LEAST_SHIFT_N = 10.0  # root mean square of what goes to and fro
STILL_M = 0.02  # by which a standing foot's middle moves, in all


def standing(trials: Sequence[Measured]) -> list[Statement]:
    """Each plate of each trial on which one foot stands still for long enough."""
    said = []
    for trial in trials:
        feet = pressing_feet(trial.capture.markers)
        for k, plate in enumerate(trial.capture.plates, start=1):
            found = _standing_on(trial, k, plate, feet)
            if found is not None:
                said.append(found)
    return said


def _standing_on(
    trial: Measured, k: int, plate: ForcePlate, feet: Sequence[PressingFoot]
) -> Statement | None:
    times = trial.capture.markers.times
    vertical = trial.vertical_N[:, k - 1]
    with np.errstate(invalid="ignore"):
        loaded = np.abs(vertical) > CONTACT_N
    stretches = [r for r in runs(loaded) if (r[1] - r[0]) / trial.rate >= STANDING_S]
    if not stretches or not feet:
        return None
    start, end = max(stretches, key=lambda r: r[1] - r[0])
    height = float(surface_of(plate).point_ground[1])
    wrench = _at_frames(plate, times[start:end])
    force, moment = wrench[:, :3], wrench[:, 3:]
    moment = moment - np.cross([0.0, height, 0.0], force)
    found = _point(force, moment, (end - start) / trial.rate)
    if found is None:
        return None
    point, std = found
    mean = np.array([moment[:, 2].mean(), -moment[:, 0].mean()]) / force[:, 1].mean()
    middles = [f.middle[start:end] for f in feet]
    middle = min(middles, key=lambda m: _away(m, np.broadcast_to(point, m.shape)))
    if not (np.ptp(middle, axis=0).max() < STILL_M and all(_seen(f, start, end) for f in feet)):
        return None  # it may bear the foot that moves, or is not seen
    foot = middle.mean(axis=0)
    off, constant = float(np.linalg.norm(point - foot)), float(np.linalg.norm(mean - point))
    return Statement(
        STANDING,
        f"The load on {plate.name} changes about a point {100 * off:.0f} ± {200 * std:.0f} cm from the "
        f"foot's middle, and its mean pressure lies {100 * constant:.0f} cm from there (normal: within 8).",
        {
            About.PLATE_PLACE: nats_of(off, std, STANDING_SCATTER_M, PLACE_USUAL_M),
            About.PLATE_ZERO: nats_of(constant, std, STANDING_SCATTER_M, PLACE_USUAL_M),
        },
        {"off_m": off, "constant_off_m": constant, "std_m": std},
        trial=trial.capture.name,
        target=f"plate_{k}",
    )


def _at_frames(plate: ForcePlate, times: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 6"]:
    both = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    known = np.isfinite(both).all(axis=1)
    return np.stack([np.interp(times, plate.times[known], column[known]) for column in both.T], axis=1)


def _point(
    force: Float[np.ndarray, "frames 3"], moment: Float[np.ndarray, "frames 3"], seconds: float
) -> tuple[Float[np.ndarray, "2"], float] | None:
    """Where the load changes, in x and z, and how well that is known [m]."""
    change = force[:, 1] - force[:, 1].mean()
    if change.std() < LEAST_SHIFT_N:
        return None
    point, rests = [], []
    for along in (moment[:, 2], -moment[:, 0]):
        rest = along - along.mean()
        slope = float(change @ rest / (change @ change))
        point.append(slope)
        rests.append(float((rest - slope * change).std()))
    independent = max(2.0, 2 * seconds)
    return np.array(point), float(np.linalg.norm(rests) / (change.std() * np.sqrt(independent)))
