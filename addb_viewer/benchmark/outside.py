"""Answers made elsewhere, as a Parquet file: a row a frame and foot."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from addb_viewer.benchmark.errors import BenchmarkError
from addb_viewer.benchmark.task import FEET, Example, Predicted

KEYS = ("subject_id", "trial_id", "frame", "foot")
FORCE, MOMENT = ("fx", "fy", "fz"), ("nx", "ny", "nz")  # [N], [N·m] about the foot body's origin, ground axes


@dataclass(frozen=True)
class OutsideAnswers:
    """Forces and moments that another program predicted; the harness adds accelerations and torques."""

    name: str
    rows: pa.Table = field(repr=False)

    def of(self, example: Example) -> Predicted:
        """Its answer for a stretch of motion.

        Args:
            example: whose frames are looked up.

        Raises:
            BenchmarkError: a frame or foot is missing, or twice there.
        """
        own = self.rows.filter(pc.field("trial_id") == example.trial_id)
        values = np.full((example.seen.frames, len(FEET), 6), np.nan)
        place = np.asarray(own["frame"].to_numpy()) - example.frame[0]
        inside = (place >= 0) & (place < example.seen.frames)
        foot = np.array([FEET.index(one) for one in own["foot"].to_pylist()], dtype=int)
        if len(np.unique(np.stack([place[inside], foot[inside]]), axis=1).T) != inside.sum():
            raise BenchmarkError(f"{self.name}: {example.trial_id} has a frame and foot twice")
        columns = np.column_stack([own[name].to_numpy().astype(float) for name in (*FORCE, *MOMENT)])
        values[place[inside], foot[inside]] = columns[inside]
        lacking = np.argwhere(~np.isfinite(values).all(axis=2))
        if len(lacking):
            where = f"frame {example.frame[lacking[0][0]]}, foot {FEET[lacking[0][1]]}"
            raise BenchmarkError(
                f"{self.name}: no numbers for {example.trial_id}, {where}; "
                "every frame of the release's kinematics needs a row for each foot"
            )
        return Predicted(values[..., :3], values[..., 3:])


def read_outside(path: Path, name: str | None = None) -> OutsideAnswers:
    """Read such a file.

    Args:
        path: Parquet with subject_id, trial_id, frame, foot ("r" or "l"), fx, fy, fz, nx, ny, nz.
        name: of the predictor; None: the file's.

    Raises:
        BenchmarkError: it cannot be read, or a column is missing.
    """
    try:
        rows = pq.read_table(path)
    except (OSError, pa.ArrowInvalid) as error:
        raise BenchmarkError(f"{path}: cannot be read as Parquet ({error})") from error
    lacking = [one for one in (*KEYS, *FORCE, *MOMENT) if one not in rows.column_names]
    if lacking:
        raise BenchmarkError(
            f"{path}: no column '{lacking[0]}'; it needs {', '.join((*KEYS, *FORCE, *MOMENT))}"
        )
    strange = set(pc.unique(rows["foot"]).to_pylist()) - set(FEET)
    if strange:
        raise BenchmarkError(f"{path}: foot is '{strange.pop()}'; it must be r or l")
    return OutsideAnswers(name or path.stem, rows)


def answer_rows(example: Example, predicted: Predicted) -> pa.Table:
    """An answer as rows of such a file.

    Args:
        example: that was shown.
        predicted: what was said.
    """
    frames, feet = example.seen.frames, len(FEET)
    values = np.concatenate([predicted.force, predicted.moment], axis=2).reshape(frames * feet, 6)
    columns: Mapping[str, object] = {
        "subject_id": [example.subject_id] * (frames * feet),
        "trial_id": [example.trial_id] * (frames * feet),
        "frame": pa.array(np.repeat(example.frame, feet), pa.int32()),
        "foot": list(FEET) * frames,
        **{name: values[:, k] for k, name in enumerate((*FORCE, *MOMENT))},
    }
    return pa.table(columns)
