"""A release for those who load it: Arrow tables and NumPy arrays, counting frames alone; and in words."""

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds
import pyarrow.parquet as pq
from jaxtyping import Float, Int

from addb_viewer.dataset.columns import COORDINATE_NAMES, Table
from addb_viewer.dataset.identifiers import file_name_of
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_tables import FORMAT_VERSION, FRAMES, TABLES
from addb_viewer.text.amounts import counted, lasting

MANIFEST = "manifest.json"


def read_manifest(release: Path) -> dict[str, Any]:
    """What a release says of itself.

    Raises:
        ReleaseError: the folder is no release, or one of a format that this version does not read.
    """
    path = release / MANIFEST
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        written = manifest["format_version"]
    except FileNotFoundError as error:
        raise ReleaseError(
            f"{release}: no release, since it has no {MANIFEST}. Give another folder."
        ) from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ReleaseError(f"{path}: cannot be read ({error}). Build the release anew.") from error
    if written != FORMAT_VERSION:
        remedy = "Update addb-viewer." if written > FORMAT_VERSION else "Build it anew into another folder."
        raise ReleaseError(f"{release}: has format {written}, this version reads {FORMAT_VERSION}. {remedy}")
    return manifest


_TABLES = {table.name: table for table in TABLES}
_KEYS = ("subject_id", "trial_id", "segment", "frame")


def read_table(path: Path) -> pa.Table:
    """A table of a release.

    Raises:
        ReleaseError: it is missing or cannot be read.
    """
    try:
        return pq.read_table(path)
    except FileNotFoundError as error:
        raise ReleaseError(f"{path}: no such file; give the folder of a release") from error
    except (pa.ArrowInvalid, OSError) as error:
        raise ReleaseError(f"{path}: cannot be read as Parquet ({error})") from error


def by_trial(table: pa.Table) -> Iterator[tuple[str, pa.Table]]:
    """Each trial's rows of a table that is sorted by trial."""
    ids = np.asarray(table["trial_id"].to_pylist(), dtype=object)
    starts = [0, *(np.flatnonzero(ids[1:] != ids[:-1]) + 1)] if len(ids) else []
    for start, end in zip(starts, [*starts[1:], len(ids)], strict=True):
        yield str(ids[start]), table.slice(start, end - start)


def column(table: pa.Table, name: str) -> Float[np.ndarray, " rows"]:
    """One column of numbers; NaN where it is null."""
    return np.asarray(pc.fill_null(table[name].cast(pa.float64()), np.nan).to_numpy(), dtype=float)


def vector(table: pa.Table, pattern: str) -> Float[np.ndarray, "rows 3"]:
    """Three columns; NaN where they are null.

    Args:
        table: that has them.
        pattern: of their names; `{}` is the axis.
    """
    return np.column_stack([column(table, pattern.format(axis)) for axis in "xyz"])


def coordinate_values(
    rows: pa.Table, prefix: str, names: Sequence[str], places: Mapping[str, int]
) -> Float[np.ndarray, "rows coordinates"]:
    """Values of a model's coordinates.

    Args:
        rows: of `frames` or `kinematics`.
        prefix: of the columns: q, qd, qdd or tau.
        names: of the coordinates.
        places: in the lists of others, of those that have no column of their own.
    """
    lists = rows[f"{prefix}_other"].to_pylist() if places else []
    others = np.array([row or [] for row in lists], dtype=float)
    return np.column_stack(
        [
            column(rows, f"{prefix}_{name}") if name in COORDINATE_NAMES else others[:, places[name]]
            for name in names
        ]
    )


def marker_places(
    rows: pa.Table, frames: Int[np.ndarray, " frames"], labels: Sequence[str]
) -> Float[np.ndarray, "frames labels 3"]:
    """Where markers were seen [m], NaN where they were not.

    Args:
        rows: of `markers`, of one trial.
        frames: that are wanted.
        labels: of the markers.
    """
    at = pc.index_in(rows["frame"], value_set=pa.array(frames, rows["frame"].type))
    which = pc.index_in(rows["marker"], value_set=pa.array(labels))
    at, which = (np.nan_to_num(one.to_numpy(), nan=-1).astype(int) for one in (at, which))
    placed, known = np.full((len(frames), len(labels), 3), np.nan), at >= 0
    placed[at[known], which[known]] = vector(rows, "measured_{}_m")[known]
    return placed


def open_release(path: Path) -> "Release":
    """A release, by its folder.

    Raises:
        ReleaseError: the folder is no release, or one of another format.
    """
    return Release(path, read_manifest(path))


@dataclass(frozen=True)
class Release:
    """Tables of a release; each is read when it is asked for."""

    path: Path
    manifest: Mapping[str, Any]

    def __repr__(self) -> str:
        """Name, version, and how much there is."""
        totals = self.manifest["totals"]
        return (
            f"<Release {self.manifest['name']} {self.manifest['version']}: {totals['subjects']} subjects, "
            f"{totals['trials']} trials, {totals['frames']} frames>"
        )

    @property
    def subjects(self) -> pa.Table:
        """A row a subject."""
        return self.table("subjects")

    @property
    def trials(self) -> pa.Table:
        """A row a trial."""
        return self.table("trials")

    def table(self, name: str) -> pa.Table:
        """A table of the whole release, or all subjects' rows of another; see `frames` for large ones.

        Raises:
            ReleaseError: there is no such table.
        """
        table = _known(name, _TABLES, "table")
        if "{" not in table.path:
            return pq.read_table(self.path / table.path)
        return self.scan(name).to_table()

    def scan(self, name: str, subjects: Collection[str] | None = None) -> ds.Dataset:
        """A table that has a file a subject, to be filtered before it is read.

        Args:
            name: of the table.
            subjects: their ids; None: all.

        Raises:
            ReleaseError: there is no such table, or no such subject.
        """
        table = _known(name, _TABLES, "table")
        if not table.of_subjects:
            raise ReleaseError(f"'{name}' is one file: ask for table('{name}')")
        files = {row["subject_id"]: path for row, path in self._files(table)}
        wanted = list(files) if subjects is None else [_wanted(one, files, "subject") for one in subjects]
        return ds.dataset([files[one] for one in wanted], schema=table.schema(), format="parquet")

    def frames(
        self,
        columns: Sequence[str] | None = None,
        *,
        where: Mapping[str, object] | None = None,
        counting: bool = True,
        split: str | None = None,
        split_name: str = "default",
    ) -> pa.Table:
        """Rows of `frames`: the columns that are asked for, beside subject, trial, segment and frame.

        Args:
            columns: their names; None: all.
            where: values, or lists of values, by column; rows that have another are left out.
            counting: only frames on which every foot's force was measured and is right.
            split: "train", "dev", "test" or a fold: only these persons' frames.
            split_name: which split.

        Raises:
            ReleaseError: a column or a split does not exist.
        """
        names = FRAMES.schema().names
        asked = [_wanted(name, names, "column") for name in columns] if columns is not None else names
        condition = pc.field("counts") if counting else pc.scalar(True)
        for name, value in (where or {}).items():
            values = [value] if isinstance(value, str | bool | int | float) else list(value)  # type: ignore[call-overload]
            condition = condition & pc.field(_wanted(name, names, "column")).isin(values)
        subjects = None if split is None else self._subjects_of(split, split_name)
        kept = list(dict.fromkeys([*_KEYS, *asked]))
        return self.scan("frames", subjects).to_table(columns=kept, filter=condition)

    def segments(self, columns: Sequence[str], **choice: Any) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
        """Segment after segment: its id, and an array a column; `frame` tells where frames are missing.

        Args:
            columns: of `frames`.
            choice: as for `frames`.
        """
        rows = self.frames(columns, **choice)
        if not rows.num_rows:
            return
        trial = rows["trial_id"].combine_chunks().dictionary_encode()
        place = np.asarray(trial.indices) * 2**16 + rows["segment"].to_numpy()
        starts = np.flatnonzero(np.diff(place, prepend=place[0] - 1))
        for start, end in zip(starts, [*starts[1:], len(place)], strict=True):
            piece = rows.slice(start, end - start)
            name = f"{piece['trial_id'][0].as_py()}/{piece['segment'][0].as_py()}"
            yield name, {column: piece[column].to_numpy() for column in ("frame", *columns)}

    def split(self, name: str = "default") -> dict[str, str]:
        """A split by person_id.

        Raises:
            ReleaseError: there is none of that name.
        """
        path = self.path / "splits" / f"{name}.parquet"
        if not path.is_file():
            there = sorted(p.stem for p in path.parent.glob("*.parquet"))
            made = f"there are {', '.join(there)}" if there else "make one: addb-viewer dataset split"
            raise ReleaseError(f"{self.path}: no split '{name}'; {made}")
        table = pq.read_table(path)
        return dict(zip(table["person_id"].to_pylist(), table["split"].to_pylist(), strict=True))

    def _subjects_of(self, split: str, name: str) -> list[str]:
        persons = self.split(name)
        _wanted(split, set(persons.values()), "split")
        rows = self.subjects.select(["subject_id", "person_id"]).to_pylist()
        return [row["subject_id"] for row in rows if persons.get(row["person_id"]) == split]

    def _files(self, table: Table) -> Iterator[tuple[dict[str, Any], str]]:
        for row in self.subjects.select(["subject_id"]).to_pylist():
            yield row, str(self.path / table.file(file_name_of(row["subject_id"])))


def _known(name: str, among: Mapping[str, Table], kind: str) -> Table:
    return among[_wanted(name, among, kind)]


def _wanted(name: str, among: Collection[str], kind: str) -> str:
    """The name, if it is there.

    Raises:
        ReleaseError: it is not; the nearest are told.
    """
    if name not in among:
        near = get_close_matches(name, list(among)) or sorted(among)[:5]
        raise ReleaseError(f"no {kind} '{name}'; nearest: {', '.join(near)}")
    return name


_FIGURES = (
    ("marker_rms_m", "marker error, RMS", "m"),
    ("linear_rms_bw", "residual force, RMS", "body weights"),
    ("angular_rms_bwh", "residual moment, RMS", "body weights · height"),
    ("held_out_linear_rms_N", "residual force on held-out blocks, RMS", "N"),
    ("average_speed_m_s", "average speed", "m/s"),
)


def overview(release: Release) -> Iterator[str]:
    """How much there is, from whom, on what terms, and what was left out; a line each."""
    manifest, totals = release.manifest, release.manifest["totals"]
    yield f"{manifest['name']} {manifest['version']}"
    yield (
        f"{counted(totals['subjects'], 'subject')}, {counted(totals['persons'], 'person')}, "
        f"{counted(totals['trials'], 'trial')}, {counted(totals['segments'], 'segment')}"
    )
    hours, count = lasting(totals["hours"]), lasting(totals["hours_counting"])
    yield f"{counted(totals['frames'], 'frame')}, {hours}; of these {count} count"
    rows = release.subjects.to_pylist()
    for source in sorted({row["source"] for row in rows}):
        own = [row for row in rows if row["source"] == source]
        licences = ", ".join(sorted({row["licence"] for row in own}))
        yield f"  {source}: {counted(len(own), 'subject')}, {licences}"
    trials = release.trials.to_pylist()
    activities = Counter(row["activity"] for row in trials)
    told = ", ".join(f"{name} {count}" for name, count in sorted(activities.items()))
    suggested = sum(row["activity_by"] not in ("person", "nobody") for row in trials)
    yield f"activities, trials: {told}; {suggested} of {len(trials)} as rules suggest"
    reasons: dict[str, int] = {}
    for row in release.table("left_out").to_pylist():
        reasons[row["reason"]] = reasons.get(row["reason"], 0) + 1
    left = ", ".join(f"{name} {count}" for name, count in sorted(reasons.items()))
    yield f"left out: {left or 'nothing'}"
    made = ", ".join(f"{name} {version}" for name, version in manifest["created_with"].items())
    yield f"made with {made}"


def trial_in_words(release: Release, name: str) -> Iterator[str]:
    """A trial: what is in it, from which files, how it was made, who decided what.

    Args:
        release: that holds it.
        name: its id, or the end of it where that is one trial's alone.

    Raises:
        ReleaseError: there is no such trial, or several.
    """
    trial = _trial(release, name)
    (subject,) = (r for r in release.subjects.to_pylist() if r["subject_id"] == trial["subject_id"])
    made = release.manifest["subjects"][subject["subject_id"]]
    yield trial["trial_id"]
    yield f"person {subject['person_id']}, licence {subject['licence']}, consent {subject['consent']}"
    yield (
        f"{trial['frames']} frames from {trial['rate_native_hz']:g} Hz, {trial['duration_s']:.2f} s; forces "
        f"and pass F below {trial['filter_cutoff_hz']:g} Hz"
    )
    sure = trial["activity_confidence"]
    by = f"by {trial['activity_by']}" + ("" if sure is None else f", {100 * sure:.0f} % sure")
    yield (
        f"activity {trial['activity']} ({by}); which forces count: "
        f"{trial['mask_source']}{'' if trial['reviewed'] else ', review not finished'}"
    )
    for column, words, unit in _FIGURES:
        if trial[column] is not None:
            yield f"{words}: {trial[column]:.4g} {unit}"
    for row in release.table("segments").to_pylist():
        if row["trial_id"] == trial["trial_id"]:
            span = f"frames {row['start_frame']} to {row['end_frame'] - 1}"
            yield f"segment {row['segment']}: {span}, {row['counted']} count"
    for row in release.table("reviews").to_pylist():
        if row["trial_id"] == trial["trial_id"]:
            who = f", {row['reviewer']}" if row["reviewer"] else ""
            yield (
                f"not counted: frames {row['start_frame']} to {row['end_frame'] - 1}, {row['foot']}, "
                f"{row['reason']} ({row['source']}{who})"
            )
    yield f"fit {made['key'][:16]}, settings {made['settings'][:16]} (manifest.json has both whole), from:"
    for path, digest in made["inputs"].items():
        yield f"  {path}  sha256 {digest[:16]}"


def _trial(release: Release, name: str) -> Mapping[str, Any]:
    rows = release.trials.to_pylist()
    found = [row for row in rows if row["trial_id"] == name]
    found = found or [row for row in rows if row["trial_id"].endswith(f"/{name}")]
    if len(found) == 1:
        return found[0]
    names = [row["trial_id"] for row in found or rows]
    near = names[:5] if found else get_close_matches(name, names, cutoff=0.3) or names[:5]
    why = "several trials end so" if found else "no such trial; nearest"
    raise ReleaseError(f"{name}: {why}: {', '.join(near)}")
