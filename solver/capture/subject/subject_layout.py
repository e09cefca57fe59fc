"""Which folders below a subject's are the subject's: the one rule of what a subject is.

Sub-folders hold trials of one subject where a subject.toml or _subject.json beside them describes a person,
or where they share the folder's static trial or model and show a person of the same lengths. Else each is a
subject of its own. A folder whose name says nothing but a kind of data, MarkerData say, is nobody's own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from solver.capture.formats.b3d.places import belongs_to_b3d
from solver.capture.formats.recording_files import is_force_table, is_recording
from solver.capture.subject.body_lengths import Lengths, odds_for_two, short_lengths
from solver.capture.subject.description import stated_person
from solver.capture.subject.loose_files import files_in, leads_out, natural_order
from solver.capture.subject.same_motion import is_static, is_static_file, markers_of, moves, same_motion
from solver.capture.subject.trial_names import name_tokens, numbered_person
from solver.common.notes import Kind, Note, noted
from solver.common.small_files import kept_while_unchanged

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


@dataclass(frozen=True)
class Layout:
    """The subject's folders, its own first, and what lies below it that is not the subject's."""

    places: tuple[Path, ...]
    others: Mapping[Path, str]  # folders with marker files, and why they are not this subject's
    notes: tuple[Note, ...] = ()


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
    taken, notes, of_others = _of_one_person(folder, own, named)
    places = [folder, *own, *taken, *(place for place in with_tables if not _set_aside(place, folder))]
    return Layout(tuple(places), others | of_others, notes)


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
) -> tuple[Sequence[Path], tuple[Note, ...], dict[Path, str]]:
    """Which of the named folders are trials of the subject, a note on it, and why others are not."""
    if not named:
        return (), (), {}
    listed = ", ".join(str(place.relative_to(folder)) for place in named)
    described = [name for name in DESCRIPTIONS if (folder / name).is_file()]
    if described:
        return named, noted(Kind.PERSON, f"{listed}: trials of one person, described by {described[0]}"), {}
    recordings = {
        place: [p for p in files_in(place) if is_recording(p) and not leads_out(p, folder)]
        for place in (folder, *own, *named)
    }
    everyone = [path for paths in recordings.values() for path in paths]
    kinds = _kinds_of_several(recordings)
    if kinds:
        return (
            named,
            noted(Kind.OTHER, f"{listed}: recordings of the same people, {', '.join(kinds)}, in each"),
            {},
        )
    shared, is_clear = _shared(folder, recordings, everyone)
    if not shared:
        alone = "a subject of its own: no static trial or model beside it, and no name of a person in both"
        return (), (), dict.fromkeys(named, alone)
    if len([place for place in named if recordings[place]]) == 1 and len(everyone) == len(
        recordings[named[0]]
    ):
        return named, noted(Kind.PERSON, f"{listed}: trials of one person, with {shared}"), {}
    found = people(everyone)
    if found != 1 and not (found is None and is_clear):
        why = "body lengths differ" if found else "nothing shows that it is one person"
        return (), (), dict.fromkeys(named, f"a subject of its own: {shared} is shared, but {why}")
    lengths = " and lengths of the body agree" if found else ""
    return named, noted(Kind.PERSON, f"{listed}: trials of one person: they share {shared}{lengths}"), {}


def _kinds_of_several(recordings: Mapping[Path, Sequence[Path]]) -> list[str]:
    """The people of whom each folder holds some, a folder of static trials several; else none.

    Then folders are kinds of trials, not people: static/S01, static/S02, walk/S01, walk/S02.
    """
    found = {
        place: {number[1:]: number[0] for path in paths if (number := numbered_person(path.stem))}
        for place, paths in recordings.items()
        if paths
    }
    people = {
        key: text
        for place, of_place in found.items()
        if is_static(place.name)
        for key, text in of_place.items()
    }
    shared = [len(people.keys() & of_place) for place, of_place in found.items() if not is_static(place.name)]
    if not shared or min(shared) == 0 or max(shared) < 2:
        return []
    return [people[key] for key in sorted(people)]


def _shared(
    folder: Path, recordings: Mapping[Path, Sequence[Path]], everyone: Sequence[Path]
) -> tuple[str, bool]:
    """What speaks for one person in several folders, empty if nothing; and whether that is enough alone.

    A model or static trial beside the folders, or the only one in a folder of its own beside them; a
    person's name in all C3D files; one motion in two folders.
    """
    models = [p.name for p in files_in(folder) if p.suffix.lower() == ".osim"]
    statics = [p for p in everyone if is_static_file(p, folder) and not moves(p)]
    of_static = {p.parent for p in statics}
    beside = [place for place in recordings if recordings[place]]
    names = [who.names for p in everyone if (who := stated_person(p)).names]
    in_all = frozenset.intersection(*names) if len(names) > 1 else frozenset()
    if in_all and len(of_static) < 2:
        return f"the name {sorted(in_all)[0]} in their C3D files", True
    if models or folder in of_static:
        return (models or [p.name for p in statics if p.parent == folder])[0], False
    if len(of_static) == 1:
        place = of_static.pop()
        near = [p for p in beside if p.parent == place.parent]
        if len(statics) == len(recordings[place]) and all(
            p in near or any(_share_a_motion(recordings[p], recordings[q]) for q in near) for p in beside
        ):
            return statics[0].name, False
    if len(beside) > 1 and all(_share_a_motion(recordings[beside[0]], recordings[p]) for p in beside[1:]):
        return "one motion", True
    return "", False


def _share_a_motion(some: Sequence[Path], others: Sequence[Path]) -> bool:
    """Whether one folder holds another export of what the other one holds."""
    return any(
        p.suffix.lower() != q.suffix.lower() and same_motion(markers_of(p), markers_of(q))
        for p in some
        for q in others
    )


def people(recordings: Sequence[Path]) -> int | None:
    """How many people marker files show, by lengths of their bodies; None where these cannot be compared."""
    found = [_lengths(path) for path in recordings]
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


@kept_while_unchanged(most=1024)
def _lengths(path: Path) -> Lengths | None:
    """The lengths in a file; None where it cannot be read."""
    markers = markers_of(path)
    return None if markers is None else short_lengths(markers)


def _set_aside(place: Path, folder: Path) -> bool:
    return any(SET_ASIDE & {*name_tokens(part), part.lower()} for part in place.relative_to(folder).parts)


def _up_to(place: Path, folder: Path) -> Iterator[Path]:
    while place != folder:
        yield place
        place = place.parent
