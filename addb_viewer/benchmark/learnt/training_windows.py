"""What networks see and learn to tell, frame by frame, and windows of frames for training, on disk.

Nothing depends on where a person goes or faces.
"""

import json
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from addb_viewer.benchmark.scoring import HISTORY, STRIDE, scored_frames
from addb_viewer.benchmark.task import Measured, Seen, Trials, central_differences
from addb_viewer.dataset.columns import COORDINATE_NAMES
from solver.capture.atomic import write_whole
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

BELOW_ROOT = COORDINATE_NAMES[6:]
# A coordinate of each joint whose centre is shown; models name joints differently, but these alike.
JOINTS = (
    *(f"{name}_{side}" for side in "rl" for name in ("hip_flexion", "knee_angle", "ankle_angle")),
    *(f"{name}_{side}" for side in "rl" for name in ("subtalar_angle", "mtp_angle")),
    "lumbar_extension",
    *(f"{name}_{side}" for side in "rl" for name in ("arm_flex", "elbow_flex", "pro_sup", "wrist_flex")),
)
EARLIER = np.arange(STRIDE, HISTORY + STRIDE, STRIDE)  # frames before: the root's history in wide features
Features = Literal["plain", "wide"]
_PLAIN = 2 * len(BELOW_ROOT) + 3 + 1 + 3 + 3 + 3 * len(JOINTS)
SIZES: dict[Features, int] = {"plain": _PLAIN, "wide": _PLAIN + len(BELOW_ROOT) + 6 + 6 * len(EARLIER)}
TARGETS = 12  # of the right and the left foot: force, moment, over the mass, in the pelvis' axes


@dataclass(frozen=True)
class RootPose:
    """The root body's, ground frame."""

    R_ground_root: Float[np.ndarray, "frames 3 3"]
    p_ground: Float[np.ndarray, "frames 3"]  # [m]
    feet_ground: Float[np.ndarray, "frames feet 3"]  # origins of the feet's bodies [m]


def features_of(
    seen: Seen, features: Features = "plain"
) -> tuple[Float[np.ndarray, "frames features"], RootPose]:
    """Coordinates below the root, which way is up, the root's height; differences; centres of joints.

    Coordinates and joints that a model lacks are zero. Wide ones are as the dataset's public tools have them
    besides: first differences, and where the root was before.

    Args:
        seen: what is shown.
        features: "plain" as the paper says, or "wide".
    """
    skeleton = seen.skeleton
    R, p = body_poses(skeleton, seen.q)
    root = root_joint(skeleton)
    R_root, p_root = R[:, root.body], p[:, root.body]
    velocity, acceleration = central_differences(seen.q, seen.rate)
    slope, linear = central_differences(p_root, seen.rate)
    centres = np.zeros((seen.frames, len(JOINTS), 3))
    for k, body in enumerate(_bodies_of(skeleton)):
        if body is not None:
            centre = p[:, body] + R[:, body] @ skeleton.joints[body].p_child_frame
            centres[:, k] = _into(R_root, centre - p_root)
    pieces = [
        _named(seen.q, skeleton),
        R_root[:, 1, :],  # the ground's vertical in the root's axes
        p_root[:, 1:2],
        _named(acceleration, skeleton),
        _turning(R_root, seen.rate),
        _into(R_root, linear),
        centres.reshape(seen.frames, -1),
    ]
    if features == "wide":
        pieces += [_named(velocity, skeleton), _into(R_root, slope), _spin(R_root, seen.rate)]
        pieces.append(_history(R_root, p_root))
    feet = p[:, list(seen.feet)]
    return np.concatenate(pieces, axis=1), RootPose(R_root, p_root, feet)


def targets_of(seen: Seen, measured: Measured, pose: RootPose) -> Float[np.ndarray, "frames targets"]:
    """Force [N/kg] and moment [N·m/kg] on each foot in the root's axes, about the shown foot's origin.

    Args:
        seen: of the same frames.
        measured: NaN stays NaN.
        pose: of the shown motion.
    """
    lever = measured.foot_ground - pose.feet_ground
    moment = measured.moment + np.cross(lever, measured.force)
    both = np.stack([measured.force, moment], axis=2) / seen.mass_kg
    return np.einsum("tji,tfkj->tfki", pose.R_ground_root, both).reshape(seen.frames, TARGETS)


def wrenches_of(
    told: Float[np.ndarray, "frames targets"], seen: Seen, pose: RootPose
) -> tuple[Float[np.ndarray, "frames feet 3"], Float[np.ndarray, "frames feet 3"]]:
    """The way back: forces [N] and moments [N·m] in the ground's axes.

    Args:
        told: as `targets_of` gives them.
        seen: of the same frames.
        pose: of the shown motion.
    """
    both = np.einsum("tij,tfkj->tfki", pose.R_ground_root, told.reshape(-1, 2, 2, 3)) * seen.mass_kg
    return both[:, :, 0], both[:, :, 1]


def _named(values: Float[np.ndarray, "frames dofs"], skeleton: Skeleton) -> Float[np.ndarray, "frames named"]:
    named = np.zeros((len(values), len(BELOW_ROOT)))
    for k, name in enumerate(BELOW_ROOT):
        if name in skeleton.dofs:
            named[:, k] = values[:, skeleton.dofs.index(name)]
    return named


def _bodies_of(skeleton: Skeleton) -> list[int | None]:
    """The body below each of the joints; None where the model has no such coordinate."""
    moved = {axis.coordinate: b for b, joint in enumerate(skeleton.joints) for axis in joint.axes}
    return [moved.get(name) for name in JOINTS]


def _turning(R_ground_root: Float[np.ndarray, "frames 3 3"], rate: float) -> Float[np.ndarray, "frames 3"]:
    """Angular acceleration in the root's axes, by differences [rad/s²]; ends repeat their neighbours'."""
    steps = Rotation.from_matrix(R_ground_root[:-1].transpose(0, 2, 1) @ R_ground_root[1:]).as_rotvec()
    turning = np.empty((len(R_ground_root), 3))
    turning[1:-1] = (steps[1:] - steps[:-1]) * rate**2
    turning[0], turning[-1] = turning[1], turning[-2]
    return turning


def _spin(R_ground_root: Float[np.ndarray, "frames 3 3"], rate: float) -> Float[np.ndarray, "frames 3"]:
    """Angular velocity in the root's axes [rad/s]; ends repeat their neighbours'."""
    around = R_ground_root[:-2].transpose(0, 2, 1) @ R_ground_root[2:]
    spin = np.empty((len(R_ground_root), 3))
    spin[1:-1] = Rotation.from_matrix(around).as_rotvec() * rate / 2
    spin[0], spin[-1] = spin[1], spin[-2]
    return spin


def _history(
    R_ground_root: Float[np.ndarray, "frames 3 3"], p_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames history"]:
    """Where the root was, and how it was turned, in its present axes [m, rad]; first the first frame."""
    at = np.maximum(np.arange(len(p_ground))[:, None] - EARLIER, 0)
    places = np.einsum("tji,tkj->tki", R_ground_root, p_ground[at] - p_ground[:, None])
    turned = R_ground_root[:, None].transpose(0, 1, 3, 2) @ R_ground_root[at]
    angles = Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_rotvec()
    return np.concatenate([places, angles.reshape(places.shape)], axis=2).reshape(len(p_ground), -1)


def _into(
    R_ground_root: Float[np.ndarray, "frames 3 3"], vectors: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 3"]:
    return np.einsum("tji,tj->ti", R_ground_root, vectors)


BACK = np.arange(HISTORY - STRIDE, -1, -STRIDE)  # frames before the window's end, the oldest first
LENGTH = len(BACK)
ABOUT = "about.json"


@dataclass(frozen=True)
class Windows:
    """Memory-mapped; a window is every 5th of 50 frames, its targets are those of the last."""

    features: Float[np.ndarray, "frames features"]
    targets: Float[np.ndarray, "windows targets"]
    ends: Int[np.ndarray, " windows"]  # rows of `features`

    def __len__(self) -> int:
        """How many windows."""
        return len(self.ends)

    def some(
        self, which: Int[np.ndarray, " batch"]
    ) -> tuple[Float[np.ndarray, "batch length features"], Float[np.ndarray, "batch targets"]]:
        """A batch.

        Args:
            which: numbers of windows.
        """
        return self.features[self.ends[which][:, None] - BACK], self.targets[which]

    def scales(self) -> dict[str, Float[np.ndarray, " channels"]]:
        """Mean and standard deviation of features and targets, of these windows alone; in bounded memory."""
        sums = {"feature": np.zeros((2, self.features.shape[1])), "target": np.zeros((2, TARGETS))}
        counts = {"feature": 0, "target": 0}
        for kind, rows in (("feature", self.features), ("target", self.targets)):
            for start in range(0, len(rows), 4096):
                some = np.asarray(rows[start : start + 4096], dtype=float)
                sums[kind] += np.stack([some.sum(axis=0), (some**2).sum(axis=0)])
                counts[kind] += len(some)
        scales = {}
        for kind, (total, squares) in sums.items():
            mean = total / counts[kind]
            spread = np.sqrt(np.maximum(squares / counts[kind] - mean**2, 0.0))
            scales[f"{kind}_mean"] = mean.astype(np.float32)
            scales[f"{kind}_std"] = np.where(spread > 1e-6, spread, 1.0).astype(np.float32)
        return scales


def windows_of(trials: Trials, folder: Path, features: Features = "plain") -> Windows:
    """The persons' windows; read from the release once, then from the folder.

    Args:
        trials: of some persons.
        folder: of the files; what another release or other persons left there is replaced.
        features: of each frame.
    """
    about = {"persons": sorted(trials.persons), "data": trials.fingerprint, "features": SIZES[features]}
    if not (folder / ABOUT).is_file() or json.loads((folder / ABOUT).read_text()) != about:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ABOUT).unlink(missing_ok=True)
        _write(trials, folder, features)
        write_whole(folder / ABOUT, json.dumps(about))
    return Windows(
        _mapped(folder / "features.f32", np.float32, SIZES[features]),
        _mapped(folder / "targets.f32", np.float32, TARGETS),
        _mapped(folder / "ends.i64", np.int64, 1)[:, 0],
    )


def ends_of_all(frames: int) -> Int[np.ndarray, "frames length"]:
    """Rows of the window that ends at each frame of a stretch; before its beginning the first frame stands.

    Args:
        frames: of the stretch.
    """
    return np.maximum(np.arange(frames)[:, None] - BACK, 0)


def _write(trials: Trials, folder: Path, features: Features) -> None:
    with ExitStack() as stack:
        rows, targets, ends = (
            stack.enter_context((folder / name).open("wb"))
            for name in ("features.f32", "targets.f32", "ends.i64")
        )
        for first, (values, told, last) in _stretches(trials, features):
            rows.write(values.astype(np.float32).tobytes())
            targets.write(told.astype(np.float32).tobytes())
            ends.write((first + last).astype(np.int64).tobytes())


def _stretches(
    trials: Trials, features: Features
) -> Iterator[tuple[int, tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """The row where each begins; its features, and targets and frames of the windows that end in it."""
    row = 0
    for example in trials:
        last = np.flatnonzero(scored_frames(example.measured.counts))
        if not len(last):
            continue
        values, pose = features_of(example.seen, features)
        told = targets_of(example.seen, example.measured, pose)[last]
        yield row, (values, told, last)
        row += len(values)


def _mapped(path: Path, kind: type, columns: int) -> np.ndarray:
    if path.stat().st_size == 0:
        return np.zeros((0, columns), dtype=kind)
    return np.memmap(path, dtype=kind, mode="r").reshape(-1, columns)
