"""One trial in an MCAP file: what was measured, the fit, its errors, flags and causes.

/TRIAL/markers, model_markers   foxglove.PointCloud; a marker's place in it: metadata `TRIAL markers`
/TRIAL/transforms               foxglove.FrameTransforms: ground to TRIAL/BODY
/TRIAL/bones, plates            foxglove.SceneUpdate, once
/TRIAL/forces                   foxglove.SceneUpdate: arrows of every frame
/TRIAL/log                      foxglove.Log: notes, flags, causes, edits
/TRIAL/residual, marker_error, plate_forces, joints, flags, causes, metrics    JSON
/TRIAL/analog                   JSON: every sample of channels that are no force plate's
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import trimesh
from foxglove_schemas_protobuf.Log_pb2 import Log
from jaxtyping import Float

from addb_viewer.recordings.mcap_file import McapFile
from addb_viewer.recordings.mcap_scene import (
    bones,
    force_arrows,
    outlines,
    point_clouds,
    stamp,
    transforms,
)
from addb_viewer.recordings.mcap_schemas import (
    ANALOG,
    CAUSE,
    FLAG,
    JOINTS,
    MARKER_ERROR,
    METRICS,
    PLATES,
    RESIDUAL,
)
from addb_viewer.trial_view.drawn_curves import marker_errors_of, nanoseconds, used_norm
from addb_viewer.trial_view.joint_quantities import Kind, quantities_of
from addb_viewer.trial_view.recorded_subject import TrialRecord, file_of
from addb_viewer.trial_view.replay import Replay
from addb_viewer.trial_view.trial_events import Line
from solver.capture.formats.analog_channels import AnalogChannels
from solver.common.typed_json import plain
from solver.diagnosis.diagnosis_report import DiagnosisReport

DECIMALS = 6  # of JSON numbers in SI units: micrometres, micronewtons


class TrialTopics:
    """Where a trial's messages go, and when its frames are."""

    def __init__(self, file: McapFile, replay: Replay, origin_ns: int) -> None:
        """Place a trial's frames in a file's time.

        Args:
            file: open.
            replay: the trial.
            origin_ns: time in the file at which the recording's clock reads zero [ns].
        """
        self.file, self.name = file, file_of(replay.name)
        self.seconds = replay.times
        self.times_ns = [origin_ns + int(t) for t in nanoseconds(replay.times)]
        self.origin_ns = origin_ns

    def topic(self, name: str) -> str:
        """A topic of the trial."""
        return f"/{self.name}/{name}"


def write_capture(topics: TrialTopics, replay: Replay) -> None:
    """Write what was measured: markers (coloured by their error where there is a fit) and plates.

    Args:
        topics: of the trial.
        replay: the trial, fitted or not.
    """
    file, times = topics.file, topics.times_ns
    names = {str(i): name for i, name in enumerate(replay.markers.names)}
    file.metadata(f"{topics.name} markers", names)
    clouds = point_clouds(replay.markers.measured, replay.markers.errors, times)
    for time_ns, cloud in zip(times, clouds, strict=True):
        file.message(topics.topic("markers"), time_ns, cloud)
    if not replay.plates:
        return
    file.message(topics.topic("plates"), times[0], outlines(replay.plates, times[0]))
    plates = [(p.name, _plain(p.force), _plain(p.cop), p.foot.tolist()) for p in replay.plates]
    for frame, time_ns in enumerate(times):
        told = [
            {
                "name": name,
                "force_N": force[frame],
                "cop_m": cop[frame],
                "foot": replay.feet[foot[frame]] if foot[frame] >= 0 else None,
            }
            for name, force, cop, foot in plates
        ]
        file.record(topics.topic("plate_forces"), time_ns, PLATES, {**_when(topics, frame), "plates": told})


def write_fit(
    topics: TrialTopics, record: TrialRecord, meshes: Mapping[str, trimesh.Trimesh], lines: Sequence[Line]
) -> None:
    """Write the fit of a trial: the scene, errors, figures, flags and the log.

    Args:
        topics: of the trial.
        record: the trial.
        meshes: by body, in the body's frame [m].
        lines: of the log.
    """
    file, replay, times = topics.file, record.replay, topics.times_ns
    if replay.bodies is not None:
        drawn = {name: mesh for name, mesh in meshes.items() if name in replay.bodies.names}
        for frame in replay.bodies.comings_and_goings:
            seen = dict(zip(replay.bodies.names, replay.bodies.known[frame], strict=True))
            file.message(topics.topic("bones"), times[frame], bones(topics.name, drawn, seen, times[frame]))
        model = point_clouds(replay.markers.model, replay.markers.errors, times)
        moved = transforms(topics.name, replay.bodies, times)
        for time_ns, cloud, poses in zip(times, model, moved, strict=True):
            file.message(topics.topic("model_markers"), time_ns, cloud)
            file.message(topics.topic("transforms"), time_ns, poses)
        _write_marker_errors(topics, record)
        _write_joints(topics, replay)
    if replay.plates or replay.residual is not None:
        for time_ns, update in zip(times, force_arrows(replay, times), strict=True):
            file.message(topics.topic("forces"), time_ns, update)
    _write_residual(topics, record)
    for k, (start, end, foot, reason) in enumerate(replay.forces.missing):
        flag = {"trial": replay.name, "range": [start, end], "foot": foot, "reason": reason}
        file.record(topics.topic("flags"), times[start], FLAG, flag | {"source": replay.forces.source_of(k)})
    for line in lines:
        _write_line(topics, line)
    figures = {"trial": replay.name, "figures": plain(record.figures)}
    file.record(topics.topic("metrics"), times[0], METRICS, figures)


def write_analog(topics: TrialTopics, analog: AnalogChannels) -> None:
    """Write every sample of other channels, each at its own time, with all its digits.

    Args:
        topics: of the trial.
        analog: on the recording's clock, from its zero on.
    """
    topics.file.metadata(f"{topics.name} analog", dict(zip(analog.names, analog.units, strict=True)))
    seconds = analog.times
    for at_s, at_ns, row in zip(seconds.tolist(), nanoseconds(seconds).tolist(), analog.values, strict=True):
        known = [value if np.isfinite(value) else None for value in row.tolist()]
        told = {"time_s": at_s, "values": dict(zip(analog.names, known, strict=True))}
        topics.file.record(topics.topic("analog"), topics.origin_ns + at_ns, ANALOG, told)


def write_causes(topics: TrialTopics, trial: str, diagnosis: DiagnosisReport) -> None:
    """Write the causes that a diagnosis names in a trial, each where it begins to act.

    Args:
        topics: of the trial.
        trial: its name.
        diagnosis: of the recording.
    """
    for effect in diagnosis.effects:
        for name, start, end in effect.frames:
            if name == trial:
                cause = {"trial": trial, "range": [start, end], "effect": plain(effect)}
                topics.file.record(topics.topic("causes"), topics.times_ns[start], CAUSE, cause)


def _write_line(topics: TrialTopics, line: Line) -> None:
    """Write a line of the log at its frame."""
    time_ns = topics.times_ns[line.frame]
    level = Log.WARNING if line.is_warning else Log.INFO
    said = Log(timestamp=stamp(time_ns), level=level, message=line.text, name=line.source)
    topics.file.message(topics.topic("log"), time_ns, said)


def _write_residual(topics: TrialTopics, record: TrialRecord) -> None:
    residual = record.replay.residual
    if residual is None:
        return
    force, moment = _plain(residual.force), _plain(residual.moment)
    norms = [_plain(np.linalg.norm(v, axis=1)) for v in (residual.force, residual.moment)]
    before = [[None] * record.replay.frames] * 2
    if record.before is not None and record.before.residual is not None:
        other = record.before.residual
        before = [_plain(used_norm(v, other)) for v in (other.force, other.moment)]
    bounds = _plain(np.array([residual.force_limit, residual.moment_limit]))
    for frame, time_ns in enumerate(topics.times_ns):
        told = {
            "used": bool(residual.used[frame]),
            "force_N": force[frame],
            "moment_Nm": moment[frame],
            "force_norm_N": norms[0][frame],
            "moment_norm_Nm": norms[1][frame],
            "before_force_norm_N": before[0][frame],
            "before_moment_norm_Nm": before[1][frame],
            "force_bound_N": bounds[0],
            "moment_bound_Nm": bounds[1],
        }
        topics.file.record(topics.topic("residual"), time_ns, RESIDUAL, _when(topics, frame) | told)


def _write_marker_errors(topics: TrialTopics, record: TrialRecord) -> None:
    markers = record.replay.markers
    rms, largest = (_plain(values) for values in marker_errors_of(markers))
    worst = np.nan_to_num(markers.errors, nan=-1.0).argmax(axis=1)
    before = [None] * record.replay.frames
    if record.before is not None:
        before = _plain(marker_errors_of(record.before.markers)[0])
    for frame, time_ns in enumerate(topics.times_ns):
        told = {
            "rms_m": rms[frame],
            "largest_m": largest[frame],
            "worst": None if largest[frame] is None else markers.names[worst[frame]],
            "before_rms_m": before[frame],
        }
        topics.file.record(topics.topic("marker_error"), time_ns, MARKER_ERROR, _when(topics, frame) | told)


def _write_joints(topics: TrialTopics, replay: Replay) -> None:
    joints = replay.joints
    if joints is None:
        return
    told: dict[Kind, dict[str, list[Any]]] = {Kind.POSITION: {}, Kind.TORQUE: {}}
    for quantity in quantities_of(joints):
        if quantity.kind in told and quantity.unit in ("°", "N·m"):
            for side, column in quantity.columns:
                told[quantity.kind][quantity.named(side)] = _plain(quantity.values(joints, column))
    for frame, time_ns in enumerate(topics.times_ns):
        angles, torques = ({n: v[frame] for n, v in told[kind].items()} for kind in told)
        used = None if replay.residual is None else bool(replay.residual.used[frame])
        content = {"used": used, "angles_deg": angles, "torques_Nm": torques}
        topics.file.record(topics.topic("joints"), time_ns, JOINTS, _when(topics, frame) | content)


def _when(topics: TrialTopics, frame: int) -> dict[str, Any]:
    return {"frame": frame, "time_s": float(topics.seconds[frame])}


def _plain(values: Float[np.ndarray, "rows ..."]) -> list[Any]:
    """Rounded numbers, or vectors, None for one with an unknown component: JSON has no NaN."""
    known = np.isfinite(values).reshape(len(values), -1).all(axis=1)
    rounded = np.round(values, DECIMALS).tolist()
    return [value if there else None for value, there in zip(rounded, known.tolist(), strict=True)]
