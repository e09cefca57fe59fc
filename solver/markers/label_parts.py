"""A label taken apart: its words and digits, and the ways in which it may name a side."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from unicodedata import combining, normalize

_WORDS = {  # of the sides: English, German and Dutch, French, Spanish, Portuguese, Italian
    "r": "r right rt rx rgt rechts re droit droite derecha derecho der direita direito dir dx destra destro",
    "l": "l left lt lx lft links li gauche izquierda izquierdo izq esquerda esquerdo sx sinistra sinistro",
}
RIGHT, LEFT = (frozenset(words.split()) for words in _WORDS.values())
_GLUED = tuple(
    (w, side) for side, ws in _WORDS.items() for w in (*(w for w in ws.split() if len(w) > 3), side)
)
LETTERS = ("rl", "dg", "di", "de", "ds")  # of the right and the left side, where one letter says it
OTHER_SIDE = {"r": "l", "l": "r"}

_PIECES = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_IN_A_LIST = re.compile(r"\d+\s*[-_.)]\s*(.*[A-Za-z].*)")  # "3 - L_Elbow"
_FIRST_LETTER = re.compile(r"(?P<before>)(?P<side>[a-z])(?P<after>.*[a-z].*)")
_LAST_LETTER = re.compile(r"(?P<before>.*[a-z0-9].*)(?P<side>[a-z])(?P<after>\d*)")
_SEPARATOR = re.compile(r"[-_. |/]")
_TWIN = re.compile(r"#\d+$")  # the reader's mark of a name that occurs twice
# What plainly names a pelvic spine or the sacrum, whatever else is said ("Pelvis_RASIS", "hip.l.PSI") ...
_SPINES = frozenset(
    ("asis", "asi", "psis", "psi", "sacrum", "sacral", "sacr", "eias", "eips", "sias", "sips")
)
_IN_THE_MIDLINE = frozenset(("sacrum", "sacral", "sacr"))
# ... unless that makes it another point than the spine itself
_ANOTHER_POINT = frozenset(
    (
        "mid",
        "middle",
        "mean",
        "between",
        "virtual",
        "offset",
        "proj",
        "projection",
        "centre",
        "center",
        "wand",
    )
)
_BEHIND = frozenset(("back", "rear", "post", "posterior"))  # of an anterior spine: the posterior one
ON_BOTH_SIDES = 0.25  # of the labels; so many with a counterpart, and a shared beginning is no side
SURE, INSIDE, GLUED_BEHIND, TWIN, NO_TWIN = 1.0, 0.9, 0.6, 0.3, 0.8


@dataclass(frozen=True)
class Reading:
    """One way to read a label: which side it names, what is left of it, and how usual that way is."""

    side: str | None  # "r", "l" or None
    words: tuple[str, ...]  # lower case, digits apart
    ease: float  # 1: as everybody writes it

    @property
    def key(self) -> str:
        """The words run together, as families' tables write them."""
        return "".join(self.words)


def repeats_a_name(label: str) -> bool:
    """Whether the recording has the same name before, for another point."""
    return bool(_TWIN.search(label))


def readings(label: str) -> list[Reading]:
    """Every way to read a label, the whole of it without a side included.

    Args:
        label: as recorded; what stands before a colon is the subject's name.
    """
    text = label.rpartition(":")[2].strip()
    bare = _TWIN.sub("", text)
    ease = TWIN if bare != text else SURE
    words = tuple(piece.lower() for piece in _PIECES.findall(bare))
    if not words:
        return []
    sided = (*_sided(words), *_spine(words))
    found = {Reading(None, words, ease)} | {Reading(r.side, r.words, r.ease * ease) for r in sided}
    best: dict[tuple[str | None, str], Reading] = {}
    for reading in found:
        known = best.get((reading.side, reading.key))
        if known is None or known.ease < reading.ease:
            best[reading.side, reading.key] = reading
    return sorted(best.values(), key=lambda r: (-r.ease, r.side or "", r.key))


def _sided(words: tuple[str, ...]) -> Iterator[Reading]:
    last = len(words) - 1
    for i, word in enumerate(words):
        side = "r" if word in RIGHT else "l" if word in LEFT else None
        if side and last:
            yield Reading(side, words[:i] + words[i + 1 :], SURE if i in (0, last) else INSIDE)
    first = words[0]
    for full, side in _GLUED:
        if first.startswith(full) and len(first) > len(full):
            yield Reading(side, (first[len(full) :], *words[1:]), SURE)
    end = max((i for i, word in enumerate(words) if word.isalpha()), default=0)
    for full, side in _GLUED:
        if words[end].endswith(full) and len(words[end]) > len(full) + 1:
            yield Reading(side, (*words[:end], words[end][: -len(full)], *words[end + 1 :]), GLUED_BEHIND)


def _spine(words: tuple[str, ...]) -> Iterator[Reading]:
    """The one spine of the pelvis that a label of several words names, with its side, or the sacrum."""
    if len(words) == 1 or _ANOTHER_POINT & set(words):
        return
    named = [
        (side, word[len(glued) :])
        for word in words
        for glued, side in (("", None), *_GLUED)
        if word.startswith(glued) and word[len(glued) :] in _SPINES
    ]
    sides = {side for side, _ in named} | {"r" if w in RIGHT else "l" for w in words if w in RIGHT | LEFT}
    sides.discard(None)
    if len(named) != 1 or len(sides) > 1:
        return
    stem = named[0][1]
    if _BEHIND & set(words) and stem not in ("psis", "psi", "eips", "sips"):
        return
    if stem in _IN_THE_MIDLINE and not sides:
        yield Reading(None, (stem,), INSIDE)
    elif stem not in _IN_THE_MIDLINE and sides:
        yield Reading(sides.pop(), (stem,), INSIDE)


def without_common_start(labels: tuple[str, ...]) -> dict[str, str]:
    """Each label without a beginning that all of them share ("Sub01_RASI"), up to a separator.

    A beginning that is a side stays where it is the only one: of "L_Heel" and "L_Knee" all are left.

    Args:
        labels: of one or more recordings; those with a colon lose what stands before it.
    """
    short = {label: label.rpartition(":")[2] for label in labels}
    if len(short) < 3:
        return short
    texts = sorted(short.values())
    shared = 0
    while shared < min(len(texts[0]), len(texts[-1])) and texts[0][shared] == texts[-1][shared]:
        shared += 1
    cuts = [found.end() for found in _SEPARATOR.finditer(texts[0][:shared])]
    for cut in reversed(cuts):
        rest = [text[cut:] for text in texts]
        if not _names_a_side(texts[0][:cut]) or _on_both_sides(rest):
            return {label: text[cut:] for label, text in short.items()}
    return short


def plain(labels: tuple[str, ...]) -> dict[str, str]:
    """Each label without what all begin with, without accents, and with its side as an R or L in front.

    The letters of the two sides are those in which most labels differ from another one, as a first or a last
    letter: in "EASD EASG GENOU_D GENOU_G" they are D and G.

    Args:
        labels: of one or more recordings.
    """
    texts = {label: _without_accents(text) for label, text in without_common_start(labels).items()}
    unnumbered = {label: found[1] for label, text in texts.items() if (found := _IN_A_LIST.fullmatch(text))}
    if len(unnumbered) == len(texts):
        texts = unnumbered
    usual = _in_english(texts, LETTERS[0], _FIRST_LETTER)
    sided = [_in_english(texts, letters, end) for letters in LETTERS for end in (_FIRST_LETTER, _LAST_LETTER)]
    most = max(sided, key=len)
    return texts | most if len(most) > len(usual) else texts


def _in_english(texts: dict[str, str], letters: str, pattern: re.Pattern[str]) -> dict[str, str]:
    """Labels that differ from another one in this letter alone, with R or L in front instead."""
    parts = {
        label: found
        for label, text in texts.items()
        if (found := pattern.fullmatch(_TWIN.sub("", text.lower())))
    }
    called = {(found["before"], found["side"], found["after"]) for found in parts.values()}
    sided = {}
    for label, found in parts.items():
        side = letters.find(found["side"])
        if side >= 0 and (found["before"], letters[1 - side], found["after"]) in called:
            at = found.start("side")
            sided[label] = f"{'RL'[side]} {texts[label][:at]} {texts[label][at + 1 :]}"
    return sided


def _without_accents(text: str) -> str:
    return "".join(c for c in normalize("NFKD", text.replace("ß", "ss")) if not combining(c))


def _names_a_side(beginning: str) -> bool:
    return any(word.lower() in RIGHT | LEFT for word in _SEPARATOR.split(beginning))


def _on_both_sides(texts: list[str]) -> bool:
    """Whether enough of these labels have a counterpart that differs in its side."""
    return len(counterparts({text: readings(text) for text in texts}, SURE)) > ON_BOTH_SIDES * len(texts)


def counterparts(read: Mapping[str, list[Reading]], least_ease: float) -> dict[str, str]:
    """Labels that differ in their side alone, each with the other.

    Args:
        read: the ways to read each label.
        least_ease: of the ways that count.
    """
    return {label: other for _, label, other in _paired(read, least_ease)}


def sides(labels: tuple[str, ...]) -> dict[str, str]:
    """The side, "r" or "l", of each label that has a counterpart; labels without one are left out."""
    short = plain(labels)
    read = {label: readings(short[label]) for label in labels}
    return {label: side for side, label, _ in _paired(read, INSIDE)}


def _paired(read: Mapping[str, list[Reading]], least_ease: float) -> Iterator[tuple[str, str, str]]:
    """Side, label and counterpart of every label that has one."""
    owner = {
        (r.side, r.key): label
        for label, found in read.items()
        for r in found
        if r.side and r.ease >= least_ease
    }
    for (side, key), label in owner.items():
        other = owner.get((OTHER_SIDE[side], key))
        if other not in (None, label):
            yield side, label, other


def spelling(label: str) -> frozenset[tuple[str | None, str]]:
    """All sides and keys that a label may be read as: two spellings of one name share one."""
    return frozenset((r.side, r.key) for r in readings(label) if r.ease >= INSIDE)
