"""The tables of label families, and what a label means in each of them."""

import re
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from solver.markers.atlas import SIDES, atlas
from solver.markers.label_parts import Reading

ORDER = (1.0, 0.35, 0.2)  # weight of a family's first, second, third meaning of a label
DIGITS_DROPPED = 0.6  # RASI1 taken for RASI
CLUSTER_DIGITS_DROPPED = 0.9  # Shank2 taken for Shank: numbered tracking markers are usual
SIDE_UNKNOWN = 0.45  # each of both sides, where a label names none
WORDS = "words"
ALL_WORDS, A_WORD_LEFT = 0.85, 0.5
_END_DIGITS = re.compile(r"\d+$")


@dataclass(frozen=True)
class Meaning:
    """A landmark that a family means by a label, and how well table and label agree."""

    landmark: str
    family: str
    ease: float
    how: str


@dataclass(frozen=True)
class Family:
    """One table of labels.toml."""

    id: str
    name: str
    says: str
    source: str
    paired: dict[str, tuple[str, ...]]
    middle: dict[str, tuple[str, ...]]


@cache
def families() -> dict[str, Family]:
    """All families by id."""
    tables = tomllib.loads(_text("labels.toml"))
    return {
        id_: Family(
            id_, t["name"], t["says"], t["source"], _listed(t.get("paired", {})), _listed(t.get("middle", {}))
        )
        for id_, t in tables.items()
    }


def family_name(id_: str) -> str:
    """A family's name for people."""
    return "plain words" if id_ == WORDS else families()[id_].name


def meanings_in(family: Family, reading: Reading) -> list[Meaning]:
    """What a family means by a reading of a label; empty where it does not know it."""
    table = family.middle if reading.side is None else family.paired
    found = _looked_up(table, reading.key)
    unsided = 1.0
    if not found and reading.side is None:
        found, unsided = _looked_up(family.paired, reading.key), SIDE_UNKNOWN
    meanings = []
    for stem, weight, how in found:
        for name in _on_side(stem, reading.side):
            ease = reading.ease * weight * (unsided if name[-2:] in ("_r", "_l") else 1.0)
            meanings.append(Meaning(name, family.id, ease, how))
    return meanings


def meanings_in_words(reading: Reading) -> list[Meaning]:
    """What the words of a label say, in any order."""
    synonyms, phrases = _dictionary()
    words = [synonyms.get(word, word) for word in reading.words]
    said = frozenset(word for word in words if word)
    best: list[tuple[float, str, frozenset[str]]] = []
    for phrase, stem in phrases.items():
        if not phrase <= said:
            continue
        rest = said - phrase
        left = sum(not word.isdigit() for word in rest)
        tracks = any(atlas()[name].tracks_only for name in _on_side(stem, "r"))
        digits = 1.0 if len(rest) == left else CLUSTER_DIGITS_DROPPED if tracks else DIGITS_DROPPED
        best.append((ALL_WORDS * A_WORD_LEFT**left * digits, stem, phrase))
    if not best:
        return []
    top = max(ease for ease, _, _ in best)
    return [
        Meaning(
            name,
            WORDS,
            ease * reading.ease * (SIDE_UNKNOWN if reading.side is None and name[-2:] in ("_r", "_l") else 1),
            f"the words {' '.join(sorted(phrase))}",
        )
        for ease, stem, phrase in best
        if ease == top
        for name in _on_side(stem, reading.side)
    ]


def _looked_up(table: dict[str, tuple[str, ...]], key: str) -> list[tuple[str, float, str]]:
    """Stems of landmarks, weights, and the entry of the table that matched."""
    stem = _END_DIGITS.sub("", key)
    for entry in (key, f"{stem}#" if stem != key else None):
        if entry in table:
            return [(s, w, entry) for s, w in zip(table[entry], ORDER, strict=False)]
    if stem == key or stem not in table:
        return []
    found = []
    for s, w in zip(table[stem], ORDER, strict=False):
        tracks = atlas()[_on_side(s, "r")[0]].tracks_only
        found.append((s, w * (CLUSTER_DIGITS_DROPPED if tracks else DIGITS_DROPPED), stem))
    return found


def _on_side(stem: str, side: str | None) -> list[str]:
    if stem in atlas():
        return [stem]
    return [f"{stem}_{s}" for s in ([side] if side else SIDES)]


@cache
def _dictionary() -> tuple[dict[str, str], dict[frozenset[str], str]]:
    table = tomllib.loads(_text("words.toml"))
    synonyms: dict[str, str] = table["synonyms"]
    phrases = {
        frozenset(w for word in phrase.split() if (w := synonyms.get(word, word))): stem
        for phrase, stem in table["meanings"].items()
    }
    return synonyms, phrases


def _listed(table: dict[str, str | list[str]]) -> dict[str, tuple[str, ...]]:
    return {key: (value,) if isinstance(value, str) else tuple(value) for key, value in table.items()}


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
