"""A C3D file with markers, force plates, events and model outputs, written by ezc3d.

As laboratories keep them: millimetres, z up ((x, y, z) of the ground frame becomes (x, −z, y)), force
platforms of type 2 that read the force on the person, real numbers of four bytes. The first frame is 1.
Source: The C3D File Format User Guide (Motion Lab Systems 2008).
"""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import ezc3d
import numpy as np
from jaxtyping import Float

from solver.capture.atomic import made_folder, whole_file
from solver.capture.capture import FootEvent, ForcePlate, Markers
from solver.capture.formats.analog_channels import AnalogChannels, analog_or_why_not
from solver.capture.formats.text_table import unique_names
from solver.capture.plates.force_platform import plate_axes
from solver.capture.resampling import bridge_gaps, resample
from solver.capture.subject.measured_files import MARK
from solver.common.errors import CaptureError
from solver.common.true_runs import runs
from solver.export.export_places import trial_stems
from solver.export.gait_tables import gaits_of
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.seen_part import without_guesses
from solver.gait.gait_events import Kind, side_of
from solver.gait.trial_gait import Gait
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

R_LAB_GROUND = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
MM = 1000.0  # per metre
SAME_RATE = 1e-6  # relative: samples of a plate keep step with the markers' frames
SAME_SAMPLE = 0.01  # of a sample: the plate's clock and the markers' begin together
ROOM_M = 0.05  # around the centres of pressure of a plate whose corners nobody knows
LEAST_HALF_SIDE_M = 0.2  # of such a plate
SEEN, UNSEEN = 0.0, -1.0  # residuals
ICONS = {"Foot Strike": 1, "Foot Off": 2}
DESCRIPTIONS = {
    "Foot Strike": "The instant the heel strikes the ground",
    "Foot Off": "The instant the toe leaves the ground",
}  # Vicon's, which other programs look for
FORCE_CHANNELS = ("force x", "force y", "force z", "moment x", "moment y", "moment z")
MOST, LONGEST = 255, 127  # entries of a parameter, bytes of a text
WORD = 65536  # the header counts frames in 16 bits
NMM = 1000.0  # per N·m


@dataclass(frozen=True)
class ModelOutput:
    """Something computed, as a point whose three values are no place."""

    label: str
    group: Literal["ANGLES", "MOMENTS", "POWERS", "FORCES", "SCALARS"]  # of POINT, where it is listed
    unit: str  # one for all of a group
    values: Float[np.ndarray, "frames 3"]
    description: str


@dataclass(frozen=True)
class C3dRecording:
    """What goes into a file: ground frame, y up, forces on the person."""

    markers: Markers
    plates: tuple[ForcePlate, ...] = ()
    events: tuple[FootEvent, ...] = ()
    outputs: tuple[ModelOutput, ...] = ()
    subject: str = ""
    mass_kg: float | None = None
    height_m: float | None = None
    analog: AnalogChannels | None = None


def write_c3d(path: Path, recording: C3dRecording) -> tuple[str, ...]:
    """Write a C3D file, whole or not at all.

    Args:
        path: where it belongs.
        recording: outputs have a row for each of the markers' frames.

    Returns:
        What of the recording the file could not take as it was.

    Raises:
        CaptureError: the file cannot be written.
    """
    c3d = ezc3d.c3d()
    notes = (*_add_points(c3d, recording), *_add_analog(c3d, recording))
    notes = (*notes, *_add_events(c3d, recording))
    _add_about(c3d, recording)
    frames = recording.markers.frames
    if frames >= WORD:
        notes = (f"{frames} frames: programs that trust the header's 16 bits read the first 65535", *notes)
    if recording.markers.start_time:
        notes = (
            f"frame 1 is at {recording.markers.start_time:g} s of the recording; in a C3D file it is at 0 s",
            *notes,
        )
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "written.c3d"
        try:
            c3d.write(str(draft))
            content = draft.read_bytes()
        except (RuntimeError, OSError, ValueError) as error:
            raise CaptureError(f"{path}: cannot be written as C3D ({error}).") from error
    with whole_file(path) as file:
        file.write(content)
    return tuple(f"{path.name}: {note}" for note in notes)


def _add_points(c3d: Any, recording: C3dRecording) -> tuple[str, ...]:
    markers, outputs = recording.markers, recording.outputs
    places = MM * markers.positions_ground @ R_LAB_GROUND.T
    values = np.concatenate([places, *(output.values[:, None] for output in outputs)], axis=1)
    known = np.isfinite(values).all(axis=2)
    stored = np.ones((4, values.shape[1], values.shape[0]))
    stored[:3] = np.where(known[..., None], values, 0.0).transpose(2, 1, 0)
    point = c3d["parameters"]["POINT"]
    point["RATE"]["value"] = [markers.rate]
    point["UNITS"]["value"] = ["mm"]
    labels = _labels([*markers.names, *(output.label for output in outputs)])
    point["LABELS"]["value"] = list(labels.values())
    point["DESCRIPTIONS"]["value"] = [*("" for _ in markers.names), *(_short(o.description) for o in outputs)]
    c3d["data"]["points"] = stored
    c3d["data"]["meta_points"]["residuals"] = np.where(known, SEEN, UNSEEN).T[None]
    c3d["data"]["meta_points"]["camera_masks"] = np.zeros((7, *known.T.shape), dtype=bool)
    c3d.add_parameter("POINT", "X_SCREEN", ["+X"])
    c3d.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    for group in dict.fromkeys(output.group for output in outputs):
        members = [output for output in outputs if output.group == group]
        c3d.add_parameter("POINT", group, [labels[output.label] for output in members])
        c3d.add_parameter("POINT", f"{group.removesuffix('S')}_UNITS", [members[0].unit])
    frames = markers.frames
    _add_integers(c3d, "TRIAL", "ACTUAL_START_FIELD", [1, 0])
    _add_integers(c3d, "TRIAL", "ACTUAL_END_FIELD", [frames % WORD, frames // WORD])
    return tuple(f"marker {name} is called {labels[name]}" for name in markers.names if labels[name] != name)


def _add_analog(c3d: Any, recording: C3dRecording) -> tuple[str, ...]:
    """The plates' channels, and behind them the others, at one rate."""
    markers, plates, analog = recording.markers, recording.plates, recording.analog
    rates = [plate.rate for plate in plates] + ([] if analog is None else [analog.rate])
    if not rates:
        return ()
    per_frame = max(int(np.ceil(rate / markers.rate * (1 - SAME_RATE))) for rate in rates)
    rate = per_frame * markers.rate
    times = markers.start_time + np.arange(markers.frames * per_frame) / rate
    channels, corners, notes = [], [], []
    for plate in plates:
        place, place_notes = _corners(plate)
        measured = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
        signals = AnalogChannels((), (), measured, plate.rate, plate.start_time)
        wrench, wrench_notes = _at(plate.name, signals, times, rate)
        R_plate_ground = plate_axes(place).T
        force, moment = wrench[:, :3], wrench[:, 3:] - np.cross(place.mean(axis=0), wrench[:, :3])
        channels += [force @ R_plate_ground.T, MM * moment @ R_plate_ground.T]
        corners.append(MM * R_LAB_GROUND @ place.T)
        notes += [*place_notes, *wrench_notes]
    names = [f"{kind}{axis}{k + 1}" for k in range(len(plates)) for kind in "FM" for axis in "xyz"]
    described = [_short(f"{plate.name}: {name}") for plate in plates for name in FORCE_CHANNELS]
    units = [unit for _ in plates for unit in ("N", "N", "N", "Nmm", "Nmm", "Nmm")]
    if analog is not None:
        values, value_notes = _at("analog channels", analog, times, rate)
        shorter = [_short(name, LONGEST - 5) for name in analog.names]
        labels = unique_names([*names, *shorter])[0][len(names) :]
        changed = ((a, b) for a, b in zip(analog.names, labels, strict=True) if a != b)
        notes += [*value_notes, *(f"analog channel {name} is called {label}" for name, label in changed)]
        channels.append(values)
        names, units = [*names, *labels], [*units, *map(_short, analog.units)]
        described += [""] * len(labels)
    c3d["parameters"]["ANALOG"]["RATE"]["value"] = [rate]
    for name, entries, kind in (
        ("LABELS", names, ezc3d.ezc3d.CHAR),
        ("DESCRIPTIONS", described, ezc3d.ezc3d.CHAR),
        ("UNITS", units, ezc3d.ezc3d.CHAR),
        ("SCALE", [1.0] * len(names), ezc3d.ezc3d.FLOAT),
        ("OFFSET", [0] * len(names), ezc3d.ezc3d.INT),
    ):
        for part in range(0, len(names), MOST):
            numbered = f"{name}{part // MOST + 1}" if part else name
            c3d.add_parameter("ANALOG", numbered, entries[part : part + MOST])
            c3d["parameters"]["ANALOG"][numbered]["type"] = kind
    if len(names) > MOST:
        notes.append(
            f"{len(names)} channels: those beyond {MOST} stand in ANALOG:LABELS2 and on, which few programs "
            f"read, and the first {MOST} have no unit"
        )
    c3d["data"]["analogs"] = np.hstack(channels).T[None]
    if not plates:
        return tuple(notes)
    platform = c3d["parameters"]["FORCE_PLATFORM"]
    platform["USED"]["value"] = [len(plates)]
    platform["TYPE"]["value"] = [2] * len(plates)
    platform["ZERO"]["value"] = [0, 0]  # levels are as they are
    platform["CORNERS"]["value"] = np.stack(corners, axis=2)
    platform["ORIGIN"]["value"] = np.zeros((3, len(plates)))
    platform["CHANNEL"]["value"] = np.arange(1, 6 * len(plates) + 1).reshape(-1, 6).T
    return tuple(notes)


def _corners(plate: ForcePlate) -> tuple[Float[np.ndarray, "4 3"], tuple[str, ...]]:
    """The plate's corners [m], ground frame; around its centres of pressure where nobody knows them."""
    if plate.corners_ground is not None and np.isfinite(plate.corners_ground).all():
        return plate.corners_ground, ()
    pressed = plate.cop_ground[np.isfinite(plate.cop_ground).all(axis=1)]
    middle, half = np.zeros(3), np.full(3, LEAST_HALF_SIDE_M)
    if len(pressed):
        low, high = pressed.min(axis=0) - ROOM_M, pressed.max(axis=0) + ROOM_M
        middle, half = (low + high) / 2, np.maximum((high - low) / 2, LEAST_HALF_SIDE_M)
        middle[1] = np.median(pressed[:, 1])
    # in the order of the quadrants of a plate's axes of which z points down
    corners = np.array([middle + half * [x, 0.0, z] for x, z in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    note = (
        f"{plate.name}: its corners are not known; a rectangle around its centres of pressure stands for it"
    )
    return corners, (note,)


def _at(
    what: str, signals: AnalogChannels, times: Float[np.ndarray, " samples"], rate: float
) -> tuple[Float[np.ndarray, "samples channels"], tuple[str, ...]]:
    """Signals at the file's samples; zero where one of a plate's, or all of others, were not recorded."""
    notes = []
    first = (signals.start_time - times[0]) * rate
    in_step = abs(signals.rate / rate - 1) < SAME_RATE and abs(first - round(first)) < SAME_SAMPLE
    if in_step:
        values = _shifted(signals.values, round(first), len(times))
    else:
        values = _resampled(signals, times)
        notes.append(f"{what}: resampled from {signals.rate:g} to {rate:g} Hz, in step with the markers")
    known = np.isfinite(values)
    unknown = ~(known.any(axis=1) if signals.names else known.all(axis=1))
    if unknown.any():
        spans = [_span(float(times[start]), float(times[end - 1])) for start, end in runs(unknown)]
        listed = ", ".join(spans[:5]) + (f" and {len(spans) - 5} more" if len(spans) > 5 else "")
        notes.append(f"{what}: not recorded {listed}; the file has zeros there")
    outside = (signals.times < times[0] - 0.5 / rate) | (signals.times > times[-1] + 0.5 / rate)
    if outside.any():
        span = f"{outside.sum() / signals.rate:.3f} s"
        notes.append(f"{what}: {span} outside the markers' frames are lost; a C3D file has no place for them")
    return np.where(unknown[:, None], 0.0, values), tuple(notes)


def _span(first_s: float, last_s: float) -> str:
    return f"at {first_s:.3f} s" if first_s == last_s else f"from {first_s:.3f} to {last_s:.3f} s"


def _shifted(values: np.ndarray, first: int, count: int) -> np.ndarray:
    """Rows `first` and so on of a longer array are the values; NaN elsewhere."""
    shifted = np.full((count, values.shape[1]), np.nan)
    start, end = max(first, 0), min(first + len(values), count)
    if start < end:
        shifted[start:end] = values[start - first : end - first]
    return shifted


def _resampled(signals: AnalogChannels, times: Float[np.ndarray, " samples"]) -> np.ndarray:
    """At other times, NaN beside samples without a number."""
    recorded = signals.values
    known = np.isfinite(recorded).all(axis=1)
    filled = recorded
    if not known.all():
        if not known.any():
            return np.full((len(times), recorded.shape[1]), np.nan)
        filled = bridge_gaps(recorded, known)
    values = resample(filled, signals.rate, signals.start_time, times)
    nearest = np.clip(np.round((times - signals.start_time) * signals.rate).astype(int), 0, len(known) - 1)
    values[~known[nearest]] = np.nan
    return values


def _add_events(c3d: Any, recording: C3dRecording) -> tuple[str, ...]:
    """Events in order of time; a parameter holds 255, what is beyond goes into LABELS2 and so on."""
    events = sorted(recording.events, key=lambda event: event.time_s)
    _add_integers(c3d, "EVENT", "USED", [len(events)])
    for part in range(0, len(events), MOST):
        number = f"{part // MOST + 1}" if part else ""
        _add_some_events(c3d, recording, events[part : part + MOST], number)
    if len(events) <= MOST:
        return ()
    return (
        f"{len(events)} events: those beyond {MOST} stand in EVENT:LABELS2 and on, which few programs read",
    )


def _add_some_events(c3d: Any, recording: C3dRecording, events: Sequence[FootEvent], number: str) -> None:
    seconds = np.array([event.time_s for event in events]) - recording.markers.start_time
    texts: dict[str, Sequence[str]] = {
        "CONTEXTS": [event.side for event in events],
        "LABELS": [event.label for event in events],
        "DESCRIPTIONS": [DESCRIPTIONS[event.label] for event in events],
        "SUBJECTS": [_short(recording.subject)] * len(events),
    }
    for name, values in texts.items():
        c3d.add_parameter("EVENT", f"{name}{number}", list(values))
    c3d.add_parameter("EVENT", f"TIMES{number}", np.stack([seconds // 60, seconds % 60]))
    _add_integers(c3d, "EVENT", f"ICON_IDS{number}", [ICONS[event.label] for event in events])
    _add_integers(c3d, "EVENT", f"GENERIC_FLAGS{number}", [0] * len(events))


def _labels(names: Sequence[str]) -> dict[str, str]:
    """Names that a parameter can hold, no two alike."""
    labels: dict[str, str] = {}
    for name in names:
        label, number = _short(name), 2
        while label in labels.values():
            label, number = f"{_short(name, LONGEST - 5)}~{number}", number + 1
        labels[name] = label
    return labels


def _short(text: str, most: int = LONGEST) -> str:
    """A text that a parameter can hold: its length is one byte, which some readers take as signed."""
    return text.encode()[:most].decode(errors="ignore")


def _add_integers(c3d: Any, group: str, name: str, values: list[int]) -> None:
    """Ezc3d would store them as real numbers, which some readers take amiss."""
    c3d.add_parameter(group, name, values)
    c3d["parameters"][group][name]["type"] = ezc3d.ezc3d.INT


def _add_about(c3d: Any, recording: C3dRecording) -> None:
    c3d.add_parameter("MANUFACTURER", "SOFTWARE", ["addb-viewer"])
    c3d.add_parameter("MANUFACTURER", "EDITED", [MARK])
    _add_integers(c3d, "SUBJECTS", "USED", [1])
    c3d.add_parameter("SUBJECTS", "NAMES", [_short(recording.subject)])
    for name, value in (("BODYMASS", recording.mass_kg), ("HEIGHT", recording.height_m)):
        if value is not None and np.isfinite(value):
            scaled = value * (MM if name == "HEIGHT" else 1.0)
            c3d.add_parameter("PROCESSING", name, [scaled])


@dataclass(frozen=True)
class _Kind:
    """What belongs to the coordinates of one kind of motion, and how it is listed."""

    group: Literal["ANGLES", "MOMENTS", "POWERS", "FORCES", "SCALARS"]
    motion: Literal["rotation", "translation"]
    unit: str
    suffix: str


ANGLES, TRANSLATIONS = (
    _Kind("ANGLES", "rotation", "deg", "angles"),
    _Kind("SCALARS", "translation", "m", "translations"),
)


MOMENTS, FORCES = (
    _Kind("MOMENTS", "rotation", "Nmm", "moments"),
    _Kind("FORCES", "translation", "N", "forces"),
)


POWERS = _Kind("POWERS", "rotation", "W", "powers")


def export_c3d(fit: Fit, folder: Path) -> tuple[list[Path], tuple[str, ...]]:
    """Write TRIAL.c3d for every trial.

    Returns:
        The files written, and what they could not take as it was recorded.

    Raises:
        CaptureError: the folder cannot be made, or not written to.
    """
    written: list[Path] = []
    notes: list[str] = []
    stems, gaits = trial_stems(fit), gaits_of(fit)
    for trial in fit.trials:
        name = trial.capture.name
        analog, why_not = analog_or_why_not(trial.capture.files)
        notes += (f"{name}: {why}" for why in why_not)
        recording = C3dRecording(
            markers=trial.capture.markers,
            plates=trial.capture.plates,
            events=foot_events(gaits[name]) if name in gaits else (),
            outputs=_outputs(trial, fit.skeleton),
            subject=fit.subject.name,
            mass_kg=fit.mass_kg,
            height_m=fit.height_m,
            analog=analog,
        )
        path = made_folder(folder) / f"{stems[name]}.c3d"
        notes += write_c3d(path, recording)
        written.append(path)
    return written, tuple(notes)


def foot_events(gait: Gait) -> tuple[FootEvent, ...]:
    """Contacts and foot-offs by the names that C3D files give them."""
    return tuple(
        FootEvent(event.time_s, side_of(gait.feet[event.foot]), "Foot Strike" if contact else "Foot Off")
        for event in gait.events
        for contact in (event.kind is Kind.CONTACT,)
    )


def joint_outputs(
    skeleton: Skeleton, motion: Motion, torques: Float[np.ndarray, "frames dofs"] | None
) -> tuple[ModelOutput, ...]:
    """A point a joint and kind, its three values those of three coordinates in the order of the joint's axes.

    Args:
        skeleton: of the motion.
        motion: whose angles they are.
        torques: generalized forces; None: neither moments nor powers. The root's are the residual.
    """
    found = [*_points(skeleton, ANGLES, np.degrees(motion.q)), *_points(skeleton, TRANSLATIONS, motion.q)]
    if torques is not None:
        found += [*_points(skeleton, MOMENTS, NMM * torques), *_points(skeleton, FORCES, torques)]
        found += _points(skeleton, POWERS, torques * motion.velocity)
    return tuple(found)


def _outputs(trial: TrialFit, skeleton: Skeleton) -> tuple[ModelOutput, ...]:
    trial = without_guesses(trial)
    dynamics = trial.dynamics
    motion, torques = (dynamics.motion, dynamics.joint_torques) if dynamics else (trial.motion, None)
    points = joint_outputs(skeleton, motion, torques)
    return tuple(point for point in points if np.isfinite(point.values).all(axis=1).any())


def _points(
    skeleton: Skeleton, kind: _Kind, columns: Float[np.ndarray, "frames dofs"]
) -> Iterator[ModelOutput]:
    for joint, names in _coordinates(skeleton, kind.motion).items():
        for part in range(0, len(names), 3):
            three = names[part : part + 3]
            values = np.zeros((len(columns), 3))
            values[:, : len(three)] = columns[:, [skeleton.dofs.index(name) for name in three]]
            label = f"{joint}_{kind.suffix}" + (f"_{part // 3 + 1}" if part else "")
            described = ", ".join(f"{axis} {name}" for axis, name in zip("xyz", three, strict=False))
            yield ModelOutput(label, kind.group, kind.unit, values, described)


def _coordinates(skeleton: Skeleton, motion: str) -> dict[str, list[str]]:
    """By joint, its free coordinates of a kind in the order of its axes; each at the first joint it moves."""
    wanted = {c.name for c in skeleton.free_coordinates if c.motion == motion}
    found: dict[str, list[str]] = {}
    for joint in skeleton.joints:
        for axis in joint.axes:
            if axis.coordinate in wanted:
                wanted.discard(axis.coordinate)
                found.setdefault(joint.name, []).append(axis.coordinate)
    return found
