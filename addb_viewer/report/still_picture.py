"""One frame of a trial as a drawing: bones as a picture, all else as lines that stay sharp on paper."""

from collections.abc import Mapping, Sequence

import numpy as np
import trimesh
from jaxtyping import Float

from addb_viewer.report.arrows import Arrow
from addb_viewer.report.bone_raster import bones_image
from addb_viewer.report.camera import Camera, camera_on, heading_of
from addb_viewer.report.floor import PlateDrawing, grid
from addb_viewer.report.markup import Safe, element, text
from addb_viewer.text.diagnosis_vocabulary import newtons
from addb_viewer.trial_view.palette import INK, error_colors
from addb_viewer.trial_view.replay import Replay

WIDTH, HEIGHT = 320.0, 350.0  # [pixel]
FLOOR_M = 1.5  # of floor around the person that is drawn
HEAD, SHAFT = 11.0, 3.2  # [pixel] of arrows
SHORTEST = 6.0  # [pixel] arrow with a head
WITH_FIGURE_N = 15.0  # smaller forces go without their size
FIGURE = (48.0, 13.0)  # [pixel] room of a force's size
MARKER = 2.3  # [pixel]
BELOW_M = 0.05  # under the floor, for feet that reach below it

Point = Float[np.ndarray, "3"]


def still_picture(
    replay: Replay,
    frame: int,
    meshes: Mapping[str, trimesh.Trimesh],
    arrows: Sequence[Arrow],
    plates: Sequence[PlateDrawing],
) -> Safe:
    """Bones, markers, plates and forces of one frame.

    Args:
        replay: the trial.
        frame: of it.
        meshes: by body.
        arrows: of the trial.
        plates: likewise.
    """
    shown = [a for a in arrows if np.isfinite(a.force[frame]).all()]
    person = _person(replay, frame, meshes)
    if not len(person):
        return element("p", "Nothing was seen on this frame.")
    tips = [a.start[frame] + a.metres_per_newton * a.force[frame] for a in shown]
    below = person[:, [0, 2]].mean(axis=0)
    feet = np.array([[below[0], -BELOW_M, below[1]]])
    camera = camera_on(
        np.concatenate([person, feet, np.reshape(tips, (-1, 3))]), heading_of(replay, frame), WIDTH, HEIGHT
    )
    layers = [_floor(below, plates, camera), _bones(replay, frame, meshes, camera)]
    layers.append(_markers(replay, frame, camera))
    taken: list[tuple[float, float]] = []
    layers += [_arrow(arrow, frame, camera, taken) for arrow in shown]
    forces = ", ".join(f"{a.label} {newtons(float(np.linalg.norm(a.force[frame])))}" for a in shown)
    label = f"Skeleton and markers on frame {frame}; forces: {forces or 'none'}"
    return element(
        "svg", *layers, viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}", role="img", aria_label=label, class_="still"
    )


def _person(
    replay: Replay, frame: int, meshes: Mapping[str, trimesh.Trimesh]
) -> Float[np.ndarray, "points 3"]:
    """Markers, and the corners of a box around each bone."""
    points, bodies = [replay.markers.measured[frame]], replay.bodies
    if bodies is not None:
        for i, name in enumerate(bodies.names):
            if name in meshes:
                corners = trimesh.bounds.corners(meshes[name].bounds)
                points.append(np.stack([bodies.point_ground(i, corner)[frame] for corner in corners]))
    found = np.concatenate(points)
    return found[np.isfinite(found).all(axis=1)]


def _floor(below: Float[np.ndarray, "2"], plates: Sequence[PlateDrawing], camera: Camera) -> Safe:
    low, high = below - FLOOR_M, below + FLOOR_M
    lines = "".join(_path(line, camera) for line in grid(low, high))
    pieces = [Safe(f'<path class="grid" d="{lines}"/>')]
    for plate in plates:
        near = plate.outline[:, [0, 2]]
        if len(near) and (np.abs(near - below) < 2 * FLOOR_M).all():
            pieces.append(Safe(f'<path class="plate" d="{_path(plate.outline, camera)}Z"/>'))
        trace = plate.trace[(np.abs(plate.trace[:, [0, 2]] - below) < FLOOR_M).all(axis=1)]
        dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y, _ in camera.seen(trace))
        pieces.append(Safe(f'<path class="trace" d="{dots}"/>'))
    return element("g", *pieces)


def _path(points: Float[np.ndarray, "points 3"], camera: Camera) -> str:
    return "M" + " ".join(f"{x:.1f} {y:.1f}" for x, y, _ in camera.seen(points))


def _bones(replay: Replay, frame: int, meshes: Mapping[str, trimesh.Trimesh], camera: Camera) -> Safe:
    address = "" if replay.bodies is None else bones_image(replay.bodies, meshes, frame, camera)
    return Safe(f'<image href="{address}" width="{WIDTH:g}" height="{HEIGHT:g}"/>' if address else "")


def _markers(replay: Replay, frame: int, camera: Camera) -> Safe:
    measured, model = replay.markers.measured[frame], replay.markers.model[frame]
    seen = np.isfinite(measured).all(axis=1)
    both = seen & np.isfinite(model).all(axis=1)
    misses = "".join(
        _path(np.stack([a, b]), camera) for a, b in zip(measured[both], model[both], strict=True)
    )
    colors = error_colors(replay.markers.errors[frame])
    dots = "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{MARKER}" fill="rgb({color[0]},{color[1]},{color[2]})"/>'
        for (x, y, _), color in zip(camera.seen(measured[seen]), colors[seen], strict=True)
    )
    return Safe(f'<path class="miss" d="{misses}"/><g class="markers">{dots}</g>')


def _arrow(arrow: Arrow, frame: int, camera: Camera, taken: list[tuple[float, float]]) -> Safe:
    """Shaft, head and size of a force; where its figure stands is added to the places taken."""
    start = arrow.start[frame]
    ends = camera.seen(np.stack([start, start + arrow.metres_per_newton * arrow.force[frame]]))[:, :2]
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    if length < SHORTEST:
        return Safe("")
    along = along / length
    across = np.array([-along[1], along[0]])
    head = min(HEAD, 0.6 * length)
    neck = ends[1] - head * along
    sides = [neck + 0.45 * head * across, ends[1], neck - 0.45 * head * across]
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in sides)
    color = (INK if arrow.is_required else arrow.color).on_any_page
    dashes = ' stroke-dasharray="5 4"' if arrow.is_required else ""
    figure = _figure(float(np.linalg.norm(arrow.force[frame])), ends[1], taken)
    return Safe(
        f'<g class="arrow" style="stroke:{color};fill:{color}"><path d="M{ends[0][0]:.1f} {ends[0][1]:.1f}'
        f'L{neck[0]:.1f} {neck[1]:.1f}" stroke-width="{SHAFT}"{dashes}/>'
        f'<polygon points="{corners}" stroke="none"/>{figure}</g>'
    )


def _figure(size_N: float, tip: Float[np.ndarray, "2"], taken: list[tuple[float, float]]) -> Safe:
    """How large a force is, beside the tip of its arrow, inside the picture and over no other figure."""
    if size_N < WITH_FIGURE_N:
        return Safe("")
    x, y = (float(value) for value in tip)
    while any(abs(x - a) < FIGURE[0] and abs(y - b) < FIGURE[1] for a, b in taken):
        y -= 1.0
    taken.append((x, y))
    anchor, beside = ("end", -6) if x > 0.8 * WIDTH else ("start", 6)
    place = f'x="{x + beside:.1f}" y="{max(y, 12):.1f}" text-anchor="{anchor}"'
    return Safe(f"<text {place}>{text(newtons(size_N))}</text>")
