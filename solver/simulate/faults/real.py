"""Effects put into real recordings, whose motion cannot be made anew: each beside the recording as it is.

The recorded ground reaction is changed by what the ground would have had to supply besides: minus the
external wrench, shared by the loaded plates in proportion to their load, with the centres of pressure moved
alike. A support, a contact and a carried mass can be put in this way while a plate is loaded throughout; belt
acceleration, segment masses and wobbling masses need the body's own inertia and cannot.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.signal import butter, filtfilt

from solver.capture.capture import Capture
from solver.simulate.faults import recorded
from solver.simulate.faults.cases import write_truth
from solver.simulate.faults.drawing import MEASUREMENT, Change, NoPlaceError, hide_measurement, segments
from solver.simulate.faults.hidden import (
    REFERENCE_SIZE,
    UNSIZED,
    Hidden,
    Recording,
    Truth,
    read_recording,
    write_recording,
)
from solver.simulate.faults.recorded import registered
from solver.simulate.loads import eased
from solver.skeleton.forward import cross

# Recordings whose plates bear all steps for at least a cycle; folder, trial.
SOUND = (
    ("walk_gait2354_subject01", "walk1"),
    ("walk_treadmill_stepwidth", "example1"),
    ("run_treadmill_hamner2013_subject04", "run400"),
    ("opencap_subject4", "squats1"),
    ("opencap_subject4", "walking1"),
    ("opencap_subject6", "walking1"),
    ("exo_apo_gordon", "NE21"),
)
NEEDS_WEIGHT = (
    "plate_gain",
    "body_weight_support",
    "carried_mass",
)  # otherwise it is build
TRIES = 8
GRAVITY = np.array([0.0, -9.80665, 0.0])  # [m/s²]
PATH_CUTOFF_Hz = 6.0  # of a segment's path, whose second derivative is wanted
HEAVIEST_SHIFT_M = 0.08  # that a centre of pressure may move
SEATED = ("pelvis", "torso")


def hide_emulated(recording: Recording, id: str, size: float, rng: np.random.Generator) -> Change:
    """Put a physical effect into the first trial.

    Raises:
        NoPlaceError: somebody is in the air, or no segment has markers enough.
    """
    return EMULATED[id](recording, size, rng)


def with_external(
    capture: Capture, force: Float[np.ndarray, "samples 3"], point: Float[np.ndarray, "samples 3"]
) -> Capture:
    """What the plates would have read had this force acted on the person, and the person moved the same.

    Args:
        capture: with plates of one clock.
        force: on the person [N], at the plates' samples.
        point: where it acts [m].

    Raises:
        NoPlaceError: no plate is loaded while it acts, or the centre of pressure would leave the feet.
    """
    first = capture.plates[0]
    if any(p.samples != first.samples or p.start_time != first.start_time for p in capture.plates):
        raise NoPlaceError("plates of different clocks")
    on = np.stack([recorded.loaded(p) for p in capture.plates], axis=1)
    load = np.where(on, np.stack([p.force_ground[:, 1] for p in capture.plates], axis=1), 0.0)
    total = load.sum(axis=1)
    acting = np.abs(force).max(axis=1) > 0
    if (total[acting] < 0.3 * np.median(total[total > 0])).any():
        raise NoPlaceError("nobody on the plates while it acts")
    share = np.divide(load, total[:, None], out=np.zeros_like(load), where=total[:, None] > 0)

    more = -force
    moment = -cross(point, force)
    old = sum(
        np.where(on[:, k, None], p.cop_ground, 0) * share[:, k, None] for k, p in enumerate(capture.plates)
    )
    vertical = np.where(total > 0, total + more[:, 1], 1.0)
    # the added force is put at the old resultant's point; the shift d of all centres takes up its moment
    excess = moment - cross(old, more)
    d = np.stack([excess[:, 2], np.zeros(len(total)), -excess[:, 0]], axis=1) / vertical[:, None]
    if np.abs(d[acting]).max(initial=0) > HEAVIEST_SHIFT_M:
        raise NoPlaceError("the centre of pressure would leave the feet")
    changed = []
    spent = np.zeros((len(total), 3))
    for k, p in enumerate(capture.plates):
        new_force = p.force_ground + share[:, k, None] * more
        cop = np.where(on[:, k, None], p.cop_ground + d, p.cop_ground)
        changed.append(recorded.rebuilt(p, new_force, cop, recorded.free_moment(p)))
        spent += changed[-1].moment_ground - p.moment_ground
    left = (moment - spent)[:, 1]
    final = []
    for k, p in enumerate(changed):
        free = recorded.free_moment(p)
        free[:, 1] += share[:, k] * left
        final.append(recorded.rebuilt(p, p.force_ground, p.cop_ground, free))
    return replace(capture, plates=tuple(final))


def _support(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    trial, body, path = _path(recording, rng)
    newtons = size * REFERENCE_SIZE["body_weight_support"]
    point = path(trial.plates[0].times)
    force = np.tile([0.0, newtons, 0.0], (len(point), 1))
    hidden = Hidden("body_weight_support", body, {"force_N": newtons}, size, trial.name)
    return recording.with_trial(with_external(trial, force, point)), hidden


def _contact(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    trial, body, path = _path(recording, rng)
    markers = trial.markers
    duration = markers.frames / markers.rate
    length = rng.uniform(0.3, 0.6) * duration
    since = markers.start_time + rng.uniform(0.1, 0.9) * (duration - length)
    direction = rng.standard_normal(3)
    newtons = size * REFERENCE_SIZE["external_contact"] * direction / np.linalg.norm(direction)
    law = eased(newtons, since, since + length, min(0.2, length / 3))
    times = trial.plates[0].times
    point = path(times)
    force = law(times, point, point)
    frames = np.flatnonzero((markers.times >= since) & (markers.times <= since + length))
    mean = law(markers.times[frames], point, point).mean(axis=0)
    parameters = {f"force_{axis}_N": float(f) for axis, f in zip("xyz", mean, strict=True)}
    hidden = Hidden(
        "external_contact", body, parameters, size, trial.name, ((int(frames[0]), int(frames[-1]) + 1),)
    )
    return recording.with_trial(with_external(trial, force, point)), hidden


def _carried(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    trial, body, path = _path(recording, rng)
    kilograms = size * REFERENCE_SIZE["carried_mass"]
    times = trial.plates[0].times
    force = -kilograms * (path(times, 2) - GRAVITY)
    hidden = Hidden(
        "carried_mass", body, {"mass_kg": kilograms}, size, trial.name, ((0, trial.markers.frames),)
    )
    return recording.with_trial(with_external(trial, force, path(times))), hidden


def _path(recording: Recording, rng: np.random.Generator) -> tuple[Capture, str, CubicSpline]:
    """A trial, a segment, and where the middle of its markers goes."""
    trial = recording.trials[0]
    groups = segments(recording, trial)
    bodies = [body for body in SEATED if body in groups]
    if not bodies:
        raise NoPlaceError("neither pelvis nor torso has three markers")
    body = str(rng.choice(bodies))
    _, centroid = registered(trial.markers, groups[body])
    b, a = butter(2, PATH_CUTOFF_Hz, fs=trial.markers.rate)
    return trial, body, CubicSpline(trial.markers.times, filtfilt(b, a, centroid, axis=0))


EMULATED: dict[str, Callable[[Recording, float, np.random.Generator], Change]] = {
    "body_weight_support": _support,
    "external_contact": _contact,
    "carried_mass": _carried,
}
IDS = (*MEASUREMENT, *EMULATED)


@dataclass(frozen=True)
class RealCase:
    """One effect in one recording."""

    name: str
    folder: str
    trial: str
    id: str
    size: float
    seed: int

    @property
    def counterpart(self) -> str:
        """Name of the same recording without the effect."""
        return f"{self.folder}__{self.trial}"


def plan_real(seed: int, cases: int, sizes: tuple[float, ...], ids: tuple[str, ...] = IDS) -> list[RealCase]:
    """Recordings and ids in turn, sizes drawn."""
    rng = np.random.default_rng(seed)
    places, effects = _round(len(SOUND), rng), _round(len(ids), rng)
    plans = []
    for n in range(cases):
        folder, trial = SOUND[next(places)]
        id = ids[next(effects)]
        size = 1.0 if id in UNSIZED else float(rng.choice(sizes))
        plans.append(RealCase(f"real_{n:04d}", folder, trial, id, size, int(rng.integers(2**31))))
    return plans


def hidden_in(recording: Recording, case: RealCase) -> tuple[Recording, Hidden]:
    """The recording with the effect.

    Raises:
        NoPlaceError: this recording has no place for it.
    """
    if case.id in NEEDS_WEIGHT and recording.mass_kg is None:
        raise NoPlaceError("no mass entered")
    rng = np.random.default_rng(case.seed)
    reason = NoPlaceError(case.id)
    for _ in range(TRIES):
        try:
            if case.id in MEASUREMENT:
                return hide_measurement(recording, case.id, case.size, rng)
            return hide_emulated(recording, case.id, case.size, rng)
        except NoPlaceError as why:
            reason = why
    raise reason


def write_real(out: Path, data: Path, case: RealCase) -> bool:
    """Write the case and, once, its counterpart; False where the recording has no place for the effect."""
    if (out / "truth" / f"{case.name}.json").exists():
        return True
    recording = read_recording(data / case.folder, (case.trial,))
    try:
        changed, hidden = hidden_in(recording, case)
    except NoPlaceError:
        return False
    counterpart = out / "subjects" / case.counterpart
    if not counterpart.exists():
        write_recording(counterpart, recording)
        write_truth(out, Truth(case.counterpart, "real", (), {"recording": case.folder}))
    write_recording(out / "subjects" / case.name, changed)
    write_truth(
        out,
        Truth(
            case.name, "real", (hidden,), {"recording": case.folder, "trial": case.trial}, case.counterpart
        ),
    )
    return True


def _round(count: int, rng: np.random.Generator) -> Iterator[int]:
    while True:
        yield from rng.permutation(count).tolist()
