"""What the player (player.js) shows, as plain values: bodies and their motion, markers, forces, flags.

Positions in steps of half a millimetre, forces of half a newton: finer than a screen shows.
Series of numbers are text: whole steps, differences, deflated; `unpacked` in
player_numbers.js is the other half.
"""

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float

from addb_viewer.report.frames_kept import Kept, frames_words
from addb_viewer.trial_view.cause_pictures import pictures
from addb_viewer.trial_view.drawn_curves import METRES_PER_NEWTON, SMALLEST_N, SMALLEST_RESIDUAL_N
from addb_viewer.trial_view.palette import (
    BONE,
    CAUSE,
    INK,
    RESIDUAL,
    UNASSIGNED,
    Rgb,
    foot_color,
    reason_color,
)
from addb_viewer.trial_view.recorded_subject import Recording, TrialRecord
from addb_viewer.trial_view.replay import BodyReplay, PlateReplay, Replay
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class Arrow:
    """One force over the trial; NaN on frames without it."""

    label: str
    start: Float[np.ndarray, "frames 3"]  # [m]
    force: Float[np.ndarray, "frames 3"]  # [N]
    color: Rgb
    is_required: bool = False  # by the motion, not measured
    metres_per_newton: float = METRES_PER_NEWTON


def arrows_of(replay: Replay, diagnosis: DiagnosisReport | None) -> tuple[Arrow, ...]:
    """Measured forces by foot, forces that the motion demands of a foot without one, causes, the residual.

    Args:
        replay: the trial.
        diagnosis: of the recording; None where nobody asked.
    """
    found = []
    for plate in replay.plates:
        for foot in (-1, *range(len(replay.feet))):
            belongs = plate.foot < 0 if foot < 0 else plate.foot == foot
            color = UNASSIGNED if foot < 0 else foot_color(replay.feet[foot], foot)
            force = np.where(belongs[:, None], plate.force, np.nan)
            found.append(Arrow(plate.name, *_large(plate.cop, force, SMALLEST_N), color))
    for required in replay.required:
        told = f"required of {required.foot}"
        found.append(Arrow(told, *_large(required.point, required.force, SMALLEST_N), INK, is_required=True))
    for picture in pictures(diagnosis, replay) if diagnosis else ():
        if picture.force is not None and picture.place is not None:
            force = np.where(picture.acts[:, None], picture.force, np.nan)
            start, force = _large(picture.place, force, 0.0)
            scale = picture.metres_per_newton
            found.append(Arrow(picture.label, start, force, CAUSE, metres_per_newton=scale))
    if replay.residual is not None:
        counted = np.where(replay.residual.used[:, None], replay.residual.force, np.nan)
        found.append(Arrow("residual", *_large(replay.residual.com, counted, SMALLEST_RESIDUAL_N), RESIDUAL))
    return tuple(arrow for arrow in found if np.isfinite(arrow.force).any())


def _large(
    start: Float[np.ndarray, "frames 3"], force: Float[np.ndarray, "frames 3"], smallest_N: float
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
    """Unknown where the force is too small to be drawn, or its place is not known."""
    with np.errstate(invalid="ignore"):
        shown = np.isfinite(start).all(axis=1) & (np.linalg.norm(force, axis=1) >= smallest_N)
    return np.where(shown[:, None], start, np.nan), np.where(shown[:, None], force, np.nan)


MOST_POINTS = 120  # of a trace: enough to see where the force went
AROUND_M = 1.0  # of floor beyond markers and plates
GRID_M = 0.5


@dataclass(frozen=True)
class PlateDrawing:
    """A plate: its outline, or the trace of its centre of pressure; either may be empty."""

    name: str
    outline: Float[np.ndarray, "corners 3"]  # [m]
    trace: Float[np.ndarray, "points 3"]  # [m] where it was loaded


def plates_of(replay: Replay) -> tuple[PlateDrawing, ...]:
    """All plates of a trial."""
    return tuple(_drawing(plate) for plate in replay.plates)


def grid(low: Float[np.ndarray, "2"], high: Float[np.ndarray, "2"]) -> Float[np.ndarray, "lines 2 3"]:
    """Lines on the floor half a metre apart, between two corners [m] along x and z."""
    x0, z0 = (np.floor(value / GRID_M) * GRID_M for value in low)
    x1, z1 = (np.ceil(value / GRID_M) * GRID_M for value in high)
    across = [[(x, 0, z0), (x, 0, z1)] for x in np.arange(x0, x1 + 1e-6, GRID_M)]
    along = [[(x0, 0, z), (x1, 0, z)] for z in np.arange(z0, z1 + 1e-6, GRID_M)]
    return np.array([*across, *along], dtype=float)


def walked_floor(replay: Replay) -> Float[np.ndarray, "lines 2 3"]:
    """The grid around all that was measured."""
    seen = replay.markers.measured[np.isfinite(replay.markers.measured).all(axis=2)]
    if not len(seen):
        return np.zeros((0, 2, 3))
    low, high = seen.min(axis=0) - AROUND_M, seen.max(axis=0) + AROUND_M
    return grid(low[[0, 2]], high[[0, 2]])


def _drawing(plate: PlateReplay) -> PlateDrawing:
    outline = np.zeros((0, 3))
    if plate.corners is not None and np.isfinite(plate.corners).all():
        outline = np.concatenate([plate.corners, plate.corners[:1]])
    with np.errstate(invalid="ignore"):
        loaded = np.linalg.norm(plate.force, axis=1) >= SMALLEST_N
    trace = plate.cop[loaded & np.isfinite(plate.cop).all(axis=1)]
    return PlateDrawing(plate.name, outline, trace[:: max(1, -(-len(trace) // MOST_POINTS))])


POSITION_STEP_M, FORCE_STEP_N, QUATERNION_STEP = 5e-4, 0.5, 1 / 32000
MESH_STEP_M = 2e-4
MOST_FACES = 16000  # of all bones together: plays on machines without a graphics card
FEWEST_FACES = 60  # of one bone
MOST_FRAMES = 8000  # of all trials together; beyond, every second or n-th frame is played
PLACE_DIGITS = 3  # [m] of what stands still
UNKNOWN = -32768  # stands for NaN
LARGEST = 32767  # steps either way


@dataclass(frozen=True)
class Packed:
    """A series of numbers; `unpacked` gives them back to half a step."""

    width: int  # numbers a frame
    step: float
    offset: float
    data: str  # base64 of zlib of all low bytes, then all high bytes, of 16-bit differences along time

    def as_json(self) -> dict[str, object]:
        """Plain values."""
        return {"width": self.width, "step": self.step, "offset": self.offset, "data": self.data}


def packed(values: Float[np.ndarray, "frames *rest"], step: float) -> Packed:
    """Round to steps; a larger step where so many of them would not reach.

    Args:
        values: any; NaN where unknown.
        step: the finest that is wanted, in the unit of the values.
    """
    flat = values.reshape(len(values), -1)
    known = np.isfinite(flat)
    low, high = (float(flat[known].min()), float(flat[known].max())) if known.any() else (0.0, 0.0)
    step = max(step, 0.5 * (high - low) / (LARGEST - 1))
    offset = step * np.floor(0.5 * (low + high) / step)  # a whole step, so that whole numbers stay exact
    whole = np.where(known, np.rint((np.where(known, flat, offset) - offset) / step), UNKNOWN)
    by_column = whole.astype(np.int64).T
    difference = np.diff(by_column, axis=1, prepend=0).astype(np.uint64).astype(np.uint16).ravel()
    planes = np.concatenate([difference & 0xFF, difference >> 8]).astype(np.uint8)
    data = base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode()
    return Packed(flat.shape[1], step, float(offset), data)


def unpacked(series: Packed, frames: int) -> Float[np.ndarray, "frames width"]:
    """The numbers again, as the script has them."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(series.data)), dtype=np.uint8).astype(np.uint16)
    low, high = planes.reshape(2, series.width, frames)
    whole = np.cumsum(low | (high << 8), axis=1, dtype=np.uint16).astype(np.int16)
    values = np.where(whole == UNKNOWN, np.nan, whole * series.step + series.offset)
    return values.T


def scene_of(recording: Recording, kept: Sequence[Kept]) -> dict[str, object]:
    """The scenes of all trials of a recording.

    Args:
        recording: with its meshes.
        kept: the frames of each trial.
    """
    total = sum(record.replay.frames for record in recording.trials)
    every = -(-total // MOST_FRAMES)
    names = recording.fit.skeleton.body_names
    return {
        "bone": list(BONE),
        "meshes": _meshes(recording.meshes, names),
        "trials": [
            _trial(record, recording, its_frames, every)
            for record, its_frames in zip(recording.trials, kept, strict=True)
        ],
    }


def _meshes(meshes: Mapping[str, trimesh.Trimesh], names: Sequence[str]) -> list[dict[str, object] | None]:
    drawn = {name: meshes[name] for name in names if name in meshes}
    share = min(1.0, MOST_FACES / max(sum(len(mesh.faces) for mesh in drawn.values()), 1))
    return [_mesh(drawn[name], share) if name in drawn else None for name in names]


def _mesh(mesh: trimesh.Trimesh, share: float) -> dict[str, object]:
    fewer = max(int(share * len(mesh.faces)), FEWEST_FACES)
    if fewer < len(mesh.faces):
        mesh = mesh.simplify_quadric_decimation(face_count=fewer)
    return {
        "vertices": packed(np.asarray(mesh.vertices), MESH_STEP_M).as_json(),
        "count": len(mesh.vertices),
        "faces": packed(np.asarray(mesh.faces, dtype=float), 1.0).as_json(),
        "faceCount": len(mesh.faces),
    }


def _trial(record: TrialRecord, recording: Recording, kept: Kept, every: int) -> dict[str, object]:
    replay = record.replay
    played = slice(None, None, every)
    arrows = arrows_of(replay, recording.diagnosis)
    return {
        "name": replay.name,
        "frames": len(replay.times[played]),
        "every": every,
        "last": replay.frames - 1,
        "rate": replay.rate / every,
        "start": float(replay.times[0]),
        "markers": packed(replay.markers.measured[played], POSITION_STEP_M).as_json(),
        "modelMarkers": _model_markers(replay, recording.fit.skeleton),
        **_bodies(replay.bodies, played),
        "arrows": [_arrow(arrow, played) for arrow in arrows],
        "floor": _places(walked_floor(replay)),
        "plates": [
            {"name": p.name, "outline": _places(p.outline), "trace": _places(p.trace)}
            for p in plates_of(replay)
        ],
        "kept": [list(run) for run in kept.ranges],
        "flags": [
            {
                "start": start,
                "end": end,
                "words": f"{cause.foot_words}: {cause.words}, frames {frames_words(start, end)}",
                "color": _hex(reason_color(cause.reason)),
                "foot": None if cause.foot is None else recording.fit.skeleton.body_index(cause.foot),
            }
            for cause in kept.causes
            for start, end in cause.ranges
        ],
    }


def _bodies(bodies: BodyReplay | None, played: slice) -> dict[str, object]:
    if bodies is None:
        return {"positions": None, "quaternions": None, "root": 0}
    return {
        "positions": packed(bodies.position[played], POSITION_STEP_M).as_json(),
        "quaternions": packed(_unbroken(bodies.wxyz)[played], QUATERNION_STEP).as_json(),
        "root": bodies.root,
    }


def _unbroken(wxyz: Float[np.ndarray, "frames bodies 4"]) -> Float[np.ndarray, "frames bodies 4"]:
    """The same turns with signs that do not jump, so that differences along time are small."""
    flips = np.einsum("tbk,tbk->tb", wxyz[1:], wxyz[:-1]) < 0
    signs = np.cumprod(np.where(np.concatenate([np.zeros_like(flips[:1]), flips]), -1.0, 1.0), axis=0)
    return wxyz * signs[:, :, None]


def _model_markers(replay: Replay, skeleton: Skeleton) -> list[dict[str, object]]:
    """Those that were measured too, each fixed on its body."""
    compared = np.isfinite(replay.markers.model).all(axis=2).any(axis=0)
    column = {name: i for i, name in enumerate(replay.markers.names) if compared[i]}
    return [
        {"marker": column[m.name], "body": m.body, "at": m.position_body.round(4).tolist()}
        for m in skeleton.markers
        if m.name in column
    ]


def _arrow(arrow: Arrow, played: slice) -> dict[str, object]:
    return {
        "label": arrow.label,
        "start": packed(arrow.start[played], POSITION_STEP_M).as_json(),
        "force": packed(arrow.force[played], FORCE_STEP_N).as_json(),
        "color": _hex(arrow.color),
        "required": arrow.is_required,
        "scale": arrow.metres_per_newton,
    }


def _places(points: Float[np.ndarray, "*points 3"]) -> Any:
    return np.asarray(points).round(PLACE_DIGITS).tolist()


def _hex(color: Rgb) -> str:
    return f"#{color.r:02x}{color.g:02x}{color.b:02x}"
