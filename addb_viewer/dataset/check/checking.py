"""All checks of a release: its files, its tables, its B3D files beside them, its numbers, its splits."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from jaxtyping import Float

from addb_viewer.dataset.build_task import made_file
from addb_viewer.dataset.check.findings import (
    GRAVITY,
    Finding,
    Level,
    Pair,
    duplicate_findings,
    error,
    force_findings,
    frame_findings,
    recording_in,
    subject_findings,
    torque_findings,
    warning,
)
from addb_viewer.dataset.columns import Table
from addb_viewer.dataset.finishing import LOG
from addb_viewer.dataset.reader import MANIFEST, by_trial, column, read_manifest, vector
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_tables import ROOT_TABLES, SUBJECT_TABLES
from addb_viewer.dataset.same_recording import Recording, same_recordings
from addb_viewer.dataset.splits import FOLDER, read_split
from addb_viewer.text.amounts import counted
from solver.capture.formats.b3d.b3d_fields import B3dTrial
from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.common.errors import CaptureError

_PARENTS = {"subject_id": "subjects", "trial_id": "trials"}  # the table in which an id has its own row


def hash_findings(release: Path, files: Mapping[str, Mapping[str, Any]]) -> Iterator[Finding]:
    """Every file of the manifest is there with its bytes; no other is.

    Args:
        release: its folder.
        files: of the manifest: sha256 by path.
    """
    for path, told in sorted(files.items()):
        place = release / path
        if not place.is_file():
            yield error("files", path, "is missing")
        elif made_file(place).sha256 != told["sha256"]:
            yield error("files", path, "is not the file that the manifest has the hash of")
    for place in sorted(release.rglob("*")):
        path = place.relative_to(release).as_posix()
        known = path in files or path in (MANIFEST, LOG) or path.startswith(f"{FOLDER}/")
        if place.is_file() and not known:
            yield warning("files", path, "is not in the manifest")


def schema_findings(release: Path, files: Mapping[str, Mapping[str, Any]]) -> Iterator[Finding]:
    """Columns, types, nulls, order, keys, rows and ids of every table.

    Args:
        release: its folder.
        files: of the manifest: rows by path.
    """
    ids = {name: _ids(release / f"{name}.parquet", key) for key, name in _PARENTS.items()}
    for table, path in tables_in(release):
        where = path.relative_to(release).as_posix()
        try:
            held = pq.read_table(path)
        except (pa.ArrowInvalid, OSError) as broken:
            yield error("schema", where, f"cannot be read as Parquet ({broken})")
            continue
        wrong = list(_column_findings(table, held, where))
        yield from wrong
        if wrong:
            continue
        yield from _row_findings(table, held, where)
        rows = files.get(where, {}).get("rows")
        if rows is not None and rows != held.num_rows:
            yield error("schema", where, f"has {held.num_rows} rows, the manifest says {rows}")
        for key, name in _PARENTS.items():
            if key in held.column_names and table.name != name:
                orphans = set(pc.unique(held[key]).to_pylist()) - ids[name] - {None}
                if orphans:
                    yield error("schema", where, f"{key} '{min(orphans)}' is not in {name}.parquet")


def tables_in(release: Path) -> Iterator[tuple[Table, Path]]:
    """Every table of a release with its description.

    Args:
        release: its folder.
    """
    for table in ROOT_TABLES:
        if (release / table.path).is_file():
            yield table, release / table.path
    for table in SUBJECT_TABLES:
        for path in sorted((release / table.name).glob("*.parquet")):
            yield table, path


def _ids(path: Path, key: str) -> set[str]:
    try:
        return set(pq.read_table(path, columns=[key])[key].to_pylist())
    except (OSError, pa.ArrowInvalid):
        return set()


def _column_findings(table: Table, held: pa.Table, where: str) -> Iterator[Finding]:
    schema = table.schema()
    lacking = [name for name in schema.names if name not in held.column_names]
    beyond = [name for name in held.column_names if name not in schema.names]
    if lacking or beyond:
        words = [f"lacks {', '.join(lacking[:3])}"] if lacking else []
        words += [f"has {', '.join(beyond[:3])}, which the schema does not know"] if beyond else []
        yield error("schema", where, " and ".join(words))
        return
    if held.column_names != schema.names:
        yield error("schema", where, "has its columns in another order than the schema")
    for field in schema:
        kind = held.schema.field(field.name).type
        plain = kind.value_type if pa.types.is_dictionary(kind) else kind
        if plain != field.type and not (pa.types.is_list(plain) and pa.types.is_list(field.type)):
            yield error("schema", where, f"{field.name} is {plain}, the schema says {field.type}")
        elif not field.nullable and held[field.name].null_count:
            yield error("schema", where, f"{field.name} has nulls, which the schema does not allow")
        elif pa.types.is_floating(plain) and pc.any(pc.is_nan(held[field.name])).as_py():
            yield error("schema", where, f"{field.name} has NaN; what is not known is null")


def _row_findings(table: Table, held: pa.Table, where: str) -> Iterator[Finding]:
    if not held.num_rows:
        return
    grouped = held.group_by(list(table.key)).aggregate([([], "count_all")])
    if grouped.num_rows < held.num_rows:
        yield error("schema", where, f"has rows with the same {', '.join(table.key)}")
    order = pc.sort_indices(held, [(name, "ascending") for name in table.order]).to_numpy()
    if not _is_sorted(held, table, order):
        yield error("schema", where, f"is not sorted by {', '.join(table.order)}")


def _is_sorted(held: pa.Table, table: Table, order: np.ndarray) -> bool:
    """Equal rows may stand in any order."""
    sorted_rows = held.select(list(table.order)).take(pa.array(order))
    return bool(sorted_rows.equals(held.select(list(table.order)).combine_chunks()))


LENGTH_M, ACCELERATION_M_S2, FORCE_N = 1e-5, 1e-3, 0.01  # single precision in one of the two


def b3d_table_findings(
    path: Path, trials: Sequence[tuple[str, pa.Table]], contact_bodies: Sequence[str]
) -> Iterator[Finding]:
    """Every segment of the tables is in the file, with the same numbers; no other is.

    Args:
        path: of the subject's file.
        trials: id and rows of `frames` of each of its trials.
        contact_bodies: right, left.
    """
    where = f"b3d/{path.name}"
    try:
        file = read_b3d(path)
        pieces = {(t.header.original_name, t.header.split_index): t for t in file.trials}
    except (CaptureError, OSError) as unreadable:
        yield error("b3d", where, str(unreadable).removeprefix(f"{path}: "))
        return
    bodies = list(file.header.ground_contact_body)
    if sorted(bodies) != sorted(contact_bodies):
        yield error("b3d", where, f"forces act on {', '.join(bodies)}, in the tables on others")
        return
    places = [bodies.index(name) for name in contact_bodies]
    for trial_id, frames in trials:
        segments = column(frames, "segment").astype(int)
        for number in np.unique(segments):
            name = trial_id.rsplit("/", 1)[-1], int(number)
            if name not in pieces:
                yield error("b3d", where, f"has no segment {number} of {trial_id}")
                continue
            off = _first_difference(pieces.pop(name), frames.filter(pa.array(segments == number)), places)
            if off:
                yield error("b3d", where, f"{trial_id}, segment {number}: {off}")
    for strange, number in pieces:
        yield error("b3d", where, f"has segment {number} of '{strange}', which the tables do not have")


def _first_difference(piece: B3dTrial, frames: pa.Table, places: Sequence[int]) -> str:
    """In words; empty where all numbers agree."""
    if piece.header.trial_length != frames.num_rows:
        return f"{piece.header.trial_length} frames, the table has {frames.num_rows}"
    if (np.array(piece.header.missing_GRF_reason) != column(frames, "missing_number")).any():
        return "missing_GRF_reason is not the table's"
    last = piece.passes[-1]
    wrench = np.array(last.ground_contact_wrench).reshape(frames.num_rows, -1, 6)[:, places, 3:]
    pairs: list[tuple[str, Any, Float[np.ndarray, "rows 3"], float]] = [
        ("com_pos", last.com_pos, vector(frames, "com_{}_m"), LENGTH_M),
        ("com_acc", last.com_acc, vector(frames, "com_a_{}_m_s2") - GRAVITY, ACCELERATION_M_S2),
    ]
    pairs += [
        (f"force on the {words} foot", wrench[:, k], vector(frames, f"grf_{side}_{{}}_N"), FORCE_N)
        for k, (side, words) in enumerate((("r", "right"), ("l", "left")))
    ]
    for name, held, told, limit in pairs:
        apart = np.abs(np.array(held) - told)
        apart[np.isnan(told)] = 0.0  # the format has zeros where a table has nothing
        if not apart.max(initial=0.0) <= limit:
            return f"{name} is off the table's by {np.nanmax(apart):.3g}"
    return ""


Told = Callable[[str], None]


def checked(release: Path, told: Told = lambda _: None) -> list[Finding]:
    """What is wrong with a release, errors first. Where tables are not the schema's, nothing else is asked.

    Args:
        release: its folder.
        told: each subject that is looked at.

    Raises:
        ReleaseError: the folder is no release.
    """
    manifest = read_manifest(release)
    found = list(hash_findings(release, manifest.get("files", {})))
    broken = list(schema_findings(release, manifest.get("files", {})))
    found += broken
    if not any(one.level is Level.ERROR for one in broken):
        found += _content_findings(release, told)
    return sorted(found, key=lambda one: (one.level is not Level.ERROR, one.where, one.said))


def _content_findings(release: Path, told: Told) -> Iterator[Finding]:
    subjects = {row["subject_id"]: row for row in _rows(release, "subjects")}
    owner = {row["trial_id"]: row["subject_id"] for row in _rows(release, "trials")}
    coordinates = _rows(release, "coordinates")
    recordings: list[Recording] = []
    for row in subjects.values():
        yield from subject_findings(row)
    for path in sorted((release / "frames").glob("*.parquet")):
        tables = {
            name: pq.read_table(release / name / path.name) for name in ("frames", "kinematics", "markers")
        }
        told(path.stem)
        trials = list(by_trial(tables["frames"]))
        feet = subjects[owner[trials[0][0]]]["contact_bodies"] if trials else []
        yield from b3d_table_findings(release / "b3d" / f"{path.stem}.b3d", trials, feet)
        for trial_id, frames in trials:
            subject = subjects[owner[trial_id]]
            own = [one for one in coordinates if one["subject_id"] == subject["subject_id"]]
            yield from force_findings(frames, subject)
            yield from torque_findings(frames, subject, release / "models" / f"{path.stem}.osim", own)
            yield from frame_findings(frames)
            kinematics, markers = (
                dict(by_trial(tables[name])).get(trial_id) for name in ("kinematics", "markers")
            )
            if kinematics is not None and markers is not None:
                shown = recording_in(trial_id, kinematics, markers, release / "markers" / path.name)
                recordings += [shown] if shown is not None else []
    persons = {trial: str(subjects[subject]["person_id"]) for trial, subject in owner.items()}
    pairs = list(same_recordings(recordings))
    yield from duplicate_findings(pairs, persons)
    yield from split_findings(release, persons, pairs)


def _rows(release: Path, name: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = pq.read_table(release / f"{name}.parquet").to_pylist()
    return rows


def split_findings(release: Path, persons: dict[str, str], pairs: Sequence[Pair]) -> Iterator[Finding]:
    """Every split of a release.

    Args:
        release: its folder.
        persons: by trial_id.
        pairs: of trials that show the same.
    """
    files = sorted((release / FOLDER).glob("*.parquet"))
    for file in files:
        where = file.relative_to(release).as_posix()
        try:
            split = read_split(file)
        except ReleaseError as wrong:
            yield error("splits", where, str(wrong).removeprefix(f"{file}: "))
            continue
        known = set(persons.values())
        strange, lacking = sorted(set(split) - known), sorted(known - set(split))
        if strange:
            yield error("splits", where, f"{strange[0]} is not in the release")
        if lacking:
            are = "is" if len(lacking) == 1 else "are"
            named = f"{counted(len(lacking), 'person')} {are} in none, {lacking[0]} for one"
            yield warning("splits", where, named)
        for one, other in pairs:
            places = [split.get(persons[trial.trial_id]) for trial in (one, other)]
            if places[0] != places[1]:
                yield error(
                    "splits",
                    where,
                    f"{one.trial_id} ({places[0]}) and {other.trial_id} ({places[1]}) are one recording",
                )
