"""Edits beside those of one plate: clocks, markers, what was entered, forces unseen, and harmless ones."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import butter, decimate, filtfilt

from benchmarks.faults.editor.plates import loads_of
from benchmarks.faults.editor.recording import Edit, Fault, NoPlaceError, Plate, Recording, Trial, drawn_plate

ABOVE_PELVIS = re.compile(  # labels of trunk, arms and head, of all sources
    r"acro|[lr]acr$|biceps|clav|c7|t10|bak$|ster|strn|shou|sho$|elb|[lm]el$|forearm|fa[rsu]|[ul]a\d|wris|wr[ab]$|fin$|hd$|head",
    re.IGNORECASE,
)


def late(lags_s: Sequence[float]) -> Edit:
    """recorded(t) = true(t - lag), a lag for each trial or one for all; markers are cut to what is left."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        lags = list(lags_s) * len(recording.trials) if len(lags_s) == 1 else list(lags_s)
        trials = tuple(_late(trial, lag) for trial, lag in zip(recording.trials, lags, strict=True))
        sizes = {f"offset_s {t.name}": lag for t, lag in zip(trials, lags, strict=True)}
        what = "forces are late by " + " and ".join(f"{1e3 * lag:.0f} ms" for lag in lags)
        return replace(recording, trials=trials), Fault(what, sizes, tuple(t.name for t in trials))

    return edit


def one_plate_late(lag_s: float) -> Edit:
    """One plate's amplifier is late, the others are not."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        k = drawn_plate(recording, rng)
        trials = []
        for trial in recording.trials:
            samples = round(lag_s * trial.force_rate)
            plate = trial.plates[k]
            shifted = [np.concatenate([np.repeat(v[:1], samples, 0), v])[: len(v)] for v in _of(plate)]
            changed = trial.with_plate(k, replace(plate, force=shifted[0], moment=shifted[1]))
            trials.append(changed.cut(trial.force_times[0] + lag_s, trial.times[-1]))
        what = f"plate {k + 1} is late by {1e3 * lag_s:.0f} ms"
        names = tuple(t.name for t in trials)
        return replace(recording, trials=tuple(trials)), Fault(what, {"offset_s": lag_s}, names, plate=k + 1)

    return edit


def drifting(stretch: float) -> Edit:
    """Time of the forces = (1 + stretch) × true time, both beginning together."""

    def change(trial: Trial) -> Trial:
        start = trial.force_times[0]
        changed = replace(trial, force_times=start + (1 + stretch) * (trial.force_times - start))
        return changed.cut(start, min(trial.times[-1], changed.force_times[-1]))

    return _all(change, f"the forces' clock runs {100 * stretch:+.1f} % slow", stretch=stretch)


def smoothed(cutoff_Hz: float) -> Edit:
    """All forces and moments low-passed, second order forwards and backwards."""

    def change(trial: Trial) -> Trial:
        # each pass at a cutoff that makes both together 3 dB there
        passes = cutoff_Hz / (np.sqrt(2) - 1) ** 0.25
        b, a = butter(2, passes / (trial.force_rate / 2))
        return trial.with_wrenches(lambda values: filtfilt(b, a, values, axis=0))

    return _all(change, f"forces were low-passed at {cutoff_Hz:.1f} Hz", cutoff_Hz=cutoff_Hz)


def _late(trial: Trial, lag_s: float) -> Trial:
    changed = replace(trial, force_times=trial.force_times + lag_s)
    start = max(trial.times[0], changed.force_times[0])
    return changed.cut(start, min(trial.times[-1], changed.force_times[-1]))


def _of(plate: Plate) -> tuple[np.ndarray, np.ndarray]:
    return plate.force, plate.moment


RIGID_M = 0.006  # markers of one segment keep their distance to so much (standard deviation)
NEAR_M = 0.30
FAR_M = 0.04  # nearer ones say nothing of a direction
COMPANIONS = 3


def slipped(metres: float) -> Edit:
    """From a moment in the middle third on, one marker sits elsewhere on its segment."""
    return _moved(metres, lambda m, near: [m], "marker {} slips by {:.0f} mm")


def carried_by_cloth(metres: float) -> Edit:
    """From a moment on all markers of a segment sit elsewhere, together."""
    return _moved(metres, lambda m, near: [m, *near], "cloth carries {} along by {:.0f} mm")


def _moved(metres: float, which: Callable[[int, list[int]], list[int]], what: str) -> Edit:
    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trial = recording.trials[0]
        m, near = _of_a_segment(trial, rng)
        first = round(len(trial.times) * rng.uniform(0.35, 0.6))
        moved, positions = which(m, near), trial.positions.copy()
        positions[first:, moved] += _carried(trial, near, rng, metres)[first:, None]
        names = tuple(trial.labels[k] for k in moved)
        times = (float(trial.times[first]), float(trial.times[-1]))
        told = what.format(", ".join(names), 1e3 * metres)
        fault = Fault(told, {"shift_m": metres}, (trial.name,), markers=names, times_s=times)
        return recording.with_trial(0, replace(trial, positions=positions)), fault

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


PELVIS = ("asi", "psi", "sacr")  # parts of markers' names, in small letters


def somebody_elses_mass(factor: float) -> Edit:
    """The mass that was entered is another person's."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        if recording.mass_kg is None:
            raise NoPlaceError("no mass entered")
        entered = round(factor * recording.mass_kg, 1)
        what = f"{entered} kg were entered in place of {recording.mass_kg} kg"
        fault = Fault(what, {"mass_factor": 1 / factor}, tuple(t.name for t in recording.trials))
        return replace(recording, mass_kg=entered), fault

    return edit


def supported(share: float) -> Edit:
    """A harness at the pelvis carries a share of the weight all along, straight up; the plates feel less.

    Force and moment: what the ground gives is what the motion asks for less what the harness gives *at the
    pelvis*. Taken off at the pressures instead, the force would act there, as a lighter body's weight does.
    """

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        if recording.mass_kg is None:
            raise NoPlaceError("no mass entered")
        lift_N = share * recording.mass_kg * 9.80665
        trials = []
        for trial in recording.trials:
            if loads_of(trial).min() < 1.5 * lift_N:
                raise NoPlaceError("there is flight: the harness would pull the feet off")
            lift = np.tile([0.0, lift_N, 0.0], (len(trial.force_times), 1))
            trials.append(felt(trial, pelvis(trial), lift))
        names = tuple(t.name for t in trials)
        fault = Fault(f"a harness carries {lift_N:.0f} N", {"force_N": lift_N}, names)
        return replace(recording, trials=tuple(trials)), fault

    return edit


def pelvis(trial: Trial) -> np.ndarray:
    """Its markers' middle at the forces' times (samples, 3) [m]."""
    of_it = [k for k, label in enumerate(trial.labels) if any(part in label.lower() for part in PELVIS)]
    if not of_it:
        raise NoPlaceError("no marker is named after the pelvis")
    middle = trial.positions[:, of_it].mean(axis=1)
    seen = np.isfinite(middle).all(axis=1)
    return np.stack([np.interp(trial.force_times, trial.times[seen], x) for x in middle[seen].T], axis=1)


def felt(trial: Trial, at: np.ndarray, pull: np.ndarray) -> Trial:
    """What the ground gives less: the pull and its moment, on each plate by its share of the load.

    Args:
        trial: as it was recorded.
        at: where the pull acts, one row a sample of the forces [m].
        pull: on the person, likewise [N].
    """
    total = np.maximum(loads_of(trial), 1.0)
    plates = []
    for plate in trial.plates:
        share = (plate.force[:, 1] / total * (total > 100.0))[:, None]
        moment = plate.moment - share * np.cross(at, pull)
        plates.append(replace(plate, force=plate.force - share * pull, moment=moment))
    return replace(trial, plates=tuple(plates))


def axes_turned(degrees: float, east_m: float, south_m: float) -> Edit:
    """Everything turned about the vertical and moved, markers and plates alike."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    shift = np.array([east_m, 0.0, south_m])

    def change(trial: Trial) -> Trial:
        plates = []
        for plate in trial.plates:
            force = plate.force @ R.T
            plates.append(replace(plate, force=force, moment=plate.moment @ R.T + np.cross(shift, force)))
        return replace(trial, positions=trial.positions @ R.T + shift, plates=tuple(plates))

    return _all(change, f"nothing: the laboratory's axes turned by {degrees:.0f}° and moved")


def fewer_force_samples(least_Hz: float = 300.0) -> Edit:
    """Every second sample of the forces, as long as enough are left."""

    def change(trial: Trial) -> Trial:
        if trial.force_rate / 2 < least_Hz:
            raise NoPlaceError("forces are slow as they are")
        halved = trial.with_wrenches(lambda values: decimate(values, 2, axis=0))
        return replace(halved, force_times=trial.force_times[::2])

    return _all(change, "nothing: forces at half the rate")


def part(first: float, last: float) -> Edit:
    """From one share of the time to another."""

    def change(trial: Trial) -> Trial:
        start, end = trial.times[0], trial.times[-1]
        return trial.cut(start + first * (end - start), start + last * (end - start))

    return _all(change, f"nothing: from {100 * first:.0f} to {100 * last:.0f} % of the trial")


def lower_body(recording: Recording) -> Recording:
    """As laboratories hand over that mark pelvis and legs alone, without a static trial."""

    def bared(trial: Trial) -> Trial:
        kept = [k for k, label in enumerate(trial.labels) if not ABOVE_PELVIS.search(label)]
        labels = tuple(trial.labels[k] for k in kept)
        return replace(trial, labels=labels, positions=trial.positions[:, kept])

    return replace(recording, trials=tuple(bared(t) for t in recording.trials), static=None)


def as_it_is() -> Edit:
    """Nothing."""
    return _all(lambda trial: trial, "nothing")


def _all(change: Callable[[Trial], Trial], what: str, **size: float) -> Edit:
    """The same change of all trials; without a size it is none that anybody has to find."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trials = tuple(change(trial) for trial in recording.trials)
        fault = Fault(what, size, tuple(trial.name for trial in trials) if size else ())
        return replace(recording, trials=trials), fault

    return edit
