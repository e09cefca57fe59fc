"""What an evaluation leaves on disk, and answers that were made elsewhere, as Parquet."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from addb_viewer.benchmark.scoring import Score
from addb_viewer.benchmark.task import FEET, BenchmarkError, Example, Predicted
from solver.capture.atomic import whole_file, write_whole

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


_TYPES = {str: pa.string(), float: pa.float64(), int: pa.int64()}
SCHEMA = pa.schema([pa.field(one.name, _TYPES[one.type], nullable=False) for one in fields(Score)])  # type: ignore[index]


@dataclass(frozen=True)
class Terms:
    """Under which figures were made; only those of equal terms stand in one table."""

    release: str
    version: str
    split: str
    parts: tuple[str, ...]
    skeleton: str
    frames: str


@dataclass(frozen=True)
class Result:
    """A predictor's figures."""

    name: str
    terms: Terms
    scores: tuple[Score, ...] = field(repr=False)
    seconds: float  # of predicting
    sees_markers: bool = False
    notes: tuple[str, ...] = ()


def write_result(result: Result, folder: Path) -> Path:
    """Write both files.

    Args:
        result: of an evaluation.
        folder: made if it is not there.

    Returns:
        The table's path.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{result.name}.parquet"
    table = pa.Table.from_pylist([asdict(score) for score in result.scores], schema=SCHEMA)
    with whole_file(path) as file:
        pq.write_table(table, file, compression="zstd")
    about = {key: value for key, value in asdict(result).items() if key != "scores"}
    write_whole(path.with_suffix(".json"), json.dumps(about, indent=1, ensure_ascii=False) + "\n")
    return path


def read_results(folder: Path) -> tuple[Result, ...]:
    """All results in a folder, by name.

    Args:
        folder: that evaluations wrote to.

    Raises:
        BenchmarkError: there is none, or their terms or frames differ.
    """
    found = tuple(
        _read(path) for path in sorted(folder.glob("*.json")) if path.with_suffix(".parquet").exists()
    )
    if not found:
        raise BenchmarkError(f"{folder}: no results; make some: addb-viewer benchmark evaluate")
    for other in found[1:]:
        if other.terms != found[0].terms:
            raise BenchmarkError(
                f"{folder}: {found[0].name} and {other.name} are of different terms "
                f"({_difference(found[0].terms, other.terms)}); tables need one folder for each"
            )
        if _frames(other) != _frames(found[0]):
            raise BenchmarkError(
                f"{folder}: {found[0].name} and {other.name} were scored on different frames; "
                "evaluate both anew"
            )
    return found


def _frames(result: Result) -> dict[tuple[str, str], int]:
    """Scored frames of each trial and activity."""
    there = Counter[tuple[str, str]]()
    for score in result.scores:
        if score.metric == "grf":
            there[score.trial_id, score.activity] += score.frames
    return dict(there)


def _read(path: Path) -> Result:
    about: dict[str, Any] = json.loads(path.read_text())
    rows: Sequence[dict[str, Any]] = pq.read_table(path.with_suffix(".parquet")).to_pylist()
    terms = Terms(**about["terms"] | {"parts": tuple(about["terms"]["parts"])})
    return Result(
        **about
        | {"terms": terms, "scores": tuple(Score(**row) for row in rows), "notes": tuple(about["notes"])}
    )


def _difference(one: Terms, other: Terms) -> str:
    there = [f.name for f in fields(Terms) if getattr(one, f.name) != getattr(other, f.name)]
    return ", ".join(f"{name}: {getattr(one, name)} and {getattr(other, name)}" for name in there)
