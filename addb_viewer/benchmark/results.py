"""What an evaluation leaves on disk: `NAME.parquet` has its figures, `NAME.json` says of what."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from addb_viewer.benchmark.errors import BenchmarkError
from addb_viewer.benchmark.scoring import Score
from solver.capture.atomic import whole_file, write_whole

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
