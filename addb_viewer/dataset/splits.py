"""Which persons are for training, development and test: a pure function of who there is."""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from addb_viewer.dataset.reader import read_table
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_tables import SPLITS
from solver.capture.atomic import whole_file, write_whole

TRAIN, DEV, TEST = "train", "dev", "test"
SHARES = {TRAIN: 90, DEV: 5, TEST: 5}  # of persons; the paper's
RULE = "persons sorted by source, longest activity and hash; each to the split that lacks most"
UNKNOWN = "unknown"
_FIRST_OF_EQUALS = (TEST, DEV, TRAIN)

Split = dict[str, str]  # split by person_id


@dataclass(frozen=True)
class Person:
    """One human of a release, with what a split is balanced and counted by."""

    person_id: str
    source: str
    activity: str  # of most of the person's time
    sex: str = UNKNOWN
    age: str = UNKNOWN  # decade: "20-29"


def persons_of(subjects: pa.Table, trials: pa.Table) -> tuple[Person, ...]:
    """Everybody in a release, by `person_id`.

    Args:
        subjects: the release's table: subject_id, person_id, source, sex, age_years.
        trials: likewise: subject_id, activity, duration_s.
    """
    rows = subjects.select(["subject_id", "person_id", "source", "sex", "age_years"]).to_pylist()
    whose = {row["subject_id"]: row["person_id"] for row in rows}
    seconds: dict[str, Counter[str]] = {row["person_id"]: Counter() for row in rows}
    for trial in trials.select(["subject_id", "activity", "duration_s"]).to_pylist():
        seconds[whose[trial["subject_id"]]][trial["activity"]] += trial["duration_s"]
    found: dict[str, Person] = {}
    for row in sorted(rows, key=lambda row: str(row["subject_id"])):
        person = row["person_id"]
        longest = min(seconds[person].items(), key=lambda a: (-a[1], a[0]), default=(UNKNOWN, 0.0))[0]
        told = Person(person, row["source"], longest, row["sex"] or UNKNOWN, _decade(row["age_years"]))
        found.setdefault(person, told)
    return tuple(found[person] for person in sorted(found))


def by_shares(
    persons: Sequence[Person],
    seed: int = 0,
    shares: Mapping[str, int] | None = None,
    previous: Mapping[str, str] | None = None,
) -> Split:
    """Everybody's split. Neighbours of one source and activity are spread over the splits.

    In the order of source, longest activity and a hash, each person gets the split with the largest deficit
    share · n − count, where n counts this person too: of twenty neighbours one is for test and one for dev.

    Args:
        persons: of the release.
        seed: of the order among persons of one source and activity.
        shares: weight of each split; None: 90 : 5 : 5.
        previous: an earlier split, which everybody in it keeps; new persons are placed on top of its counts.

    Raises:
        ReleaseError: the earlier split has a name that is none of these.
    """
    weights = dict(shares or SHARES)
    kept = dict(previous or {})
    strange = sorted(set(kept.values()) - set(weights))
    if strange:
        raise ReleaseError(
            f"the earlier split knows '{strange[0]}'; this one has {', '.join(weights)}. "
            "Make it with the same options as the earlier one"
        )
    whole, counts = sum(weights.values()), Counter(kept.values())
    order = {name: k for k, name in enumerate((*_FIRST_OF_EQUALS, *weights))}
    made: Split = {}
    for person in sorted(persons, key=lambda p: (p.source, p.activity, fraction(seed, p.person_id))):
        if person.person_id in kept:
            made[person.person_id] = kept[person.person_id]
            continue
        n = counts.total() + 1
        lacking = {name: weight * n - whole * counts[name] for name, weight in weights.items()}
        chosen = min(weights, key=lambda name: (-lacking[name], order[name]))
        counts[chosen] += 1
        made[person.person_id] = chosen
    return made


def k_fold(
    persons: Sequence[Person], folds: int, seed: int = 0, previous: Mapping[str, str] | None = None
) -> Split:
    """The fold in which each person is tested; all others train it.

    Args:
        persons: of the release.
        folds: how many.
        seed: as for `by_shares`.
        previous: likewise.

    Raises:
        ReleaseError: fewer than two folds, or fewer persons than folds.
    """
    if not 2 <= folds <= len(persons):
        raise ReleaseError(f"{folds} folds of {len(persons)} persons; give 2 to as many as there are persons")
    width = len(str(folds))
    return by_shares(persons, seed, {f"fold-{k + 1:0{width}d}": 1 for k in range(folds)}, previous)


def leave_one_person_out(persons: Sequence[Person]) -> Split:
    """A fold for every person, called as the person is.

    Args:
        persons: of the release.
    """
    return {person.person_id: person.person_id for person in persons}


def hold_out(
    persons: Sequence[Person],
    sources: Sequence[str],
    seed: int = 0,
    previous: Mapping[str, str] | None = None,
) -> Split:
    """Everybody of some sources for test, the others for train and dev, 90 : 5.

    Args:
        persons: of the release.
        sources: held out.
        seed: as for `by_shares`.
        previous: likewise, of the others.

    Raises:
        ReleaseError: there is no such source.
    """
    known = sorted({person.source for person in persons})
    strange = [source for source in sources if source not in known]
    if strange:
        raise ReleaseError(f"no source '{strange[0]}'; the release has {', '.join(known)}")
    held = {p.person_id: TEST for p in persons if p.source in sources}
    others = [p for p in persons if p.person_id not in held]
    kept = {person: split for person, split in (previous or {}).items() if person not in held}
    return held | by_shares(others, seed, {n: w for n, w in SHARES.items() if n != TEST}, kept)


def fraction(seed: int, person_id: str) -> Fraction:
    """SHA-256 of "seed/person_id" as a fraction in [0, 1): the same everywhere and for ever."""
    digest = hashlib.sha256(f"{seed}/{person_id}".encode()).digest()
    return Fraction(int.from_bytes(digest), 2 ** (8 * len(digest)))


def counts_of(persons: Sequence[Person], split: Mapping[str, str]) -> dict[str, dict[str, dict[str, int]]]:
    """How many persons each split has: in all, and by source, activity, sex and age decade.

    Args:
        persons: of the release.
        split: theirs.
    """
    ways: dict[str, Callable[[Person], str]] = {
        "all": lambda _: "all",
        "source": lambda p: p.source,
        "activity": lambda p: p.activity,
        "sex": lambda p: p.sex,
        "age": lambda p: p.age,
    }
    names = sorted(set(split.values()))
    found: dict[str, dict[str, dict[str, int]]] = {}
    for way, group in ways.items():
        counted = Counter((group(p), split[p.person_id]) for p in persons)
        groups = sorted({of for of, _ in counted})
        found[way] = {of: {name: counted[of, name] for name in names} for of in groups}
    return found


def _decade(age_years: float | None) -> str:
    if age_years is None:
        return UNKNOWN
    first = int(age_years // 10) * 10
    return f"{first}-{first + 9}"


FOLDER = "splits"


def persons_in(release: Path) -> tuple[Person, ...]:
    """Everybody in a release.

    Raises:
        ReleaseError: a table is missing or cannot be read.
    """
    return persons_of(read_table(release / "subjects.parquet"), read_table(release / "trials.parquet"))


def read_split(file: Path) -> Split:
    """A split by person_id.

    Args:
        file: `splits/NAME.parquet` of any release.

    Raises:
        ReleaseError: it cannot be read, or names a person twice.
    """
    table = read_table(file)
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
