"""What was hidden, in the catalogue's own words, and the subject folder that holds it."""

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from solver.capture.capture import Capture, Markers, Subject
from solver.capture.formats.trc import write_trc
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_static, read_trial
from solver.simulate.subject_folder import write_forces
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.skeleton import Skeleton

REFERENCE_SIZE = {
    "clock_offset": 0.008,  # [s]
    "sample_rate": 0.01,
    "filter_mismatch": 6.0,  # [Hz]; smaller is worse
    "plate_gain": 0.04,
    "plate_bias": 15.0,  # [N]
    "plate_position": 0.012,  # [m]
    "plate_yaw": 3.0,  # [deg]
    "gravity_tilt": 1.5,  # [deg]
    "belt_slope": 5.0,  # [deg]
    "carried_mass": 3.0,  # [kg]
    "subject_mass": 0.04,
    "segment_mass": 0.15,
    "external_contact": 40.0,  # [N]
    "body_weight_support": 80.0,  # [N]
    "elastic_tether": 30.0,  # [N] mean
    "drag": 20.0,  # [N] mean
    "belt_acceleration": 0.3,  # [m/s²] RMS
    "wobbling_mass": 4.0,  # [kg]
    "marker_slip": 0.015,  # [m]
    "marker_swap": 0.05,  # [m] between the markers
    "capture_scale": 0.01,
    "soft_tissue": 0.010,  # [m] RMS
    "off_plate_step": 1.0,
    "plate_swap": 1.0,
    "axis_convention": 1.0,
}
UNSIZED = ("marker_swap", "off_plate_step", "plate_swap", "axis_convention")


@dataclass(frozen=True)
class Hidden:
    """One hidden effect.

    `same_as` lists targets that say the same thing (a plate and the foot that it bears). `bodies` is where an
    effect outside the catalogue acts; empty when its place cannot be told from outside (a pure torque).
    """

    id: str
    target: str
    parameters: dict[str, float]
    size: float = 1.0  # in reference sizes
    trial: str | None = None
    frames: tuple[tuple[int, int], ...] = ()
    same_as: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()
    note: str = ""

    def as_json(self) -> dict[str, Any]:
        """For truth.json."""
        return asdict(self)


@dataclass(frozen=True)
class Truth:
    """What a case holds; kept outside the folder that the finder sees."""

    case: str
    kind: str  # clean, single, pair or unknown
    effects: tuple[Hidden, ...]
    world: dict[str, Any] = field(default_factory=dict)
    baseline: str | None = None  # the folder of the same recording without the effect

    def as_json(self) -> dict[str, Any]:
        """For truth.json."""
        return asdict(self)


@dataclass(frozen=True)
class Recording:
    """Everything that a laboratory hands over about one person."""

    trials: tuple[Capture, ...]
    mass_kg: float | None
    height_m: float | None
    sex: str | None
    scale_kg: float | None = None  # read with all that is worn in the trials
    model: Skeleton | None = None  # to be written; None: copy `model_file`, or the default body
    model_file: Path | None = None
    static: Markers | None = None
    foot_bodies: tuple[str, ...] = ("calcn_r", "calcn_l")
    marker_bodies: dict[str, str] = field(default_factory=dict)  # marker: segment that wears it

    def with_trial(self, capture: Capture) -> "Recording":
        """The same with one trial replaced by name."""
        return replace(self, trials=tuple(capture if t.name == capture.name else t for t in self.trials))


def read_recording(folder: Path, only: tuple[str, ...] = ()) -> Recording:
    """Read a subject folder; `only` names the trials wanted (all if empty)."""
    subject: Subject = open_subject(folder)
    chosen = [files for files in subject.trials if not only or files.name in only]
    trials = tuple(_number_plates(read_trial(files)) for files in chosen)
    skeleton = load_skeleton(subject.model) if subject.model else None
    return Recording(
        trials=trials,
        mass_kg=subject.mass_kg,
        height_m=subject.height_m,
        sex=subject.sex,
        model_file=subject.model,
        static=read_static(subject.static).markers if subject.static else None,
        foot_bodies=subject.foot_bodies,
        marker_bodies=_bodies_of(skeleton, trials) if skeleton else {},
    )


def write_recording(folder: Path, recording: Recording) -> None:
    """Write subject.toml, NAME.trc, NAME_grf.mot, static.trc and model.osim."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    for key in ("mass_kg", "scale_kg", "height_m"):
        value = getattr(recording, key)
        if value is not None:
            lines.append(f"{key} = {value:.6g}")
    if recording.sex:
        lines.append(f'sex = "{recording.sex}"')
    if recording.model is not None:
        write_skeleton(recording.model, folder / "model.osim")
    elif recording.model_file is not None:
        (folder / "model.osim").write_bytes(recording.model_file.read_bytes())
    if recording.model is not None or recording.model_file is not None:
        lines.append('model = "model.osim"')
    feet = ", ".join(f'"{name}"' for name in recording.foot_bodies)
    lines.append(f"foot_bodies = [{feet}]")
    if recording.static is not None:
        lines.append('static = "static.trc"')
        write_trc(folder / "static.trc", recording.static)
    for trial in recording.trials:
        lines += ["", f"[trials.{trial.name}]", f'markers = "{trial.name}.trc"']
        write_trc(folder / f"{trial.name}.trc", trial.markers)
        if trial.plates:
            lines.append(f'forces = "{trial.name}_grf.mot"')
            lines.append('moments = "free"')
            write_forces(folder / f"{trial.name}_grf.mot", trial.plates)
    (folder / "subject.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _number_plates(capture: Capture) -> Capture:
    """Plates called by their place in the file, as they are written again."""
    plates = tuple(replace(p, name=f"ground_force_{k + 1}") for k, p in enumerate(capture.plates))
    return replace(capture, plates=plates)


def _bodies_of(skeleton: Skeleton, trials: tuple[Capture, ...]) -> dict[str, str]:
    known = {m.name.lower(): skeleton.bodies[m.body].name for m in skeleton.markers}
    seen = {name for trial in trials for name in trial.markers.names if _is_seen(trial.markers, name)}
    return {name: known[name.lower()] for name in sorted(seen) if name.lower() in known}


def _is_seen(markers: Markers, name: str) -> bool:
    positions = markers.positions_ground[:, markers.names.index(name)]
    return bool(np.isfinite(positions).all(axis=1).mean() > 0.9)
