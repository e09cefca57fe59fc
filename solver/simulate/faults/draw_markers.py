"""Effects of markers, drawn: which one, when, how far."""

from dataclasses import replace

import numpy as np

from solver.simulate.faults import marker_effects
from solver.simulate.faults.drawing import (
    Change,
    Hide,
    NoPlaceError,
    direction,
    one_trial,
    segments,
    sign,
)
from solver.simulate.faults.files import Recording
from solver.simulate.faults.hidden import REFERENCE_SIZE, Hidden

# Segments whose soft tissue moves, and the neighbour whose angle it follows.
NEIGHBOUR = {
    "femur_r": "tibia_r",
    "femur_l": "tibia_l",
    "tibia_r": "femur_r",
    "tibia_l": "femur_l",
    "humerus_r": "torso",
    "humerus_l": "torso",
}


def _marker_slip(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    trial = one_trial(recording, rng)
    groups = segments(recording, trial)
    name = str(rng.choice([n for names in groups.values() for n in names]))
    group = next(names for names in groups.values() if name in names)
    R, _ = marker_effects.registered(trial.markers, group)
    length = trial.markers.frames / trial.markers.rate
    time = float(rng.uniform(0.25, 0.7) * length)
    shift_ground = size * REFERENCE_SIZE["marker_slip"] * direction(rng)
    changed = marker_effects.slipped(trial.markers, name, shift_ground, time, R)
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
    changed = marker_effects.swapped(trial.markers, one, other, first, first + length)
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
    trials = tuple(replace(t, markers=marker_effects.rescaled(t.markers, scale)) for t in recording.trials)
    static = marker_effects.rescaled(recording.static, scale) if recording.static else None
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
        R, R_next = (marker_effects.registered(t.markers, groups[b])[0] for b in (body, neighbour))
        moved = marker_effects.soft(
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
