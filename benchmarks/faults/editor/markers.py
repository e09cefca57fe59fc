"""Faults in the markers: one that slips, two exchanged, all of a segment carried along by cloth."""

from dataclasses import replace

import numpy as np

from benchmarks.faults.editor.fault import Edit, Fault, NoPlaceError
from benchmarks.faults.editor.recording import Recording, Trial

RIGID_M = 0.006  # markers of one segment keep their distance to so much (standard deviation)
NEAR_M = 0.30
FAR_M = 0.04  # nearer ones say nothing of a direction
COMPANIONS = 3


def slipped(metres: float) -> Edit:
    """From a moment in the middle third on, one marker sits elsewhere on its segment."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trial = recording.trials[0]
        m, near = _of_a_segment(trial, rng)
        first = round(len(trial.times) * rng.uniform(0.35, 0.6))
        positions = trial.positions.copy()
        positions[first:, m] += _carried(trial, near, rng, metres)[first:]
        changed = replace(trial, positions=positions)
        what = f"marker {trial.labels[m]} slips by {1e3 * metres:.0f} mm"
        fault = Fault(what, {"shift_m": metres}, (trial.name,), markers=(trial.labels[m],))
        times = (float(trial.times[first]), float(trial.times[-1]))
        return recording.with_trial(0, changed), replace(fault, times_s=times)

    return edit


def labels_exchanged(seconds: float) -> Edit:
    """Two neighbours have each other's labels for a while."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trial = recording.trials[0]
        m, near = _of_a_segment(trial, rng)
        other = near[0]
        length = round(seconds * trial.rate)
        first = round((len(trial.times) - length) * rng.uniform(0.3, 0.7))
        positions = trial.positions.copy()
        both = slice(first, first + length)
        positions[both, m], positions[both, other] = trial.positions[both, other], trial.positions[both, m]
        names = (trial.labels[m], trial.labels[other])
        times = (float(trial.times[first]), float(trial.times[first + length - 1]))
        what = f"markers {names[0]} and {names[1]} have each other's labels for {seconds:.1f} s"
        fault = Fault(what, {"seconds": seconds}, (trial.name,), markers=names, times_s=times)
        return recording.with_trial(0, replace(trial, positions=positions)), fault

    return edit


def carried_by_cloth(metres: float) -> Edit:
    """From a moment on all markers of a segment sit elsewhere, together."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trial = recording.trials[0]
        m, near = _of_a_segment(trial, rng)
        first = round(len(trial.times) * rng.uniform(0.35, 0.6))
        positions = trial.positions.copy()
        moved = [m, *near]
        shift = _carried(trial, near, rng, metres)
        positions[first:, moved] += shift[first:, None]
        names = tuple(trial.labels[k] for k in moved)
        what = f"cloth carries {', '.join(names)} along by {1e3 * metres:.0f} mm"
        times = (float(trial.times[first]), float(trial.times[-1]))
        fault = Fault(what, {"shift_m": metres}, (trial.name,), markers=names, times_s=times)
        return recording.with_trial(0, replace(trial, positions=positions)), fault

    return edit


def _of_a_segment(trial: Trial, rng: np.random.Generator) -> tuple[int, list[int]]:
    """A marker and the three that keep their distance to it best."""
    places = trial.positions
    seen = np.isfinite(places).all(axis=(0, 2))
    found = []
    for m in np.flatnonzero(seen):
        distance = np.linalg.norm(places - places[:, m : m + 1], axis=2)
        mean, scatter = distance.mean(axis=0), distance.std(axis=0)
        fit = seen & (mean > FAR_M) & (mean < NEAR_M) & (scatter < RIGID_M)
        near = [int(k) for k in np.argsort(scatter) if fit[k]][:COMPANIONS]
        if len(near) == COMPANIONS and _spread(places[0, near]) > FAR_M:
            found.append((int(m), near))
    if not found:
        raise NoPlaceError("no segment with four markers")
    return found[int(rng.integers(len(found)))]


def _spread(three: np.ndarray) -> float:
    """How far three points are from lying on a line [m]."""
    return float(np.linalg.svd(three - three.mean(axis=0), compute_uv=False)[1])


def _carried(trial: Trial, three: list[int], rng: np.random.Generator, metres: float) -> np.ndarray:
    """An offset that is constant in the frame of three markers (frames, 3) [m]."""
    a, b, c = (trial.positions[:, k] for k in three)
    x = _unit(b - a)
    z = _unit(np.cross(x, c - a))
    R = np.stack([x, np.cross(z, x), z], axis=2)
    direction = rng.normal(size=3)
    return R @ (metres * direction / np.linalg.norm(direction))


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=1, keepdims=True)
