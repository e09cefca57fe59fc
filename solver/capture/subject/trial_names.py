"""How two file names relate: whether they name one trial, whatever words for kinds of data they carry."""

import re
import unicodedata
from collections import Counter
from collections.abc import Sequence
from enum import Enum
from pathlib import PurePath

_WORDS = """
    marker markers mkr mkrs trajectory trajectories traj trc point points mocap motion capture
    captures vicon qtm qualisys optitrack kine kinematic kinematics kin kinetic kinetics force
    forces grf grfs grm fp fps plate plates forceplate forceplates forcedata markerdata ground
    reaction reactions load loads analog analogs analogue mot sto data raw export exported filtered
    filt processed cleaned clean labelled labeled opensim kraft krafte kraftdaten kraftmessplatte
    bewegung daten messung messdaten bodenreaktionskraft
"""
WORDS_OF_KIND = frozenset(_WORDS.split())
GLUED = re.compile(
    r"^(markers?|forces?|grf|mocap|kinetics)(?=[a-z]{2})|(?<=[a-z]{2})(markers?|forces?|grf|kinetics)$"
)
PIECES = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")

PERSON = re.compile(
    r"(?<![A-Za-z0-9])((?i:s|su|subj?|subject|p|ppt|pat|patient|participant|vp|vpn|pb|proband|probandin|"
    r"pers|person|personne|tn|player|athlete|child|suj|sujet|sujeto|sogg|soggetto))"
    r"[-_ ]?0*(\d+)(?![a-z0-9])"
)


class Relation(Enum):
    """What two names say about whether they mean one trial."""

    SAME = "the names say the same"
    PART = "one name says part of the other"
    UNRELATED = "the names say nothing about each other"
    SIBLINGS = "the names tell two trials apart"


def name_tokens(text: str) -> tuple[str, ...]:
    """Words and whole numbers of a name without those for a kind of data; case, accents, separators dropped.

    Umlauts count as their vowels, written either way; 01 and 1 are one number, 1 and 10 are two.
    """
    plain = "".join(
        letter
        for letter in unicodedata.normalize("NFKD", text.replace("ß", "ss"))
        if not unicodedata.combining(letter)
    )
    tokens: list[str] = []
    for piece in PIECES.findall(re.sub(r"(?i)c3d", " ", plain)):
        if piece.isdigit():
            tokens.append(str(int(piece)))
            continue
        word = re.sub("([aou])e", r"\1", GLUED.sub("", piece.lower()))
        if word and word not in WORDS_OF_KIND and piece.lower() not in WORDS_OF_KIND:
            tokens.append(word)
    return tuple(tokens)


def numbered_person(name: str) -> tuple[str, str, int] | None:
    """What looks like the number of a person in a name, as in S01_walk: the text, its word, the number."""
    found = PERSON.search(name)
    return None if found is None else (found[0], found[1].lower(), int(found[2]))


def relation(one: PurePath, other: PurePath) -> Relation:
    """How the names of two files relate; of their folders, what lies below the one that holds both.

    Two trials differ in a word or in a number. A word here and a number there, as in PREF_15 and 15_2plates,
    only say more of each file.

    Args:
        one: path of a file.
        other: path of another, from the same root.
    """
    names = [path.with_suffix("").parts for path in (one, other)]
    shared = 0
    while shared < min(len(name) for name in names) - 1 and names[0][shared] == names[1][shared]:
        shared += 1
    return _relation(*(name_tokens(" ".join(name[shared:])) for name in names))


def _relation(one: Sequence[str], other: Sequence[str]) -> Relation:
    first, second = Counter(one), Counter(other)
    if first == second:
        return Relation.SAME
    if not first or not second:
        return Relation.UNRELATED
    if first <= second or second <= first:
        return Relation.PART
    words = [{token for token in tokens if not token.isdigit()} for tokens in (first, second)]
    if not words[0] & words[1] and (words[0] or words[1]):
        return Relation.UNRELATED
    kinds = [{token.isdigit() for token in rest} for rest in (first - second, second - first)]
    return Relation.SIBLINGS if kinds[0] & kinds[1] else Relation.PART
