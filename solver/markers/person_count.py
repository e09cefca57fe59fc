"""Of how many people recordings are: by what files say of them, their names, and lengths of the body.

Of the lengths between bony landmarks only those count that no posture changes: within a segment, or from a
knee's to an ankle's marker. Markers that were placed again move them by a centimetre, another person by a few
per cent of every bone.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Capture, Markers, Subject, TrialFiles
from solver.capture.formats.text_table import some_of
from solver.capture.subject.body_lengths import Lengths, body_lengths, odds_for_two, short_lengths
from solver.capture.subject.description import Description, stated_by, stated_person
from solver.capture.subject.loose_files import find_models
from solver.capture.subject.same_motion import markers_of, people_in, static_among
from solver.capture.subject.trial_names import numbered_person
from solver.common.errors import CaptureError
from solver.common.file_names import distinct
from solver.common.notes import Kind, Note, noted
from solver.markers.atlas import atlas
from solver.markers.distances import posture_scatter_m
from solver.markers.label_parts import OTHER_SIDE
from solver.markers.understanding import understand

RIGID_M = 0.015  # scatter of a landmarks' distance over postures: what a knee's axis leaves to its markers
TWO_PEOPLE = 2.3  # [log odds] 10 to 1; of the shared recordings of one person none is above 1.1
SURE = 3.5  # [log odds] 33 to 1; damaged recordings of one person get as far as 2.6
NAMED = 1.0  # [log odds] different names in two files, or as far apart in mass: one person may get either
NUMBERED = 2.5  # [log odds] S01 and S02 in two files' names; may be sessions, which lengths then tell
IN_ONE_FILE = 20.0  # [log odds] seen together; or the trials of a file that is one person's
OTHER_MASS = 1.1  # ratio of two stated masses
LITTLE_DOUBT = 7.0  # [log odds] no figure beyond it means anything
WORDS = {2: "two", 3: "three", 4: "four"}
FIELD = re.compile(r"[-_. ]+")
UNUSUAL = re.compile(r"[^\w.-]+")  # in a folder's name


@dataclass(frozen=True)
class Recorded:
    """One person in one file."""

    markers: Markers
    file: Path | None = None
    prefix: str = ""  # before the person's labels

    @property
    def names(self) -> frozenset[str]:
        """What the file calls the person."""
        if self.prefix or self.file is None:
            return frozenset({self.prefix} - {""})
        return stated_person(self.file).names

    @property
    def number(self) -> tuple[str, str, int] | None:
        """As in S01_walk: the text, its word and its number."""
        return None if self.file is None else numbered_person(self.file.stem)

    @property
    def fields(self) -> tuple[str, str]:
        """The file's name up to its first separator, and the rest."""
        first, *rest = FIELD.split("" if self.file is None else self.file.stem, maxsplit=1)
        return first, "".join(rest)


@dataclass(frozen=True)
class People:
    """Recordings by person: names of recordings, and what each person may be called."""

    groups: tuple[tuple[str, ...], ...]
    called: tuple[str, ...]
    said: str = ""  # that they are several, and why; empty of one
    is_sure: bool = False


def people_among(recordings: Mapping[str, Recorded]) -> People:
    """Who is in recordings, the static trial among them; one person where they agree or cannot be compared.

    Args:
        recordings: by name.
    """
    names, known = list(recordings), list(recordings.values())
    lengths, mirrored = _bony_lengths([one.markers for one in known])
    by_lengths, by_names = (np.full((len(names), len(names)), np.nan) for _ in range(2))
    is_crossed = _crossed(known)
    short = cache(lambda k: short_lengths(known[k].markers))
    for i, j in combinations(range(len(names)), 2):
        found = odds_for_two(lengths[i], lengths[j])
        if found is not None:  # left and right may be exchanged in a whole recording
            found = min(found, odds_for_two(lengths[i], mirrored[j]) or found)
        if found is None:  # labels that nobody understands can tell that it is one person, not that it is two
            of_any = odds_for_two(short(i), short(j))
            found = np.nan if of_any is None else min(of_any, 0.0)
        by_lengths[[i, j], [j, i]] = found
        by_names[[i, j], [j, i]] = _by_names(known[i], known[j], is_crossed, not np.isnan(found))
    groups = _grouped(by_lengths, by_names, SURE)
    is_sure = len(groups) > 1
    if not is_sure:
        groups = _grouped(by_lengths, by_names, TWO_PEOPLE)
    said = "" if len(groups) < 2 else _said(names, lengths, groups, by_lengths, by_names)
    return People(
        tuple(tuple(names[i] for i in group) for group in groups),
        _called([[known[i] for i in group] for group in groups]),
        said,
        is_sure,
    )


def subjects_among(subject: Subject) -> tuple[Subject, ...]:
    """One subject for each person in a folder, in a folder in it of their name; the same one where it is one.

    The recordings stay where they are.

    Args:
        subject: as `open_subject` found it.
    """
    statics = [path for path in (subject.static, *subject.other_statics) if path is not None]
    trials = {trial.name: trial for trial in subject.trials}
    trials |= {f"{path.stem} (static)": TrialFiles(path.stem, path) for path in statics}
    units: dict[str, tuple[TrialFiles, Recorded]] = {}
    for name, trial in trials.items():
        people = people_in(trial.markers) or ("",)
        for prefix in people:
            markers = markers_of(trial.markers, prefix)
            if markers is not None:
                called = f"{name} of {prefix}" if len(people) > 1 else name
                wanted = replace(trial, prefix=prefix if len(people) > 1 else None)
                units[called] = wanted, Recorded(markers, trial.markers, prefix)
    found = people_among({name: recorded for name, (_, recorded) in units.items()})
    if not found.is_sure:
        return (
            replace(
                subject, notes=(*noted(Kind.SEVERAL_PEOPLE, *filter(None, [found.said])), *subject.notes)
            ),
        )
    folders = distinct(found.called, lambda called: UNUSUAL.sub("_", called).strip("._") or "person")
    models = {
        called: [path for path in find_models(subject.folder) if called.lower() in path.stem.lower()]
        for called in found.called
    }
    own = {called: paths[0] for called, paths in models.items() if len(paths) == 1}
    read = {path.relative_to(subject.folder).as_posix() for path in (*statics, *own.values())}
    subject = replace(
        subject,
        model=None if own else subject.model,
        unused=tuple(
            replace(file, file=f"../{file.file}") for file in subject.unused if file.file not in read
        ),
    )
    return tuple(
        _one_of(
            replace(subject, folder=subject.folder / folders[called], model=own.get(called, subject.model)),
            [units[name][0] for name in group],
            found.said,
        )
        for called, group in zip(found.called, found.groups, strict=True)
    )


def _one_of(subject: Subject, files: Sequence[TrialFiles], said: str) -> Subject:
    """The person of these recordings."""
    paths = [trial.markers for trial in files]
    static = static_among(paths, paths, subject.folder.parent)
    trials = tuple(t for t in files if t.markers not in (static.static, *static.others))
    about = stated_by(paths, Description())
    return replace(
        subject,
        trials=trials,
        static=static.static,
        other_statics=static.others,
        mass_kg=about.mass_kg,
        height_m=about.height_m,
        sex=about.sex,
        age_years=about.age_years,
        prefix=next((trial.prefix for trial in files if trial.prefix is not None), None),
        notes=(*noted(Kind.SEVERAL_PEOPLE, said), *static.notes, *about.notes),
    )


def of_one_person(subject: Subject, recorded: Sequence[Capture], static: Capture | None) -> tuple[Note, ...]:
    """A note where recordings are of several people although somebody says that they are of one.

    Args:
        subject: whose they should be.
        recorded: the trials.
        static: the static trial, if there is one.

    Raises:
        CaptureError: they are of several people, and nobody says otherwise.
    """
    by_name = {c.name: c for c in recorded} | ({f"{static.name} (static)": static} if static else {})
    if len(by_name) < 2:
        return ()
    found = people_among(
        {name: Recorded(c.markers, c.files[0] if c.files else None, c.prefix) for name, c in by_name.items()}
    )
    if not found.said:
        return ()
    if subject.is_described or not found.is_sure:
        return noted(
            Kind.SEVERAL_PEOPLE,
            f"{found.said}. One skeleton is fitted to all: give each person a folder of their own",
        )
    raise CaptureError(
        f"{subject.folder}: {found.said}. One skeleton cannot be fitted to all. addb-viewer init writes a "
        "subject.toml for each; then fit again. If they are one person, say so by a subject.toml in that "
        "folder; an empty one will do."
    )


def _by_names(one: Recorded, other: Recorded, is_crossed: bool, is_compared: bool) -> float:
    """Log odds for two people by all but their bodies; numbers mean more where these cannot be compared."""
    if one.file is not None and one.file == other.file:
        return -IN_ONE_FILE if one.prefix == other.prefix else IN_ONE_FILE  # several trials may be in it
    odds = 0.0
    if one.names and other.names:
        odds += -NAMED if one.names & other.names else NAMED
    numbers = one.number, other.number
    if numbers[0] and numbers[1] and numbers[0][1] == numbers[1][1]:
        apart = NUMBERED if is_compared else SURE
        odds += -NAMED if numbers[0][2] == numbers[1][2] else apart
    elif is_crossed and one.fields[0] != other.fields[0]:
        odds += NAMED
    masses = [stated_person(each.file).mass_kg for each in (one, other) if each.file is not None]
    known = [mass for mass in masses if mass is not None]
    if len(known) == 2 and max(known) > OTHER_MASS * min(known):
        odds += NAMED
    return odds


def _crossed(recordings: Sequence[Recorded]) -> bool:
    """Whether one name goes on alike after two beginnings, as anna_walk and bea_walk do."""
    by_rest: dict[str, set[str]] = {}
    for one in recordings:
        first, rest = one.fields
        if rest:
            by_rest.setdefault(rest.lower(), set()).add(first.lower())
    return any(len(firsts) > 1 for firsts in by_rest.values())


def _called(groups: Sequence[Sequence[Recorded]]) -> tuple[str, ...]:
    """What all files of each person call them, by the first way that tells them all apart."""
    ways = (
        lambda one: one.names,
        lambda one: {one.number[0]} if one.number else set(),
        lambda one: {one.fields[0]},
    )
    for way in ways:
        named = [[names for one in group if (names := way(one))] for group in groups]
        first = [min(set.intersection(*map(set, names)), default="") if names else "" for names in named]
        if all(first) and len(set(first)) == len(groups):
            return tuple(first)
    return tuple(f"person_{k + 1}" for k in range(len(groups)))


def _bony_lengths(recordings: Sequence[Markers]) -> tuple[list[Lengths], list[Lengths]]:
    """Each recording's lengths between bony landmarks that no posture changes; the same, left for right."""
    labels = dict.fromkeys(name for markers in recordings for name in markers.names)
    landmark = {
        row.label: row.landmark
        for row in understand(list(labels)).labels
        if row.landmark is not None and row.used and not atlas()[row.landmark].tracks_only
    }
    label_of = {mark: label for label, mark in landmark.items()}
    counterpart = {label: label_of.get(_other_side(mark), label) for label, mark in landmark.items()}
    found = []
    for markers in recordings:
        kept = [i for i, name in enumerate(markers.names) if name in landmark]
        bony = markers.chosen(kept)
        found.append(
            {
                (one, other): length
                for (one, other), length in body_lengths(bony).items()
                if posture_scatter_m(landmark[one], landmark[other]) < RIGID_M
            }
        )
    mirrored = []
    for lengths in found:
        pairs = ((counterpart[one], counterpart[other], length) for (one, other), length in lengths.items())
        mirrored.append({(min(one, other), max(one, other)): length for one, other, length in pairs})
    return found, mirrored


def _other_side(landmark: str) -> str:
    stem, _, side = landmark.rpartition("_")
    return f"{stem}_{OTHER_SIDE[side]}" if side in OTHER_SIDE else landmark


def _grouped(
    by_lengths: Float[np.ndarray, "n n"], by_names: Float[np.ndarray, "n n"], least: float
) -> list[tuple[int, ...]]:
    """Recordings joined, the likest first, while two people are not clearly likelier; means over pairs."""
    groups: list[tuple[int, ...]] = [(i,) for i in range(len(by_lengths))]
    sums = [np.nan_to_num(table) for table in (by_lengths, by_names)]
    counts = [np.isfinite(table).astype(float) for table in (by_lengths, by_names)]
    while len(groups) > 1:
        apart = sum(total / np.maximum(count, 1) for total, count in zip(sums, counts, strict=True))
        apart = apart + np.diag(np.full(len(groups), np.inf))
        i, j = sorted(int(k) for k in np.unravel_index(np.argmin(apart), apart.shape))
        if apart[i, j] >= least:
            break
        for table in (*sums, *counts):
            table[i] += table[j]
            table[:, i] += table[:, j]
        sums, counts = (
            [np.delete(np.delete(table, j, axis=0), j, axis=1) for table in tables]
            for tables in (sums, counts)
        )
        groups[i] = tuple(sorted((*groups[i], *groups.pop(j))))
    return sorted(groups)


def _said(
    names: Sequence[str],
    lengths: Sequence[Lengths],
    groups: Sequence[tuple[int, ...]],
    by_lengths: Float[np.ndarray, "n n"],
    by_names: Float[np.ndarray, "n n"],
) -> str:
    """That recordings are of several people, who is in which, and why."""
    listed = " | ".join(some_of([names[i] for i in group]) for group in groups)
    pairs = [(i, j) for one, other in combinations(groups, 2) for i in one for j in other]
    odds = [by_lengths[pair] for pair in pairs if np.isfinite(by_lengths[pair])]
    why = []
    likelier = float(np.mean(odds)) if odds else 0.0
    if likelier > 0:
        sure = f"{np.exp(likelier):.0f} to 1" if likelier < LITTLE_DOUBT else "more than 1000 to 1"
        off_mm = 1000 * _typically_off(lengths, pairs)
        against = f"odds of {sure} against markers placed again"
        why.append(f"lengths of the body differ by {off_mm:.0f} mm in the median, {against}")
    of_names = [by_names[pair] for pair in pairs]
    if max(of_names) >= IN_ONE_FILE:
        why.append("they are in one file together")
    elif np.mean(of_names) > 0:
        why.append("their files' names differ, or what these say of the person")
    count = WORDS.get(len(groups), str(len(groups)))
    return f"these trials seem to be of {count} people: {listed} ({'; '.join(why)})"


def _typically_off(lengths: Sequence[Lengths], pairs: Sequence[tuple[int, int]]) -> float:
    """Median difference of lengths between recordings of different people [m]."""
    off = [
        abs(lengths[i][pair] - lengths[j][pair])
        for i, j in pairs
        for pair in lengths[i].keys() & lengths[j].keys()
    ]
    return float(np.median(off))
