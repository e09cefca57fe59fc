"""Faults of one plate: its zero, scale, sign and place, what stands on it, and which steps it hears."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.faults.editor.recording import (
    STANCE_S,
    Edit,
    Fault,
    NoPlaceError,
    Plate,
    Recording,
    Trial,
    drawn_plate,
    stretches,
)

GRAVITY = 9.80665  # [m/s²]
POUND_N = 4.4482216


def everywhere(change: Callable[[Plate, Recording, int], Plate], what: str, **size: float) -> Edit:
    """The same change of one plate in all trials."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        k = drawn_plate(recording, rng)
        trials = tuple(t.with_plate(k, change(t.plates[k], recording, k)) for t in recording.trials)
        return replace(recording, trials=trials), _of(recording, k, what, size)

    return edit


def gain(factor: float) -> Edit:
    """Force and moment times a factor."""
    return everywhere(
        lambda p, r, k: replace(p, force=factor * p.force, moment=factor * p.moment),
        f"a plate reads {factor:.3g} times what is true",
        gain=factor,
    )


def pounds() -> Edit:
    """Pounds taken for newtons."""
    return everywhere(
        lambda p, r, k: replace(p, force=p.force / POUND_N, moment=p.moment / POUND_N),
        "a plate's pounds were taken for newtons",
        gain=1 / POUND_N,
    )


def sign() -> Edit:
    """The force on the plate in place of that on the person."""
    return everywhere(
        lambda p, r, k: replace(p, force=-p.force, moment=-p.moment), "a plate's sign is turned", gain=-1.0
    )


def zero_level(force_N: tuple[float, float, float]) -> Edit:
    """A constant force in the plate's middle, whether or not somebody stands on it."""
    return everywhere(
        lambda p, r, k: with_force(p, np.array(force_N), _centre(r, k)),
        f"a plate's zero level is off by {force_N[0]:.0f}, {force_N[1]:.0f}, {force_N[2]:.0f} N",
        force_x_N=force_N[0],
        force_y_N=force_N[1],
        force_z_N=force_N[2],
    )


def tared_under_load(weight_N: float, aside_m: float) -> Edit:
    """Zeroed while something of that weight stood on it, some way from the middle."""

    def change(plate: Plate, recording: Recording, k: int) -> Plate:
        place = _centre(recording, k) + np.array([aside_m, 0.0, 0.5 * aside_m])
        return with_force(plate, np.array([0.0, -weight_N, 0.0]), place)

    what = f"a plate was tared while {weight_N:.0f} N stood on it"
    return everywhere(change, what, force_x_N=0.0, force_y_N=-weight_N, force_z_N=0.0)


def turned(degrees: float) -> Edit:
    """Force, moment and pressure turned about the vertical through the plate's middle."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return everywhere(
        lambda p, r, k: moved(p, R, 1.0, _centre(r, k), np.zeros(3)),
        f"a plate is turned by {degrees:.0f}° about the vertical",
        yaw_deg=degrees,
    )


def mirrored(axis: int) -> Edit:
    """One horizontal axis of the plate points the other way: corners listed the wrong way round."""
    M = np.eye(3)
    M[axis, axis] = -1.0
    return everywhere(
        lambda p, r, k: moved(p, M, -1.0, _centre(r, k), np.zeros(3)),
        f"a plate's {'xyz'[axis]} is mirrored",
        mirrored_axis=float(axis),
    )


def shifted(metres: float, degrees: float) -> Edit:
    """The plate's place in the laboratory is off."""
    shift = metres * np.array([np.cos(np.radians(degrees)), 0.0, np.sin(np.radians(degrees))])
    return everywhere(
        lambda p, r, k: moved(p, np.eye(3), 1.0, _centre(r, k), shift),
        f"a plate's place is off by {100 * metres:.0f} cm",
        shift_x_m=float(shift[0]),
        shift_z_m=float(shift[2]),
    )


def exchanged() -> Edit:
    """The cables of two plates are exchanged: each force appears at the other's place in its own plate."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        if len(recording.trials[0].plates) != 2:
            raise NoPlaceError("not two plates")
        apart = _centre(recording, 1) - _centre(recording, 0)
        trials = []
        for trial in recording.trials:
            one, two = trial.plates
            here = moved(two, np.eye(3), 1.0, np.zeros(3), -apart)
            there = moved(one, np.eye(3), 1.0, np.zeros(3), apart)
            trials.append(replace(trial, plates=(here, there)))
        names = tuple(t.name for t in recording.trials)
        return replace(recording, trials=tuple(trials)), Fault("two plates are exchanged", {}, names)

    return edit


def lost_step() -> Edit:
    """One stance beside the plate: it reads nothing all the while."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trial = recording.trials[0]
        stances = [
            (k, first, end)
            for k, plate in enumerate(trial.plates)
            for first, end in stretches(plate.loaded)
            if STANCE_S < (end - first) / trial.force_rate < 0.6 * (trial.times[-1] - trial.times[0])
        ]
        if not stances:
            raise NoPlaceError("no single stance")
        k, first, end = stances[int(rng.integers(len(stances)))]
        plate = trial.plates[k]
        force, moment = plate.force.copy(), plate.moment.copy()
        force[first:end] = moment[first:end] = 0.0
        changed = trial.with_plate(k, replace(plate, force=force, moment=moment))
        times = (float(trial.force_times[first]), float(trial.force_times[end - 1]))
        fault = Fault("one step is not on any plate", {}, (trial.name,), plate=k + 1, times_s=times)
        return recording.with_trial(0, changed), fault

    return edit


def standing_object(mass_kg: float, aside_m: float) -> Edit:
    """Something stands on a plate, beside the foot, all through the last trial."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        k, last = drawn_plate(recording, rng), len(recording.trials) - 1
        trial = recording.trials[last]
        place = _centre(recording, k) + np.array([0.0, 0.0, aside_m])
        changed = with_force(trial.plates[k], np.array([0.0, mass_kg * GRAVITY, 0.0]), place)
        what = f"{mass_kg:.1f} kg stand on a plate in the trial '{trial.name}'"
        fault = Fault(what, {"mass_kg": mass_kg}, (trial.name,), plate=k + 1)
        return recording.with_trial(last, trial.with_plate(k, changed)), fault

    return edit


def with_force(plate: Plate, force: np.ndarray, place: np.ndarray) -> Plate:
    """A constant force at a place, added to what the plate reads."""
    return replace(plate, force=plate.force + force, moment=plate.moment + np.cross(place, force))


def moved(plate: Plate, R: np.ndarray, hand: float, centre: np.ndarray, shift: np.ndarray) -> Plate:
    """Turned or mirrored about a centre, then shifted.

    Args:
        plate: as it is.
        R: of the turn or the mirror.
        hand: 1, or -1 for a mirror, which turns a moment the other way round.
        centre: through which the axis goes [m].
        shift: [m].
    """
    force = plate.force @ R.T
    moment = hand * (plate.moment - np.cross(centre, plate.force)) @ R.T
    return replace(plate, force=force, moment=moment + np.cross(centre + shift, force))


def _centre(recording: Recording, k: int) -> np.ndarray:
    """Of the plate over all trials [m]."""
    return np.mean([t.plates[k].centre for t in recording.trials if t.plates[k].loaded.any()], axis=0)


def _of(recording: Recording, k: int, what: str, size: dict[str, float]) -> Fault:
    return Fault(f"plate {k + 1}: {what}", dict(size), tuple(t.name for t in recording.trials), plate=k + 1)


def loads_of(trial: Trial) -> np.ndarray:
    """Vertical force of all plates together (samples,) [N]."""
    return np.sum([plate.force[:, 1] for plate in trial.plates], axis=0)
