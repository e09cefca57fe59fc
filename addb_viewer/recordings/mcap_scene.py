"""A trial's scene in Foxglove's well-known schemas. Ground frame, y up; lengths in metres."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp
from jaxtyping import Float

from addb_viewer.trial_view.drawn_curves import METRES_PER_NEWTON, SMALLEST_N, SMALLEST_RESIDUAL_N
from addb_viewer.trial_view.palette import BONE, GREY, RESIDUAL, UNASSIGNED, Rgb, error_colors, foot_color
from addb_viewer.trial_view.replay import BodyReplay, PlateReplay, Replay

GROUND = "ground"  # the frame that all others are in
HEAD_M, HEAD_WIDTH_M, SHAFT_WIDTH_M, OUTLINE_M = 0.06, 0.045, 0.016, 0.006
BILLION = 1_000_000_000

_POINT = np.dtype(
    [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("error", "<f4")]
    + [(name, "u1") for name in ("red", "green", "blue", "alpha")]
)
_KINDS = {"<f4": PackedElementField.FLOAT32, "|u1": PackedElementField.UINT8}
_FIELDS = [
    PackedElementField(name=name, offset=_POINT.fields[name][1], type=_KINDS[_POINT[name].str])
    for name in _POINT.names or ()
    if _POINT.fields is not None
]


def stamp(time_ns: int) -> Timestamp:
    """A time as messages carry it."""
    return Timestamp(seconds=time_ns // BILLION, nanos=time_ns % BILLION)


def frame_of(trial: str, body: str) -> str:
    """A body's frame."""
    return f"{trial}/{body}"


def point_clouds(
    positions: Float[np.ndarray, "frames markers 3"],
    errors: Float[np.ndarray, "frames markers"],
    times_ns: Sequence[int],
) -> Iterator[PointCloud]:
    """One message a frame; a marker keeps its place, NaN while it is unseen.

    Args:
        positions: [m].
        errors: distances between measured and model marker [m], which colour the points.
        times_ns: of the frames [ns].
    """
    points = np.zeros(errors.shape, dtype=_POINT)
    colors = error_colors(errors)
    for i, axis in enumerate("xyz"):
        points[axis] = positions[..., i]
    for i, name in enumerate(("red", "green", "blue")):
        points[name] = colors[..., i]
    points["error"], points["alpha"] = errors, 255
    upright = Pose(orientation=Quaternion(w=1.0))
    for row, time_ns in zip(points, times_ns, strict=True):
        yield PointCloud(
            timestamp=stamp(time_ns),
            frame_id=GROUND,
            pose=upright,
            point_stride=_POINT.itemsize,
            fields=_FIELDS,
            data=row.tobytes(),
        )


def transforms(trial: str, bodies: BodyReplay, times_ns: Sequence[int]) -> Iterator[FrameTransforms]:
    """Every known body's pose, one message a frame; to be used before the next one is asked for.

    Numbers are those of single precision (0.1 µm within a laboratory), which halves the file.
    """
    places = bodies.position.astype(np.float32).tolist()
    turns = bodies.wxyz.astype(np.float32).tolist()
    made: dict[tuple[int, ...], FrameTransforms] = {}  # by their bodies; filling is faster than making
    for place, turn, there, time_ns in zip(places, turns, bodies.known, times_ns, strict=True):
        shown = tuple(np.flatnonzero(there).tolist())
        if shown not in made:
            made[shown] = _unfilled(frame_of(trial, bodies.names[i]) for i in shown)
        when = stamp(time_ns)
        for i, told in zip(shown, made[shown].transforms, strict=True):
            told.timestamp.CopyFrom(when)
            moved, turned = told.translation, told.rotation
            moved.x, moved.y, moved.z = place[i]
            turned.w, turned.x, turned.y, turned.z = turn[i]
        yield made[shown]


def _unfilled(frames: Iterable[str]) -> FrameTransforms:
    return FrameTransforms(
        transforms=[FrameTransform(parent_frame_id=GROUND, child_frame_id=frame) for frame in frames]
    )


def bones(
    trial: str, meshes: Mapping[str, trimesh.Trimesh], seen: Mapping[str, bool], time_ns: int
) -> SceneUpdate:
    """The meshes of bodies that are seen, each fixed to its body's frame; those of the others are gone."""
    when = stamp(time_ns)
    entities, gone = [], []
    for name, mesh in meshes.items():
        if not seen[name]:
            gone.append(
                SceneEntityDeletion(timestamp=when, type=SceneEntityDeletion.MATCHING_ID, id=f"bone {name}")
            )
            continue
        corners = [Point3(x=x, y=y, z=z) for x, y, z in mesh.vertices.astype(np.float32).tolist()]
        triangles = TriangleListPrimitive(
            pose=_unmoved(), points=corners, color=_color(BONE), indices=mesh.faces.ravel().tolist()
        )
        entities.append(
            SceneEntity(
                timestamp=when,
                frame_id=frame_of(trial, name),
                id=f"bone {name}",
                frame_locked=True,
                triangles=[triangles],
            )
        )
    return SceneUpdate(entities=entities, deletions=gone)


def outlines(plates: Sequence[PlateReplay], time_ns: int) -> SceneUpdate:
    """Every plate whose corners are known; said once."""
    entities = []
    for plate in plates:
        if plate.corners is None or not np.isfinite(plate.corners).all():
            continue
        around = LinePrimitive(
            type=LinePrimitive.LINE_LOOP,
            pose=_unmoved(),
            thickness=OUTLINE_M,
            points=[Point3(x=x, y=y, z=z) for x, y, z in plate.corners.tolist()],
            color=_color(GREY),
        )
        entities.append(
            SceneEntity(
                timestamp=stamp(time_ns),
                frame_id=GROUND,
                id=f"plate {plate.name}",
                frame_locked=True,
                lines=[around],
            )
        )
    return SceneUpdate(entities=entities)


@dataclass(frozen=True)
class _Arrows:
    """One force over time, as arrows; a frame on which it is unknown or too small has None."""

    name: str
    by_frame: list[ArrowPrimitive | None]


def force_arrows(replay: Replay, times_ns: Sequence[int]) -> Iterator[SceneUpdate]:
    """Plates' forces in their feet's colours, and the residual at the centre of mass; one message a frame."""
    told = []
    for plate in replay.plates:
        colors = [
            foot_color(replay.feet[foot], foot) if 0 <= foot < len(replay.feet) else UNASSIGNED
            for foot in plate.foot.tolist()
        ]
        told.append(_Arrows(f"force {plate.name}", _arrows(plate.cop, plate.force, colors, SMALLEST_N)))
    if replay.residual is not None:
        used = np.where(replay.residual.used[:, None], replay.residual.force, np.nan)
        tint = [RESIDUAL] * replay.frames
        shown = _arrows(replay.residual.com, used, tint, SMALLEST_RESIDUAL_N)
        told.append(_Arrows("residual force", shown))
    for frame, time_ns in enumerate(times_ns):
        when = stamp(time_ns)
        update = SceneUpdate()
        for arrows in told:
            arrow = arrows.by_frame[frame]
            if arrow is None:
                update.deletions.append(
                    SceneEntityDeletion(timestamp=when, type=SceneEntityDeletion.MATCHING_ID, id=arrows.name)
                )
            else:
                update.entities.append(
                    SceneEntity(timestamp=when, frame_id=GROUND, id=arrows.name, arrows=[arrow])
                )
        yield update


def _arrows(
    start: Float[np.ndarray, "frames 3"],
    force: Float[np.ndarray, "frames 3"],
    colors: Sequence[Rgb],
    smallest_N: float,
) -> list[ArrowPrimitive | None]:
    sizes = np.linalg.norm(force, axis=1)
    shown = np.flatnonzero(np.isfinite(start).all(axis=1) & (sizes >= smallest_N))
    tints = {color: _color(color) for color in set(colors)}
    places, turns = start[shown].tolist(), _along_x(force, sizes)[shown].tolist()
    lengths = (METRES_PER_NEWTON * sizes[shown]).tolist()
    arrows: list[ArrowPrimitive | None] = [None] * len(force)
    for frame, (px, py, pz), (w, x, y, z), length in zip(shown.tolist(), places, turns, lengths, strict=True):
        head = min(HEAD_M, length / 2)
        arrows[frame] = ArrowPrimitive(
            pose=Pose(position=Vector3(x=px, y=py, z=pz), orientation=Quaternion(w=w, x=x, y=y, z=z)),
            shaft_length=length - head,
            shaft_diameter=SHAFT_WIDTH_M,
            head_length=head,
            head_diameter=HEAD_WIDTH_M,
            color=tints[colors[frame]],
        )
    return arrows


def _along_x(
    force: Float[np.ndarray, "frames 3"], sizes: Float[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 4"]:
    """Quaternions that take +x, along which arrows point, to the force: halfway between the two, w first."""
    unit = np.nan_to_num(force) / np.where(sizes > 0, np.nan_to_num(sizes, nan=1.0), 1.0)[:, None]
    w = 1.0 + unit[:, 0]
    turns = np.stack([w, np.zeros(len(w)), -unit[:, 2], unit[:, 1]], axis=1)
    turns[w < 1e-9] = [0.0, 0.0, 0.0, 1.0]  # straight back: half a turn about z
    turned: np.ndarray = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    return turned


def _unmoved() -> Pose:
    return Pose(position=Vector3(), orientation=Quaternion(w=1.0))


def _color(color: Rgb) -> Color:
    return Color(r=color.r / 255, g=color.g / 255, b=color.b / 255, a=1.0)
