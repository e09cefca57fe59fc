"""The scene of a trial in a rerun recording. Lengths in metres, ground frame, y up.

scene/markers                 measured ones, coloured by their error
scene/after/markers, bones/…  the present fit; its model markers
scene/before/bones/…          of the fit that it is compared with
scene/plates/NAME             outlines
scene/forces/FOOT             from the centre of pressure; those of no foot are `unassigned`
scene/required/FOOT           what the motion demands of a foot whose force is missing
scene/after/residual          at the centre of mass
"""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr
import trimesh
from jaxtyping import Bool, Float

from addb_viewer.recordings.rrd_stream import RrdStream, packed
from addb_viewer.trial_view.drawn_curves import METRES_PER_NEWTON, SMALLEST_N, SMALLEST_RESIDUAL_N
from addb_viewer.trial_view.palette import (
    BONE,
    GREY,
    OTHER_SOLVE,
    PALE,
    RESIDUAL,
    UNASSIGNED,
    Rgb,
    error_colors,
    foot_color,
)
from addb_viewer.trial_view.recorded_subject import Recording, TrialRecord
from addb_viewer.trial_view.replay import PlateReplay, Replay
from solver.skeleton.skeleton import Skeleton

SCENE, AFTER, BEFORE = "scene", "after", "before"
MARKER_RADIUS_M, MODEL_MARKER_RADIUS_M = 0.008, 0.005
SHAFT_RADIUS_M, OUTLINE_RADIUS_M = 0.008, 0.003
UNASSIGNED_NAME = "unassigned"
SEE_THROUGH = 110  # alpha of the bones of the fit that is compared with

Path = Float[np.ndarray, "frames 3"]


def write_scene(stream: RrdStream, record: TrialRecord, recording: Recording) -> None:
    """Write a trial's scene.

    Args:
        stream: of the trial.
        record: the trial.
        recording: that it belongs to.
    """
    replay, meshes = record.replay, recording.meshes
    stream.static((), rr.ViewCoordinates.RIGHT_HAND_Y_UP)
    _measured_markers(stream, replay)
    _residual(stream, AFTER, replay, RESIDUAL)
    _bones(stream, AFTER, replay, meshes, [*BONE, 255])
    _model_markers(stream, replay, recording.fit.skeleton)
    if record.before is not None:
        _residual(stream, BEFORE, record.before, OTHER_SOLVE)
        _bones(stream, BEFORE, record.before, meshes, [*OTHER_SOLVE, SEE_THROUGH])
    for plate in replay.plates:
        _outline(stream, plate)
    for foot, name in ((-1, UNASSIGNED_NAME), *enumerate(replay.feet)):
        color = UNASSIGNED if foot < 0 else foot_color(name, foot)
        on_foot = [(p.cop, p.force, p.foot < 0 if foot < 0 else p.foot == foot) for p in replay.plates]
        _arrows(stream, (SCENE, "forces", name), on_foot, color, SMALLEST_N)
    always = np.ones(replay.frames, dtype=bool)
    for required in replay.required:
        told = [(required.point, required.force, always)]
        _arrows(stream, (SCENE, "required", required.foot), told, PALE, SMALLEST_N)


def _measured_markers(stream: RrdStream, replay: Replay) -> None:
    markers = replay.markers
    seen = np.isfinite(markers.measured).all(axis=2)
    parts = (SCENE, "markers")
    stream.static(parts, rr.Points3D.from_fields(radii=MARKER_RADIUS_M, show_labels=False))
    columns = rr.Points3D.columns(
        positions=markers.measured[seen].astype(np.float32),
        colors=packed(error_colors(markers.errors))[seen],
    )
    stream.columns(parts, columns, lengths=seen.sum(axis=1))
    other = np.flatnonzero(np.r_[True, (seen[1:] != seen[:-1]).any(axis=1)])  # names hold until the next ones
    names = np.broadcast_to(np.array(markers.names, dtype=object), seen.shape)
    labels = rr.Points3D.columns(labels=list(names[other][seen[other]]))
    stream.columns(parts, labels, frames=other, lengths=seen[other].sum(axis=1))


def _residual(stream: RrdStream, which: str, replay: Replay, color: Rgb) -> None:
    """What a fit leaves, at the centre of mass, on frames that count."""
    residual = replay.residual
    if residual is not None:
        at_com = [(residual.com, residual.force, residual.used)]
        _arrows(stream, (SCENE, which, "residual"), at_com, color, SMALLEST_RESIDUAL_N)


def _model_markers(stream: RrdStream, replay: Replay, skeleton: Skeleton) -> None:
    """Those that were measured too: fixed on their bodies, so they are said once and move along."""
    compared = np.isfinite(replay.markers.model).all(axis=2).any(axis=0)
    names = {name for name, there in zip(replay.markers.names, compared, strict=True) if there}
    for i, body in enumerate(skeleton.body_names):
        own = [marker for marker in skeleton.markers if marker.body == i and marker.name in names]
        if own:
            points = rr.Points3D(
                np.stack([marker.position_body for marker in own]).astype(np.float32),
                radii=MODEL_MARKER_RADIUS_M,
                colors=[list(GREY)],
                labels=[marker.name for marker in own],
                show_labels=False,
            )
            stream.static((SCENE, AFTER, "bones", body, "markers"), points)


def _bones(
    stream: RrdStream,
    which: str,
    replay: Replay,
    meshes: Mapping[str, trimesh.Trimesh],
    color: Sequence[int],
) -> None:
    """Meshes once, in their bodies' frames; poses by columns."""
    bodies = replay.bodies
    if bodies is None:
        return
    changes = bodies.comings_and_goings
    for i, name in enumerate(bodies.names):
        frames = np.flatnonzero(bodies.known[:, i])
        if not len(frames):
            continue
        parts, mesh = (SCENE, which, "bones", name), meshes.get(name)
        if mesh is not None:
            drawn = rr.Mesh3D(
                vertex_positions=mesh.vertices.astype(np.float32),
                triangle_indices=mesh.faces.astype(np.uint32),
                vertex_normals=mesh.vertex_normals.astype(np.float32),
                albedo_factor=list(color),
            )
            stream.static(parts, drawn)
        columns = rr.Transform3D.columns(
            translation=bodies.position[frames, i].astype(np.float32),
            quaternion=bodies.wxyz[frames, i][:, [1, 2, 3, 0]].astype(np.float32),
        )
        stream.columns(parts, columns, frames=frames)
        if len(changes) > 1:  # a pose holds until the next one: while there is none, the bone has no size
            sizes = rr.Transform3D.columns(scale=[[float(bodies.known[frame, i])] * 3 for frame in changes])
            stream.columns(parts, sizes, frames=np.array(changes))


def _outline(stream: RrdStream, plate: PlateReplay) -> None:
    if plate.corners is None or not np.isfinite(plate.corners).all():
        return
    around = np.concatenate([plate.corners, plate.corners[:1]]).astype(np.float32)
    strip = rr.LineStrips3D([around], radii=OUTLINE_RADIUS_M, colors=[list(GREY)], labels=[plate.name])
    stream.static((SCENE, "plates", plate.name), strip)


def _arrows(
    stream: RrdStream,
    parts: Sequence[str],
    forces: Sequence[tuple[Path, Path, Bool[np.ndarray, " frames"]]],
    color: Rgb,
    smallest_N: float,
) -> None:
    """Forces as arrows; a frame on which none is known and large enough has none.

    Args:
        stream: of the trial.
        parts: of the entity's name.
        forces: where each starts [m], the force [N], and on which frames it counts.
        color: of all of them.
        smallest_N: smaller ones are not drawn.
    """
    if not forces:
        return
    start = np.stack([place for place, _, _ in forces], axis=1)
    force = np.stack([vector for _, vector, _ in forces], axis=1)
    counts = np.stack([frames for _, _, frames in forces], axis=1)
    shown = counts & np.isfinite(start).all(axis=2) & (np.linalg.norm(force, axis=2) >= smallest_N)
    if not shown.any():
        return
    stream.static(parts, rr.Arrows3D.from_fields(radii=SHAFT_RADIUS_M, colors=[list(color)]))
    columns = rr.Arrows3D.columns(
        origins=start[shown].astype(np.float32),
        vectors=(METRES_PER_NEWTON * force[shown]).astype(np.float32),
    )
    stream.columns(parts, columns, lengths=shown.sum(axis=1))
