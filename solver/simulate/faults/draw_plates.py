"""Effects of force plates, drawn: which plate, which sign, which direction."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver.capture.capture import Capture
from solver.simulate.faults import plates
from solver.simulate.faults.drawing import Change, Hide, NoPlaceError, direction, sign
from solver.simulate.faults.files import Recording
from solver.simulate.faults.hidden import REFERENCE_SIZE, Hidden

LOADED_FRAMES = 0.25  # of a trial that a plate must bear for it to be the one that is wrong
STANCE_SAMPLES = 9  # a swinging foot passes the standing one, but not for long


def _plate_gain(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    k = _plate(recording, rng)
    gain = sign(rng) * size * REFERENCE_SIZE["plate_gain"]
    changed = _with_plate(recording, k, lambda p: plates.gained(p, gain))
    return changed, _on_plate("plate_gain", k, {"gain_error": gain}, size)


def _plate_bias(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    k = _plate(recording, rng)
    bias = size * REFERENCE_SIZE["plate_bias"] * direction(rng)
    while_unloaded = bool(rng.random() < 0.5)
    changed = _with_plate(recording, k, lambda p: plates.biased(p, bias, while_unloaded))
    named = {f"bias_{axis}_N": float(b) for axis, b in zip("xyz", bias, strict=True)}
    note = "also while unloaded" if while_unloaded else "only while loaded"
    return changed, replace(_on_plate("plate_bias", k, named, size), note=note)


def _plate_position(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    k = _plate(recording, rng)
    angle = rng.uniform(0, 2 * np.pi)
    shift = size * REFERENCE_SIZE["plate_position"] * np.array([np.cos(angle), 0.0, np.sin(angle)])
    changed = _with_plate(recording, k, lambda p: plates.moved(p, shift))
    return changed, _on_plate(
        "plate_position", k, {"shift_x_m": float(shift[0]), "shift_z_m": float(shift[2])}, size
    )


def _plate_yaw(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    k = _plate(recording, rng)
    yaw = sign(rng) * size * REFERENCE_SIZE["plate_yaw"]
    changed = _with_plate(recording, k, lambda p: plates.turned(p, yaw))
    return changed, _on_plate("plate_yaw", k, {"yaw_deg": yaw}, size)


def _plate_swap(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    used = _used_plates(recording)
    if len(used) < 2:
        raise NoPlaceError("one plate only")
    a, b = sorted(rng.choice(used, 2, replace=False).tolist())
    trials = []
    for trial in recording.trials:
        row = list(trial.plates)
        row[a], row[b] = plates.exchanged(row[a], row[b])
        trials.append(replace(trial, plates=tuple(row)))
    return replace(recording, trials=tuple(trials)), Hidden(
        "plate_swap", f"plate_{a + 1}+plate_{b + 1}", {}, same_as=(f"plate_{b + 1}+plate_{a + 1}",)
    )


def _axis_convention(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    axes = str(rng.choice(["x", "z", "xz"]))
    changed = _with_plates(recording, lambda p: plates.misread_axes(p, axes))
    return changed, Hidden("axis_convention", axes, {}, same_as=(axes[::-1],))


def _gravity_tilt(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    angle = rng.uniform(0, 2 * np.pi)
    x, z = size * REFERENCE_SIZE["gravity_tilt"] * np.array([np.cos(angle), np.sin(angle)])
    changed = _with_plates(recording, lambda p: plates.tilted(p, x, z))
    return changed, Hidden("gravity_tilt", "all", {"tilt_x_deg": float(x), "tilt_z_deg": float(z)}, size)


def _off_plate_step(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    places = [
        (i, k, stance)
        for i, trial in enumerate(recording.trials)
        for k, plate in enumerate(trial.plates)
        for stance in plates.stances(plate)
    ]
    if not places:
        raise NoPlaceError("no whole stance")
    i, k, stance = places[int(rng.integers(len(places)))]
    trial = recording.trials[i]
    plate = trial.plates[k]
    foot = _foot_on(recording, trial, k, stance)
    blank = slice(stance.start - round(0.05 * plate.rate), stance.stop + round(0.05 * plate.rate))
    blank = slice(max(blank.start, 0), blank.stop)
    row = list(trial.plates)
    row[k] = plates.blanked(plate, blank)
    rate = trial.markers.rate
    times = plate.times[[stance.start, stance.stop - 1]] - trial.markers.start_time
    frames = (int(np.ceil(times[0] * rate)), int(np.floor(times[1] * rate)) + 1)
    changed = recording.with_trial(replace(trial, plates=tuple(row)))
    return changed, Hidden(
        "off_plate_step",
        f"plate_{k + 1}",
        {},
        trial=trial.name,
        frames=(frames,),
        same_as=(foot,) if foot else recording.foot_bodies,
    )


PLATES: dict[str, Hide] = {
    "plate_gain": _plate_gain,
    "plate_bias": _plate_bias,
    "plate_position": _plate_position,
    "plate_yaw": _plate_yaw,
    "plate_swap": _plate_swap,
    "axis_convention": _axis_convention,
    "gravity_tilt": _gravity_tilt,
    "off_plate_step": _off_plate_step,
}


def _used_plates(recording: Recording) -> list[int]:
    """Plates that bear someone for a good part of some trial; the most loaded one if none does."""
    share = [
        max(float(plates.loaded(t.plates[k]).mean()) for t in recording.trials if k < len(t.plates))
        for k in range(max(len(t.plates) for t in recording.trials))
    ]
    used = [k for k, s in enumerate(share) if s >= LOADED_FRAMES]
    return used or [k for k, s in enumerate(share) if s > 0.05]


def _plate(recording: Recording, rng: np.random.Generator) -> int:
    used = _used_plates(recording)
    if not used:
        raise NoPlaceError("no loaded plate")
    return int(rng.choice(used))


def _on_plate(id: str, k: int, parameters: dict[str, float], size: float) -> Hidden:
    return Hidden(id, f"plate_{k + 1}", parameters, size)


def _with_plate(recording: Recording, k: int, change: Callable) -> Recording:
    trials = tuple(
        replace(t, plates=tuple(change(p) if i == k else p for i, p in enumerate(t.plates)))
        for t in recording.trials
    )
    return replace(recording, trials=trials)


def _with_plates(recording: Recording, change: Callable) -> Recording:
    trials = tuple(replace(t, plates=tuple(change(p) for p in t.plates)) for t in recording.trials)
    return replace(recording, trials=trials)


def _foot_on(recording: Recording, trial: Capture, k: int, stance: slice) -> str | None:
    """The foot body whose markers are nearest to the centre of pressure, all of them and all stance."""
    plate, markers = trial.plates[k], trial.markers
    samples = np.linspace(stance.start, stance.stop - 1, STANCE_SAMPLES).round().astype(int)
    frames = np.round((plate.times[samples] - markers.start_time) * markers.rate).astype(int)
    frames = np.clip(frames, 0, markers.frames - 1)
    away: dict[str, float] = {}
    for foot in recording.foot_bodies:
        own = [markers.names.index(n) for n, b in recording.marker_bodies.items() if b == foot]
        if own:
            arms = markers.positions_ground[frames][:, own] - plate.cop_ground[samples, None]
            away[foot] = float(np.nanmean(np.linalg.norm(arms, axis=2)))
    return min(away, key=lambda foot: away[foot]) if away else None
