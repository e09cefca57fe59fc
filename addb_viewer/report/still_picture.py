"""One frame of a trial as a drawing: bones as a picture, all else as lines that stay sharp on paper."""

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float
from PIL import Image, ImageDraw
from scipy.spatial.transform import Rotation

from addb_viewer.report.markup import Safe, element, text
from addb_viewer.report.scene_data import Arrow, PlateDrawing, grid
from addb_viewer.text.diagnosis_vocabulary import newtons
from addb_viewer.trial_view.palette import BONE, INK, error_colors
from addb_viewer.trial_view.replay import BodyReplay, Replay

FROM_AHEAD = np.radians(62.0)  # about the vertical, from where the person faces
ELEVATION = np.radians(11.0)
FIELD_OF_VIEW = np.radians(28.0)  # vertical
AIR = 1.06  # room around what is to be seen

Points = Float[np.ndarray, "*points 3"]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera; pixels from the top left."""

    eye: Float[np.ndarray, "3"]  # [m] ground frame
    R_camera_ground: Float[np.ndarray, "3 3"]  # rows: right, up, towards the eye
    width: float  # [pixel]
    height: float

    def seen(self, points_ground: Points) -> Points:
        """Pixels right and down, and the depth before the eye [m]."""
        local = (np.asarray(points_ground, dtype=float) - self.eye) @ self.R_camera_ground.T
        depth = -local[..., 2]
        focal = 0.5 * self.height / np.tan(0.5 * FIELD_OF_VIEW)
        safe = np.maximum(depth, 1e-3)
        right = 0.5 * self.width + focal * local[..., 0] / safe
        down = 0.5 * self.height - focal * local[..., 1] / safe
        return np.stack([right, down, depth], axis=-1)


def heading_of(replay: Replay, frame: int) -> float:
    """Where the person faces about the vertical [rad], from x towards z; 0 where nobody knows."""
    forward = None if replay.bodies is None else replay.bodies.forward
    if forward is None or not np.isfinite(forward[frame]).all():
        return 0.0
    return float(np.arctan2(forward[frame, 2], forward[frame, 0]))


def camera_on(points_ground: Points, heading: float, width: float, height: float) -> Camera:
    """A camera that has all points in its picture.

    Args:
        points_ground: what is to be seen [m].
        heading: of the person [rad].
        width: of the picture [pixel].
        height: likewise.
    """
    points = np.asarray(points_ground).reshape(-1, 3)
    turn = heading + FROM_AHEAD
    backward = np.array(
        [np.cos(ELEVATION) * np.cos(turn), np.sin(ELEVATION), np.cos(ELEVATION) * np.sin(turn)]
    )
    right = np.cross([0.0, 1.0, 0.0], backward)
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(backward, right), backward])
    local = points @ R.T
    middle = 0.5 * (local.min(axis=0) + local.max(axis=0))
    tangent = np.tan(0.5 * FIELD_OF_VIEW) * np.array([width / height, 1.0])
    needed = np.abs(local[:, :2] - middle[:2]) / tangent + (local[:, 2] - middle[2])[:, None]
    distance = AIR * float(needed.max())
    return Camera((middle + np.array([0.0, 0.0, distance])) @ R, R, width, height)


WIDTH, HEIGHT = 320.0, 350.0  # [pixel]
FLOOR_M = 1.5  # of floor around the person that is drawn
HEAD, SHAFT = 11.0, 3.2  # [pixel] of arrows
SHORTEST = 6.0  # [pixel] arrow with a head
WITH_FIGURE_N = 15.0  # smaller forces go without their size
FIGURE = (48.0, 13.0)  # [pixel] room of a force's size
MARKER = 2.3  # [pixel]
FINER = 4  # pixels of bones drawn for one of the picture's, each way
KEPT = 2  # of these, after averaging: for paper and dense screens
LIGHT_CAMERA = np.array([-0.35, 0.55, 0.76])  # comes from the upper left, behind the eye
DARKEST = 0.36  # of the bones' colour, on sides that see no light
QUALITY = 82  # of WebP
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


def bones_image(bodies: BodyReplay, meshes: Mapping[str, trimesh.Trimesh], frame: int, camera: Camera) -> str:
    """A `data:` address of the picture of one frame's bones; empty where none is known.

    Faces are painted from the farthest to the nearest, each in one shade.

    Args:
        bodies: where they are.
        meshes: by body, in the body's frame [m].
        frame: of the trial.
        camera: that looks on.
    """
    corners, shades = [np.zeros((0, 3, 3))], [np.zeros(0)]
    for i, name in enumerate(bodies.names):
        mesh = meshes.get(name)
        if mesh is None or not np.isfinite([*bodies.position[frame, i], *bodies.wxyz[frame, i]]).all():
            continue
        R_ground_body = Rotation.from_quat(bodies.wxyz[frame, i][[1, 2, 3, 0]]).as_matrix()
        pixels = camera.seen(mesh.vertices @ R_ground_body.T + bodies.position[frame, i])
        normals = mesh.vertex_normals[mesh.faces].mean(axis=1) @ (camera.R_camera_ground @ R_ground_body).T
        corners.append(pixels[mesh.faces])
        shades.append(DARKEST + (1 - DARKEST) * np.clip(normals @ LIGHT_CAMERA, 0.0, 1.0))
    faces, shade = np.concatenate(corners), np.concatenate(shades)
    ahead = (faces[:, :, 2] > 0).all(axis=1)
    if not ahead.any():
        return ""
    size = round(camera.width * FINER), round(camera.height * FINER)
    image = Image.new("RGBA", size)
    pen = ImageDraw.Draw(image)
    colors = np.rint(shade[:, None] * np.array(BONE)).astype(int).tolist()
    pixels = (faces[:, :, :2] * FINER).round(1).tolist()
    for face in np.argsort(np.where(ahead, -faces[:, :, 2].mean(axis=1), np.inf))[: ahead.sum()]:
        pen.polygon([*map(tuple, pixels[face])], fill=(*colors[face], 255))
    small = (round(camera.width * KEPT), round(camera.height * KEPT))
    stream = io.BytesIO()
    image.resize(small, Image.Resampling.BOX).save(stream, "WEBP", quality=QUALITY)
    return f"data:image/webp;base64,{base64.b64encode(stream.getvalue()).decode()}"


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
