"""No person, and no recording, is in two splits."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from addb_viewer.amounts import counted
from addb_viewer.dataset.check.duplicates import Pair
from addb_viewer.dataset.check.finding import Finding, error, warning
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.split_files import FOLDER, read_split


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
