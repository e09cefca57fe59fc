"""Which landmark each label of a recording means: by its name, and by how the marker moves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.capture.capture import Markers
from solver.markers.atlas import atlas
from solver.markers.distances import Candidate, apart_m, weigh_distances
from solver.markers.label_families import (
    AUGMENTED,
    WORDS,
    Meaning,
    computed_points,
    families,
    family_name,
    meanings_in,
    meanings_in_words,
)
from solver.markers.label_parts import (
    INSIDE,
    NO_TWIN,
    OTHER_SIDE,
    Reading,
    counterparts,
    plain,
    readings,
    repeats_a_name,
)

SURE_ENOUGH = 0.5  # below it a label is left out and its alternatives are listed
BY_TABLE = 0.97  # what a family's own table leaves to doubt: people misplace and exchange markers
WORDS_WEIGHT = 0.5  # of plain words against the family that explains most labels
OTHER_FAMILY = 0.4  # doubt about an entry of a family that explains little of the rest
COVERED = 0.4  # of the labels a family should explain before its word is taken without doubt
NOTABLE = 0.25  # of the best one's probability; alternatives that together have more widen the marker's place
A_GUESS = 0.6  # ease of a name that a table has but for its digits
LEAST = 0.02  # alternatives less likely than this are not worth a line


@dataclass(frozen=True)
class UnderstoodLabel:
    """What one label means, and how sure that is.

    `confidence` is the probability that the marker really sits at the landmark (for tracking markers: on its
    body). With a landmark of None nothing in the tables fits the label.
    """

    label: str
    landmark: str | None
    body: str | None
    confidence: float
    family: str | None
    why: str
    alternatives: tuple[tuple[str, float], ...] = ()
    same_as: str | None = None  # a surer label of the same landmark, which is used in its place
    computed: bool = False  # by software from other points: no marker

    @property
    def used(self) -> bool:
        """Whether a fit without a person's word relies on it."""
        return self.landmark is not None and self.confidence >= SURE_ENOUGH and self.same_as is None

    @property
    def certain(self) -> bool:
        """Whether nothing else seriously comes into question."""
        return sum(p for _, p in self.alternatives) < NOTABLE * self.confidence

    @property
    def spread_m(self) -> float:
        """How far the marker may lie from the landmark's place [m]; further where others are as likely."""
        if self.landmark is None:
            return 0.0
        if self.certain:
            return atlas()[self.landmark].spread_m
        known = self.confidence + sum(p for _, p in self.alternatives)
        doubt = sum(p * apart_m(self.landmark, name) ** 2 for name, p in self.alternatives) / known
        return float(np.sqrt(atlas()[self.landmark].spread_m ** 2 + doubt))


@dataclass(frozen=True)
class Understanding:
    """All labels of a subject's recordings, read together."""

    labels: tuple[UnderstoodLabel, ...]
    families: tuple[tuple[str, int], ...]  # id, and how many labels it explains; the best first

    @property
    def family(self) -> str | None:
        """Name of the family that explains most labels."""
        return family_name(self.families[0][0]) if self.families else None

    def by_label(self) -> dict[str, UnderstoodLabel]:
        """Each label's row."""
        return {row.label: row for row in self.labels}


def understand(labels: Sequence[str], recordings: Sequence[Markers] = ()) -> Understanding:
    """Read all labels together.

    The family is decided jointly: it is the one that explains most labels, and its meaning of an ambiguous
    label is preferred. Where recordings are given, the distances between the markers decide between
    alternatives and reveal labels on the wrong trajectory.

    Args:
        labels: as recorded, in order.
        recordings: with these labels; frames are thinned.
    """
    names = tuple(dict.fromkeys(labels))
    short = plain(names)
    read = _doubted_without_counterparts(
        {label: readings(short[label].removesuffix(AUGMENTED)) for label in names}
    )
    paired = counterparts(read, INSIDE)
    meanings = {label: _meanings(read[label], label in paired) for label in names}
    meanings |= {label: _with_inner_places(meanings[label]) for label in names if repeats_a_name(label)}
    explained = {f: _explained(f, meanings) for f in families()}
    most = max(explained.values(), default=0.0)
    weights = {f: (n / most) ** 2 if most else 0.0 for f, n in explained.items()} | {WORDS: WORDS_WEIGHT}
    covered = min(1.0, most / max(1.0, COVERED * len(names)))
    known = {label for label, found in meanings.items() if any(m.ease > A_GUESS for m in found)}
    computed = computed_points(short, recordings, known)
    candidates = {
        label: [] if label in computed else _candidates(meanings[label], weights, covered) for label in names
    }
    beliefs = weigh_distances(
        {label: found for label, found in candidates.items() if found}, recordings, paired
    )
    beliefs = _alike_on_both_sides(beliefs, paired)
    rows = [
        UnderstoodLabel(label, None, None, 0.0, None, f"computed: {computed[label]}", computed=True)
        if label in computed
        else _row(label, candidates[label], beliefs.get(label), bool(recordings))
        for label in names
    ]
    counted = sorted(((f, round(n)) for f, n in explained.items() if n >= 1), key=lambda item: -item[1])
    return Understanding(_once_each(rows), tuple(counted))


def _doubted_without_counterparts(read: dict[str, list[Reading]]) -> dict[str, list[Reading]]:
    """Sides are believed less where nothing on the other side is called alike."""
    called: dict[tuple[str | None, str], set[str]] = {}
    for label, found in read.items():
        for r in found:
            called.setdefault((r.side, r.key), set()).add(label)

    def believed(label: str, r: Reading) -> Reading:
        if r.side is None or called.get((OTHER_SIDE[r.side], r.key), set()) - {label}:
            return r
        return replace(r, ease=r.ease * NO_TWIN)

    return {label: [believed(label, r) for r in found] for label, found in read.items()}


def _meanings(found: list[Reading], has_counterpart: bool) -> list[Meaning]:
    """What all tables make of a label; with one on the other side, its side is no part of a word."""
    meanings = []
    for reading in found:
        said = [m for family in families().values() for m in meanings_in(family, reading)]
        said += meanings_in_words(reading)
        of_a_side = (m for m in said if m.landmark[-2:] in ("_r", "_l"))
        drop = {m.landmark for m in of_a_side} if has_counterpart and reading.side is None else set()
        meanings += [m for m in said if m.landmark not in drop]
    return meanings


def _with_inner_places(meanings: list[Meaning]) -> list[Meaning]:
    """Of a name that occurs twice: the second marker may as well be on the inner side of the joint."""
    inner = [
        replace(m, landmark=m.landmark.replace("_lateral", "_medial"), how=f"{m.how}, for the second time")
        for m in meanings
        if m.landmark.replace("_lateral", "_medial") != m.landmark
    ]
    return meanings + inner


def _alike_on_both_sides(
    beliefs: dict[str, dict[str, float]], counterparts: dict[str, str]
) -> dict[str, dict[str, float]]:
    """What a label means if it is right is the same on both sides; whether it is right is not."""
    shared = {}
    for label, belief in beliefs.items():
        right = sum(belief.values())
        other = beliefs.get(counterparts.get(label, ""), {})
        of_other = {_mirror(name): value for name, value in other.items()}
        if not right or of_other.keys() != belief.keys() or not sum(other.values()):
            shared[label] = belief
            continue
        total = right + sum(other.values())
        shared[label] = {name: right * (value + of_other[name]) / total for name, value in belief.items()}
    return shared


def _mirror(name: str) -> str:
    return name[:-1] + OTHER_SIDE[name[-1]] if name[-2:] in ("_r", "_l") else name


def _explained(family: str, meanings: dict[str, list[Meaning]]) -> float:
    """How many labels a family explains."""
    return sum(max((m.ease for m in found if m.family == family), default=0.0) for found in meanings.values())


def _candidates(meanings: list[Meaning], weights: dict[str, float], covered: float) -> list[Candidate]:
    """Landmarks that a label may mean, with probabilities that leave room for none of them."""
    score: dict[str, float] = {}
    best: dict[str, Meaning] = {}
    for meaning in meanings:
        value = weights[meaning.family] * meaning.ease
        if value > score.get(meaning.landmark, 0.0):
            score[meaning.landmark], best[meaning.landmark] = value, meaning
    if not score:
        return []
    sure = max(
        BY_TABLE * m.ease * (1 - OTHER_FAMILY * (1 - weights[m.family])) * (0.5 + 0.5 * covered)
        for m in best.values()
    )
    total = sum(score.values())
    found = [
        Candidate(name, min(sure * value / total, BY_TABLE), best[name].family, best[name].how)
        for name, value in score.items()
    ]
    return sorted(found, key=lambda c: -c.probability)


def _row(
    label: str, candidates: list[Candidate], belief: dict[str, float] | None, looked: bool
) -> UnderstoodLabel:
    if not candidates or belief is None:
        return UnderstoodLabel(label, None, None, 0.0, None, "no table has such a label")
    ranked = sorted(candidates, key=lambda c: -belief[c.landmark])
    best = ranked[0]
    landmark = atlas()[best.landmark]
    confidence = _on_body(best, ranked, belief) if landmark.tracks_only else belief[best.landmark]
    why = f"{family_name(best.family)}: {best.how}; {landmark.says}"
    if looked and belief[best.landmark] < 0.5 * best.probability:
        why += "; but its distances to the other markers do not fit"
    others = tuple(
        (c.landmark, round(float(belief[c.landmark]), 3)) for c in ranked[1:] if belief[c.landmark] >= LEAST
    )
    return UnderstoodLabel(label, best.landmark, landmark.body, float(confidence), best.family, why, others)


def _on_body(best: Candidate, ranked: list[Candidate], belief: dict[str, float]) -> float:
    body = atlas()[best.landmark].body
    return float(np.sum([belief[c.landmark] for c in ranked if atlas()[c.landmark].body == body]))


def _words(label: str) -> int:
    return min((len(reading.words) for reading in readings(label)), default=0)


def _once_each(rows: list[UnderstoodLabel]) -> tuple[UnderstoodLabel, ...]:
    """Of several labels for one bony landmark, the surest is used; of equally sure ones, the plainest.

    So of a hip centre that was found by moving the hip ("HJC") and one from a regression ("HJC_reg"), the
    first counts, on both sides alike.
    """
    owner: dict[str, str] = {}
    for row in sorted(rows, key=lambda r: (-round(r.confidence, 2), _words(r.label), -r.confidence)):
        if (
            row.landmark is not None
            and row.confidence >= SURE_ENOUGH
            and not atlas()[row.landmark].tracks_only
        ):
            owner.setdefault(row.landmark, row.label)
    return tuple(
        replace(
            row,
            same_as=owner[row.landmark],
            why=f"{row.why}; {owner[row.landmark]} is more certain or clearer",
        )
        if row.landmark in owner and owner[row.landmark] != row.label
        else row
        for row in rows
    )
