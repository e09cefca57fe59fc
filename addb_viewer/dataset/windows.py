"""Windows of frames for learning: what PyTorch's DataLoader takes as it is, without importing PyTorch.

    windows = Windows(addb_viewer.dataset.open("RELEASE"), ["q_knee_angle_r"], ["grf_r_y_N"], split="train")
    loader = torch.utils.data.DataLoader(windows, batch_size=32, shuffle=True)
    for seen, wanted in loader: ...  # (32, frames, inputs), (32, targets)

A DataLoader asks a dataset for its length and its items, and makes tensors of NumPy arrays by itself.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from addb_viewer.dataset.reader import Release
from addb_viewer.dataset.release_errors import ReleaseError


class Windows:
    """Stretches of so many frames of one segment, and what is wanted of the last of them.

    The defaults are the dataset paper's: 0.5 s at 100 Hz, every fifth frame. All frames of a window count,
    and no value that is asked for is missing.
    """

    def __init__(
        self,
        release: Release,
        inputs: Sequence[str],
        targets: Sequence[str],
        *,
        frames: int = 50,
        every: int = 5,
        hop: int = 1,
        split: str | None = None,
        split_name: str = "default",
        where: Mapping[str, object] | None = None,
    ) -> None:
        """Read the columns and find the windows; values are kept in memory in single precision.

        Args:
            release: opened.
            inputs: columns of `frames` that are seen.
            targets: columns that are wanted on the last frame.
            frames: length of a window.
            every: of these frames one is seen, the last included.
            hop: frames from one window to the next.
            split: only the persons of "train", "dev", "test" or a fold.
            split_name: of which split.
            where: values by column, as for `Release.frames`.

        Raises:
            ReleaseError: a column or split does not exist, or there is no such window.
        """
        if min(frames, every, hop) < 1:
            raise ReleaseError("frames, every and hop of windows are 1 or more")
        columns = list(dict.fromkeys([*inputs, *targets]))
        rows = release.frames(columns, where=where, split=split, split_name=split_name)
        values = np.column_stack(
            [rows[name].to_numpy().astype(np.float32) for name in columns]
            or [np.zeros((rows.num_rows, 0), np.float32)]
        )
        self.inputs, self.targets = tuple(inputs), tuple(targets)
        self._in = values[:, [columns.index(name) for name in inputs]]
        self._out = values[:, [columns.index(name) for name in targets]]
        self.trial_id = np.asarray(rows["trial_id"].to_pylist(), dtype=object)
        self.frame: Int[np.ndarray, " rows"] = rows["frame"].to_numpy()
        self._back = np.arange(frames - 1, -1, -1)[(frames - 1) % every :: every]
        follows = np.zeros(len(values), dtype=bool)  # the row before, in one segment
        follows[1:] = (np.diff(self.frame) == 1) & (self.trial_id[1:] == self.trial_id[:-1])
        follows[1:] &= np.diff(rows["segment"].to_numpy()) == 0
        self.last = _last_rows(np.isfinite(values).all(axis=1), follows, frames, hop)
        if not len(self.last):
            raise ReleaseError(f"{release.path}: no {frames} frames in a row have all these columns")

    def __len__(self) -> int:
        """How many windows there are."""
        return len(self.last)

    def __getitem__(
        self, number: int
    ) -> tuple[Float[np.ndarray, "seen inputs"], Float[np.ndarray, " targets"]]:
        """What is seen, in order of time, and what is wanted on the last frame."""
        last = self.last[number]
        return self._in[last - self._back], self._out[last]


def _last_rows(
    fine: Bool[np.ndarray, " rows"], follows: Bool[np.ndarray, " rows"], frames: int, hop: int
) -> Int[np.ndarray, " windows"]:
    """Where windows end: so many fine rows that follow one another, every `hop` rows of such a run."""
    rows = np.arange(len(fine))
    begins = fine & ~(follows & np.concatenate([[False], fine[:-1]]))
    length = np.where(fine, rows - np.maximum.accumulate(np.where(begins, rows, 0)) + 1, 0)
    return np.flatnonzero((length >= frames) & ((length - frames) % hop == 0))
