"""Windows of frames for training, on disk: features of all frames once, and where each window ends."""

import json
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from addb_viewer.benchmark.learnt.features import SIZES, TARGETS, Features, features_of, targets_of
from addb_viewer.benchmark.scoring import HISTORY, STRIDE, scored_frames
from addb_viewer.benchmark.task import Trials
from solver.capture.atomic import write_whole

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
