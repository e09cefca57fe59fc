"""A release's splits on disk: `splits/NAME.parquet` has a row a person, `NAME.json` how it was made."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.schema import SPLITS
from addb_viewer.dataset.splits import RULE, Person, Split, counts_of, persons_of
from solver.capture.atomic import whole_file, write_whole

FOLDER = "splits"


def persons_in(release: Path) -> tuple[Person, ...]:
    """Everybody in a release.

    Raises:
        ReleaseError: a table is missing or cannot be read.
    """
    return persons_of(_table(release / "subjects.parquet"), _table(release / "trials.parquet"))


def read_split(file: Path) -> Split:
    """A split by person_id.

    Args:
        file: `splits/NAME.parquet` of any release.

    Raises:
        ReleaseError: it cannot be read, or names a person twice.
    """
    table = _table(file)
    lacking = [name for name in SPLITS.schema().names if name not in table.column_names]
    if lacking:
        raise ReleaseError(f"{file}: no column '{lacking[0]}'; give a splits/NAME.parquet of a release")
    found: Split = {}
    for person, split in zip(*(table[name].to_pylist() for name in SPLITS.schema().names), strict=True):
        if person in found:
            raise ReleaseError(f"{file}: {person} is in it twice")
        found[person] = split
    return found


def write_split(
    release: Path, name: str, split: Split, persons: tuple[Person, ...], made_with: Mapping[str, Any]
) -> Path:
    """Write both files of a split.

    Args:
        release: its folder.
        name: of the split.
        split: by person_id.
        persons: of the release.
        made_with: the options, as JSON has them.

    Returns:
        The table's path.

    Raises:
        CaptureError: the folder cannot be written to.
    """
    folder = release / FOLDER
    folder.mkdir(exist_ok=True)
    rows = sorted(split.items())
    table = pa.table([[p for p, _ in rows], [s for _, s in rows]], schema=SPLITS.schema())
    path = folder / f"{name}.parquet"
    with whole_file(path) as file:
        pq.write_table(table, file, compression="zstd", compression_level=3)
    told = {"name": name, "rule": RULE, **made_with, "persons": counts_of(persons, split)}
    write_whole(path.with_suffix(".json"), json.dumps(told, indent=1, ensure_ascii=False) + "\n")
    return path


def without_persons(release: Path, gone: Callable[[str], bool]) -> None:
    """Take persons out of all splits of a release, and of what is told of these.

    Args:
        release: its folder.
        gone: whether a person is to go.
    """
    persons = persons_in(release)
    for file in sorted((release / FOLDER).glob("*.parquet")):
        split = read_split(file)
        kept = {person: part for person, part in split.items() if not gone(person)}
        if len(kept) < len(split):
            told = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
            made_with = {key: told[key] for key in told if key not in ("name", "rule", "persons")}
            write_split(release, file.stem, kept, tuple(p for p in persons if p.person_id in kept), made_with)


def _table(file: Path) -> pa.Table:
    try:
        return pq.read_table(file)
    except FileNotFoundError as error:
        raise ReleaseError(f"{file}: no such file; give the folder of a release") from error
    except (pa.ArrowInvalid, OSError) as error:
        raise ReleaseError(f"{file}: cannot be read as Parquet ({error})") from error
