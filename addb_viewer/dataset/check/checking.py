"""All checks of a release, one after the other."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from addb_viewer.dataset.check import files, physics, plausible
from addb_viewer.dataset.check.b3d_tables import b3d_table_findings
from addb_viewer.dataset.check.duplicates import Pair, duplicate_findings, recording_in
from addb_viewer.dataset.check.finding import Finding, Level, error, warning
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.manifest_file import read_manifest
from addb_viewer.dataset.same_recording import Recording, same_recordings
from addb_viewer.dataset.split_files import FOLDER, read_split
from addb_viewer.text.amounts import counted

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
    found = list(files.hash_findings(release, manifest.get("files", {})))
    broken = list(files.schema_findings(release, manifest.get("files", {})))
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
        yield from plausible.subject_findings(row)
    for path in sorted((release / "frames").glob("*.parquet")):
        tables = {
            name: pq.read_table(release / name / path.name) for name in ("frames", "kinematics", "markers")
        }
        told(path.stem)
        trials = list(_trials(tables["frames"]))
        feet = subjects[owner[trials[0][0]]]["contact_bodies"] if trials else []
        yield from b3d_table_findings(release / "b3d" / f"{path.stem}.b3d", trials, feet)
        for trial_id, frames in trials:
            subject = subjects[owner[trial_id]]
            own = [one for one in coordinates if one["subject_id"] == subject["subject_id"]]
            yield from physics.force_findings(frames, subject)
            yield from physics.torque_findings(frames, subject, release / "models" / f"{path.stem}.osim", own)
            yield from plausible.frame_findings(frames)
            kinematics, markers = (
                dict(_trials(tables[name])).get(trial_id) for name in ("kinematics", "markers")
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


def _trials(table: pa.Table) -> Iterator[tuple[str, pa.Table]]:
    """Rows are sorted by trial."""
    ids = np.asarray(table["trial_id"].to_pylist(), dtype=object)
    starts = [0, *(np.flatnonzero(ids[1:] != ids[:-1]) + 1)] if len(ids) else []
    for start, end in zip(starts, [*starts[1:], len(ids)], strict=False):
        yield str(ids[start]), table.slice(start, end - start)


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
