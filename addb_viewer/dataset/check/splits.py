"""No person, and no recording, is in two splits."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from addb_viewer.dataset.check.duplicates import Content, duplicate_pairs
from addb_viewer.dataset.check.finding import Finding, error, warning
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.split_files import FOLDER, read_split


def split_findings(release: Path, persons: dict[str, str], contents: Sequence[Content]) -> Iterator[Finding]:
    """Every split of a release.

    Args:
        release: its folder.
        persons: by trial_id.
        contents: of all trials.
    """
    files = sorted((release / FOLDER).glob("*.parquet"))
    pairs = list(duplicate_pairs(contents)) if files else []
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
            yield warning("splits", where, f"{len(lacking)} persons are in none, {lacking[0]} for one")
        for one, other in pairs:
            places = [split.get(persons[c.trial_id]) for c in (one, other)]
            if places[0] != places[1]:
                yield error(
                    "splits",
                    where,
                    f"{one.trial_id} ({places[0]}) and {other.trial_id} ({places[1]}) are one recording",
                )
