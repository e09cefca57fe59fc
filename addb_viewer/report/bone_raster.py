"""Bones as a picture with a see-through ground, drawn without any graphics card."""

import base64
import io
from collections.abc import Mapping

import numpy as np
import trimesh
from jaxtyping import Float, Int, UInt8
from PIL import Image
from scipy.spatial.transform import Rotation

from addb_viewer.report.camera import Camera
from addb_viewer.trial_view.palette import BONE
from addb_viewer.trial_view.replay import BodyReplay

FINER = 4  # pixels drawn for one of the camera's, each way
KEPT = 2  # of these, after averaging: for paper and dense screens
LIGHT_CAMERA = np.array([-0.35, 0.55, 0.76])  # comes from the upper left, behind the eye
DARKEST = 0.36  # of the bones' colour, on sides that see no light
CHUNK = 4_000_000  # pixels that are tried at once
QUALITY = 82  # of WebP


def bones_image(
    bodies: BodyReplay,
    meshes: Mapping[str, trimesh.Trimesh],
    frame: int,
    camera: Camera,
    tints: Mapping[str, tuple[int, int, int]] | None = None,
) -> str:
    """A `data:` address of the picture of one frame's bones; empty where none is known.

    Args:
        bodies: where they are.
        meshes: by body, in the body's frame [m].
        frame: of the trial.
        camera: that looks on.
        tints: colours of bodies that differ from bone.
    """
    corners, shades, colors = [], [], []
    for i, name in enumerate(bodies.names):
        mesh = meshes.get(name)
        if mesh is None or not np.isfinite([*bodies.position[frame, i], *bodies.wxyz[frame, i]]).all():
            continue
        R_ground_body = Rotation.from_quat(bodies.wxyz[frame, i][[1, 2, 3, 0]]).as_matrix()
        pixels = camera.seen(mesh.vertices @ R_ground_body.T + bodies.position[frame, i])
        normals = mesh.vertex_normals @ (camera.R_camera_ground @ R_ground_body).T
        shade = DARKEST + (1 - DARKEST) * np.clip(normals @ LIGHT_CAMERA, 0.0, 1.0)
        corners.append(pixels[mesh.faces])
        shades.append(shade[mesh.faces])
        colors.append(np.broadcast_to((tints or {}).get(name, BONE), (len(mesh.faces), 3)))
    if not corners:
        return ""
    size = (round(camera.height * FINER), round(camera.width * FINER))
    scaled = np.concatenate(corners) * [FINER, FINER, 1.0]
    rgba = raster(scaled, np.concatenate(shades), np.concatenate(colors), size)
    small = (round(camera.width * KEPT), round(camera.height * KEPT))
    stream = io.BytesIO()
    Image.fromarray(rgba, "RGBA").resize(small, Image.Resampling.BOX).save(stream, "WEBP", quality=QUALITY)
    return f"data:image/webp;base64,{base64.b64encode(stream.getvalue()).decode()}"


def raster(
    corners: Float[np.ndarray, "faces 3 3"],
    shades: Float[np.ndarray, "faces 3"],
    colors: Float[np.ndarray, "faces 3"],
    size: tuple[int, int],
) -> UInt8[np.ndarray, "rows columns 4"]:
    """Triangles with the nearest on top.

    Args:
        corners: pixels right and down, and depth, of each corner.
        shades: brightness at each corner, 0 to 1.
        colors: of each face, 0 to 255.
        size: rows and columns of the picture.
    """
    canvas = _Canvas(*size)
    in_front = np.flatnonzero((corners[:, :, 2] > 0).all(axis=1))
    _, extent = canvas.boxes(corners[in_front])
    tried = int(extent.prod(axis=1).sum())
    for some in np.array_split(in_front, tried // CHUNK + 1):
        canvas.draw(corners[some], shades[some], colors[some])
    return canvas.image.reshape(*size, 4)


class _Canvas:
    """Colours of pixels, and how near what they show is."""

    def __init__(self, rows: int, columns: int) -> None:
        self.rows, self.columns = rows, columns
        self.image = np.zeros((rows * columns, 4), dtype=np.uint8)
        self.nearest = np.full(rows * columns, np.inf)

    def boxes(
        self, corners: Float[np.ndarray, "faces 3 3"]
    ) -> tuple[Int[np.ndarray, "faces 2"], Int[np.ndarray, "faces 2"]]:
        """First column and row of the pixels around each face, and how many of both."""
        edge = [self.columns - 1, self.rows - 1]
        low = np.clip(np.floor(corners[:, :, :2].min(axis=1)), 0, edge).astype(int)
        high = np.clip(np.ceil(corners[:, :, :2].max(axis=1)), 0, edge).astype(int)
        return low, high - low + 1

    def draw(
        self,
        corners: Float[np.ndarray, "faces 3 3"],
        shades: Float[np.ndarray, "faces 3"],
        colors: Float[np.ndarray, "faces 3"],
    ) -> None:
        """Try every pixel around each face, and keep those inside that are nearer than what is there."""
        low, extent = self.boxes(corners)
        counts = extent.prod(axis=1)
        face = np.repeat(np.arange(len(corners)), counts)
        within = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
        x = low[face, 0] + within % extent[face, 0]
        y = low[face, 1] + within // extent[face, 0]
        weights = _weights(corners[face, :, :2], np.stack([x, y], axis=1) + 0.5)
        inside = (weights >= 0).all(axis=1)
        face, weights, at = face[inside], weights[inside], (y * self.columns + x)[inside]
        depth = 1.0 / (weights / corners[face, :, 2]).sum(axis=1)
        order = np.lexsort((-depth, at))  # the nearest of a pixel comes last
        last = order[np.r_[at[order][1:] != at[order][:-1], True][: len(order)]]
        last = last[depth[last] < self.nearest[at[last]]]
        shade = (weights[last] * shades[face[last]]).sum(axis=1)
        self.nearest[at[last]] = depth[last]
        self.image[at[last], :3] = np.rint(np.clip(shade[:, None] * colors[face[last]], 0, 255))
        self.image[at[last], 3] = 255


def _weights(
    corners: Float[np.ndarray, "points 3 2"], points: Float[np.ndarray, "points 2"]
) -> Float[np.ndarray, "points 3"]:
    """Barycentric coordinates; NaN in a triangle without area."""
    a, b, c = np.moveaxis(corners, 1, 0)
    parts = [_cross(c - b, points - b), _cross(a - c, points - c), _cross(b - a, points - a)]
    with np.errstate(invalid="ignore", divide="ignore"):
        weights: Float[np.ndarray, "points 3"] = np.stack(parts, axis=1) / _cross(b - a, c - a)[:, None]
    return weights


def _cross(
    a: Float[np.ndarray, "points 2"], b: Float[np.ndarray, "points 2"]
) -> Float[np.ndarray, " points"]:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
