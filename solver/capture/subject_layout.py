"""Which folders below a subject's are the subject's: the one rule of what a subject is.

Sub-folders hold trials of one subject where a subject.toml or _subject.json beside them describes a person,
or where they share the folder's static trial or model and show a person of the same lengths. Else each is a
subject of its own. A folder whose name says nothing but a kind of data, MarkerData say, is nobody's own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from solver.capture.b3d.places import belongs_to_b3d
from solver.capture.body_lengths import Lengths, body_lengths, odds_for_two
from solver.capture.loose_files import files_in, is_static_file, leads_out, natural_order
from solver.capture.recording_files import is_force_table, is_recording
from solver.capture.same_motion import markers_of
from solver.capture.trial_names import name_tokens

DESCRIBED_BY_HAND = "subject.toml"
DESCRIPTIONS = (DESCRIBED_BY_HAND, "_subject.json")
MADE_HERE = ("fit.json", "diagnosis.json")  # what a folder of results holds
MESHES = "geometry"
SET_ASIDE = frozenset(
    {
        "old",
        "backup",
        "archive",
        "reference",
        "references",
        "trash",
        "tmp",
        "temp",
        "unused",
        "alt",
        "results",
    }
)
DEEPEST = 3  # folders below the subject's that are looked into
TWO_PEOPLE = 3.0  # [log odds] 20 to 1, of body lengths


@dataclass(frozen=True)
class Layout:
    """The subject's folders, its own first, and what lies below it that is not the subject's."""

    places: tuple[Path, ...]
    others: Mapping[Path, str]  # folders with marker files, and why they are not this subject's
    notes: tuple[str, ...] = ()


def layout_of(folder: Path) -> Layout:
    """Find the folders that hold a subject's trials."""
    below = list(folders_below(folder))
    with_markers = [place for place in below if any(map(is_recording, files_in(place)))]
    with_tables = [
        place for place in below if place not in with_markers and any(map(is_force_table, files_in(place)))
    ]
    others = {place: "set aside, by its name" for place in with_markers if _set_aside(place, folder)}
    for place in with_markers:
        if any((parent / name).is_file() for parent in _up_to(place, folder) for name in DESCRIPTIONS):
            others[place] = "described as a subject of its own"
    asked = [place for place in with_markers if place not in others]
    named = [place for place in asked if name_tokens(" ".join(place.relative_to(folder).parts))]
    own = [place for place in asked if place not in named]
    taken, notes, strangers = _of_one_person(folder, own, named)
    places = [folder, *own, *taken, *(place for place in with_tables if not _set_aside(place, folder))]
    return Layout(tuple(places), others | strangers, notes)


def folders_below(folder: Path, deepest: int = DEEPEST) -> Iterator[Path]:
    """Folders in a folder that may hold recordings, in natural order, each before those in it."""
    inside = (p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
    for place in sorted(inside, key=lambda p: natural_order(p.name)):
        made_here = any((place / name).is_file() for name in MADE_HERE)
        if place.name.lower() == MESHES or made_here or place.is_symlink() or belongs_to_b3d(place):
            continue
        yield place
        if deepest > 1:
            yield from folders_below(place, deepest - 1)


def _of_one_person(
    folder: Path, own: Sequence[Path], named: Sequence[Path]
) -> tuple[Sequence[Path], tuple[str, ...], dict[Path, str]]:
    """Which of the named folders are trials of the subject, a note on it, and why others are not."""
    if not named:
        return (), (), {}
    listed = ", ".join(str(place.relative_to(folder)) for place in named)
    described = [name for name in DESCRIPTIONS if (folder / name).is_file()]
    if described:
        return named, (f"{listed}: trials of one person, described by {described[0]}",), {}
    shared = [p.name for p in files_in(folder) if p.suffix.lower() == ".osim"]
    shared += [p.name for p in files_in(folder) if is_recording(p) and is_static_file(p, folder)]
    if not shared:
        return (
            (),
            (),
            dict.fromkeys(named, "a subject of its own: no static trial or model beside it"),
        )
    recordings = {
        place: [p for p in files_in(place) if is_recording(p) and not leads_out(p, folder)]
        for place in (folder, *own, *named)
    }
    everyone = [path for paths in recordings.values() for path in paths]
    if len([place for place in named if recordings[place]]) == 1 and len(everyone) == len(
        recordings[named[0]]
    ):
        return named, (f"{listed}: trials of one person, with {shared[0]}",), {}
    if people(everyone) != 1:
        return (
            (),
            (),
            dict.fromkeys(named, f"a subject of its own: {shared[0]} is shared, but body lengths differ"),
        )
    return (
        named,
        (f"{listed}: trials of one person: they share {shared[0]} and lengths of the body agree",),
        {},
    )


def people(recordings: Sequence[Path]) -> int | None:
    """How many people marker files show, by lengths of their bodies; None where these cannot be compared."""
    found = [_lengths(path, (path.stat().st_mtime_ns, path.stat().st_size)) for path in recordings]
    lengths = [each for each in found if each is not None]
    groups = list(range(len(lengths)))
    compared = False
    for i in range(len(lengths)):
        for j in range(i):
            odds = odds_for_two(lengths[i], lengths[j])
            compared |= odds is not None
            if odds is not None and odds < 0:
                groups = [groups[j] if group == groups[i] else group for group in groups]
    return len(set(groups)) if compared else None


@lru_cache(maxsize=1024)
def _lengths(path: Path, stamp: tuple[int, int]) -> Lengths | None:
    """The lengths in a file; read again when its time or size has changed. None where it cannot be read."""
    markers = markers_of(path)
    return None if markers is None else body_lengths(markers)


def _set_aside(place: Path, folder: Path) -> bool:
    return any(SET_ASIDE & {*name_tokens(part), part.lower()} for part in place.relative_to(folder).parts)


def _up_to(place: Path, folder: Path) -> Iterator[Path]:
    while place != folder:
        yield place
        place = place.parent
