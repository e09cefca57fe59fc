"""Effects of measurement, drawn: the clock, the plates, the markers, and what was written down."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver.capture.capture import Capture
from solver.simulate.faults import recorded
from solver.simulate.faults.hidden import REFERENCE_SIZE, Hidden, Recording
from solver.simulate.faults.recorded import FEWEST_MARKERS
from solver.simulate.faults.worlds import GENERIC
from solver.simulate.other_masses import with_segment_masses

Change = tuple[Recording, Hidden]
Hide = Callable[[Recording, float, np.random.Generator], Change]
LOADED_FRAMES = 0.25  # of a trial that a plate must bear for it to be the one that is wrong
STANCE_SAMPLES = 9  # a swinging foot passes the standing one, but not for long
# Segments whose soft tissue moves, and the neighbour whose angle it follows.
NEIGHBOUR = {
    "femur_r": "tibia_r",
    "femur_l": "tibia_l",
    "tibia_r": "femur_r",
    "tibia_l": "femur_l",
    "humerus_r": "torso",
    "humerus_l": "torso",
}


class NoPlaceError(Exception):
    """The recording has nothing that this effect could change."""


def sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def direction(rng: np.random.Generator) -> np.ndarray:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def one_trial(recording: Recording, rng: np.random.Generator) -> Capture:
    return recording.trials[int(rng.integers(len(recording.trials)))]


def segments(recording: Recording, trial: Capture) -> dict[str, list[str]]:
    """Segments with markers enough to make a frame, and these markers."""
    groups: dict[str, list[str]] = {}
    for name in trial.markers.names:
        if name in recording.marker_bodies:
            groups.setdefault(recording.marker_bodies[name], []).append(name)
    return {body: names for body, names in groups.items() if len(names) >= FEWEST_MARKERS}


def _plate_gain(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    k = _plate(recording, rng)
    gain = sign(rng) * size * REFERENCE_SIZE["plate_gain"]
    changed = _with_plate(recording, k, lambda p: recorded.change_gain(p, gain))
    return changed, _on_plate("plate_gain", k, {"gain_error": gain}, size)


def _plate_bias(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    k = _plate(recording, rng)
    bias = size * REFERENCE_SIZE["plate_bias"] * direction(rng)
    while_unloaded = bool(rng.random() < 0.5)
    changed = _with_plate(recording, k, lambda p: recorded.add_bias(p, bias, while_unloaded))
    named = {f"bias_{axis}_N": float(b) for axis, b in zip("xyz", bias, strict=True)}
    note = "also while unloaded" if while_unloaded else "only while loaded"
    return changed, replace(_on_plate("plate_bias", k, named, size), note=note)


def _plate_position(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    k = _plate(recording, rng)
    angle = rng.uniform(0, 2 * np.pi)
    shift = size * REFERENCE_SIZE["plate_position"] * np.array([np.cos(angle), 0.0, np.sin(angle)])
    changed = _with_plate(recording, k, lambda p: recorded.shift_plate(p, shift))
    return changed, _on_plate(
        "plate_position", k, {"shift_x_m": float(shift[0]), "shift_z_m": float(shift[2])}, size
    )


def _plate_yaw(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    k = _plate(recording, rng)
    yaw = sign(rng) * size * REFERENCE_SIZE["plate_yaw"]
    changed = _with_plate(recording, k, lambda p: recorded.turn_plate(p, yaw))
    return changed, _on_plate("plate_yaw", k, {"yaw_deg": yaw}, size)


def _plate_swap(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    used = _used_plates(recording)
    if len(used) < 2:
        raise NoPlaceError("one plate only")
    a, b = sorted(rng.choice(used, 2, replace=False).tolist())
    trials = []
    for trial in recording.trials:
        row = list(trial.plates)
        row[a], row[b] = recorded.exchange_readings(row[a], row[b])
        trials.append(replace(trial, plates=tuple(row)))
    return replace(recording, trials=tuple(trials)), Hidden(
        "plate_swap", f"plate_{a + 1}+plate_{b + 1}", {}, same_as=(f"plate_{b + 1}+plate_{a + 1}",)
    )


def _axis_convention(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    axes = str(rng.choice(["x", "z", "xz"]))
    changed = _with_plate(recording, None, lambda p: recorded.misread_axes(p, axes))
    return changed, Hidden("axis_convention", axes, {}, same_as=(axes[::-1],))


def _gravity_tilt(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    angle = rng.uniform(0, 2 * np.pi)
    x, z = size * REFERENCE_SIZE["gravity_tilt"] * np.array([np.cos(angle), np.sin(angle)])
    changed = _with_plate(recording, None, lambda p: recorded.tilt_plate(p, x, z))
    return changed, Hidden("gravity_tilt", "all", {"tilt_x_deg": float(x), "tilt_z_deg": float(z)}, size)


def _off_plate_step(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    places = [
        (i, k, stance)
        for i, trial in enumerate(recording.trials)
        for k, plate in enumerate(trial.plates)
        for stance in recorded.stances(plate)
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
    row[k] = recorded.blank_samples(plate, blank)
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
        max(float(recorded.loaded(t.plates[k]).mean()) for t in recording.trials if k < len(t.plates))
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


def _with_plate(recording: Recording, k: int | None, change: Callable) -> Recording:
    """With one plate changed in every trial; None: all plates."""
    trials = tuple(
        replace(t, plates=tuple(change(p) if k in (None, i) else p for i, p in enumerate(t.plates)))
        for t in recording.trials
    )
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


def _marker_slip(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    trial = one_trial(recording, rng)
    groups = segments(recording, trial)
    name = str(rng.choice([n for names in groups.values() for n in names]))
    group = next(names for names in groups.values() if name in names)
    R, _ = recorded.follow_markers(trial.markers, group)
    length = trial.markers.frames / trial.markers.rate
    time = float(rng.uniform(0.25, 0.7) * length)
    shift_ground = size * REFERENCE_SIZE["marker_slip"] * direction(rng)
    changed = recorded.slip_marker(trial.markers, name, shift_ground, time, R)
    parameters = {"shift_m": float(np.linalg.norm(shift_ground)), "time_s": time}
    frames = ((int(np.ceil(time * trial.markers.rate)), trial.markers.frames),)
    hidden = Hidden("marker_slip", name, parameters, size, trial.name, frames)
    return recording.with_trial(replace(trial, markers=changed)), hidden


def _marker_swap(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    trial = one_trial(recording, rng)
    names = sorted(n for group in segments(recording, trial).values() for n in group)
    columns = [trial.markers.names.index(n) for n in names]
    points = trial.markers.positions_ground[:, columns]
    gaps = np.nanmedian(np.linalg.norm(points[:, :, None] - points[:, None], axis=3), axis=0)
    near = [
        (a, b)
        for a in range(len(names))
        for b in range(a + 1, len(names))
        if REFERENCE_SIZE["marker_swap"] <= gaps[a, b] <= 3 * REFERENCE_SIZE["marker_swap"]
    ]
    if not near:
        raise NoPlaceError("no two markers near each other")
    a, b = near[int(rng.integers(len(near)))]
    one, other = names[a], names[b]
    frames = trial.markers.frames
    length = int(rng.uniform(0.15, 0.4) * frames)
    first = int(rng.integers(int(0.1 * frames), frames - length - int(0.1 * frames)))
    changed = recorded.swap_markers(trial.markers, one, other, first, first + length)
    hidden = Hidden(
        "marker_swap",
        f"{one}+{other}",
        {},
        float(gaps[a, b] / REFERENCE_SIZE["marker_swap"]),
        trial.name,
        ((first, first + length),),
        same_as=(f"{other}+{one}",),
    )
    return recording.with_trial(replace(trial, markers=changed)), hidden


def _capture_scale(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    scale = 1 + sign(rng) * size * REFERENCE_SIZE["capture_scale"]
    trials = tuple(replace(t, markers=recorded.scale_markers(t.markers, scale)) for t in recording.trials)
    static = recorded.scale_markers(recording.static, scale) if recording.static else None
    return replace(recording, trials=trials, static=static), Hidden(
        "capture_scale", "all", {"scale": scale}, size
    )


def _soft_tissue(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    trial = one_trial(recording, rng)
    groups = segments(recording, trial)
    joined = [(b, n) for b, n in NEIGHBOUR.items() if b in groups and n in groups]
    if not joined:
        raise NoPlaceError("no two neighbouring segments with three markers each")
    body, neighbour = joined[int(rng.integers(len(joined)))]
    follows = rng.standard_normal((3, 3))
    rms = size * REFERENCE_SIZE["soft_tissue"]
    changed = recording
    for t in recording.trials:
        if not {body, neighbour} <= set(segments(recording, t)):
            continue
        R, R_next = (recorded.follow_markers(t.markers, groups[b])[0] for b in (body, neighbour))
        moved = recorded.soft(
            t.markers, groups[body], R_ground=R, R_next=R_next, direction=follows, rms_m=rms
        )
        changed = changed.with_trial(replace(t, markers=moved))
    return changed, Hidden("soft_tissue", body, {"rms_m": rms}, size)


MARKERS: dict[str, Hide] = {
    "marker_slip": _marker_slip,
    "marker_swap": _marker_swap,
    "capture_scale": _capture_scale,
    "soft_tissue": _soft_tissue,
}


def hide_measurement(recording: Recording, id: str, size: float, rng: np.random.Generator) -> Change:
    """Put one effect into every trial that it concerns.

    Args:
        recording: true.
        id: of the catalogue.
        size: in reference sizes.
        rng: draws target, sign and direction.

    Raises:
        NoPlaceError: nothing to change.
    """
    return MEASUREMENT[id](recording, size, rng)


def _clock_offset(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    offset = sign(rng) * size * REFERENCE_SIZE["clock_offset"]
    rate = recording.trials[0].plates[0].rate
    if rate >= 500:  # whole samples need no interpolation
        offset = round(offset * rate) / rate
    trials = tuple(recorded.delay(t, offset) for t in recording.trials)
    return replace(recording, trials=trials), Hidden("clock_offset", "all", {"offset_s": offset}, size)


def _sample_rate(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    stretch = sign(rng) * size * REFERENCE_SIZE["sample_rate"]
    trials = tuple(recorded.stretch_time(t, stretch) for t in recording.trials)
    return replace(recording, trials=trials), Hidden("sample_rate", "all", {"stretch": stretch}, size)


def _filter(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    # Its square, or twice the size would leave nothing of a walk.
    cutoff = float(REFERENCE_SIZE["filter_mismatch"] / np.sqrt(size))
    trials = tuple(recorded.low_passed(t, cutoff) for t in recording.trials)
    return replace(recording, trials=trials), Hidden("filter_mismatch", "all", {"cutoff_Hz": cutoff}, size)


CLOCKS: dict[str, Hide] = {
    "clock_offset": _clock_offset,
    "sample_rate": _sample_rate,
    "filter_mismatch": _filter,
}


def _subject_mass(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    if recording.mass_kg is None:
        raise NoPlaceError("no mass entered")
    factor = 1 + sign(rng) * size * REFERENCE_SIZE["subject_mass"]
    model = recording.model
    if model and model.name != GENERIC:
        model = with_segment_masses(model, dict.fromkeys(model.body_names, 1 / factor))
    changed = replace(recording, mass_kg=recording.mass_kg / factor, model=model)
    return changed, Hidden("subject_mass", "all", {"mass_factor": factor}, size)


MEASUREMENT: dict[str, Hide] = {**CLOCKS, **PLATES, "subject_mass": _subject_mass, **MARKERS}
