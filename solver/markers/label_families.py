"""The tables of label families, and what a label means in each of them."""

import re
import tomllib
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Markers
from solver.markers.atlas import SIDES, atlas
from solver.markers.label_parts import Reading

ORDER = (1.0, 0.35, 0.2)  # weight of a family's first, second, third meaning of a label
DIGITS_DROPPED = 0.6  # RASI1 taken for RASI
CLUSTER_DIGITS_DROPPED = 0.9  # Shank2 taken for Shank: numbered tracking markers are usual
SIDE_UNKNOWN = 0.45  # each of both sides, where a label names none
WORDS = "words"
ALL_WORDS, A_WORD_LEFT = 0.85, 0.5
_END_DIGITS = re.compile(r"\d+$")
AXES = "oalp"  # Plug-in Gait and CGM2: origin and the ends of the anterior, lateral and proximal axis
NOT_ON_THE_BODY = re.compile(
    r"cent(re|er) ?of ?(mass|gravity|pressure)\w*|(body|whole)?_?(com|cog|cop)(floor)?|"
    r".*(force_?plate|grf|angles?|forces?|moments?|powers?)\d*|.*(leglength|archheight).*|"
    r"(proj|virtual).*|mid_?[lr]?(asis|asi|psis|psi|hjc|hip|kjc|ajc|pelvis|top|bottom|front)\w*|usermo\d*|"
    r"(fp|plate)_?\d*_?(corner|origin)_?\d*"
)
# Labels of videos. OpenCap's and Pose2Sim's augmented markers stand beside the keypoints they were made of.
AUGMENTED = "_study"
_LEGS = frozenset(side + joint for side in "rl" for joint in ("hip", "knee", "ankle"))
_POSES = frozenset(("r_thigh_y", "l_thigh_y"))
_ONLY_VIDEOS = frozenset(("nose", "rbigtoe", "neck"))
_HEAD_OR_MIDDLE = re.compile(r"head|neck|nose|[rl](eye|ear)|c?hip")
FRAMES = 24  # of each recording
FEWEST_FRAMES = 6
FLOAT_M = 2e-6  # what single precision leaves of a length of metres, after some arithmetic
COARSEST_M = 2e-5  # a file with fewer digits cannot tell a computed point from a marker on a plate
BASE_M = 0.03  # a shorter side defines no frame
NEAREST = 9  # points that may define the frame in which another one stands still
MOVES = 50  # times as far as errors of the last digit: what real markers do against each other


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


def computed_points(
    names: Mapping[str, str], recordings: Sequence[Markers] = (), known: Collection[str] = ()
) -> dict[str, str]:
    """Each computed point's label, and how that is known.

    Args:
        names: by label, without what all labels begin with.
        recordings: that have these labels.
        known: labels that a table has. Such a marker may define computed points and so be a function of them;
            only the ends of an axis are no marker, whatever they are called.
    """
    if seen_as_poses(names.values()):
        return {}
    found = _by_name(names) | _keypoints_to_leave(names)
    for markers in recordings:
        for label, why in _by_motion(markers, found, known).items():
            found.setdefault(label, why)
    return found


def seen_by_video(labels: Collection[str]) -> bool:
    """Whether these are a markerless system's keypoints, or markers that were computed from them.

    Args:
        labels: of a recording, without what all begin with.
    """
    names = {label.lower() for label in labels}
    keypoints = names >= _LEGS and bool(_ONLY_VIDEOS & names)
    return keypoints or any(name.endswith(AUGMENTED) for name in names) or seen_as_poses(labels)


def seen_as_poses(labels: Collection[str]) -> bool:
    """Whether these are points on segments whose poses a markerless system wrote: rigid, and all are meant.

    Args:
        labels: of a recording, without what all begin with.
    """
    return not _POSES.isdisjoint(label.lower() for label in labels)


def _keypoints_to_leave(names: Mapping[str, str]) -> dict[str, str]:
    """Those that augmented markers were made of; else those of the head and between two others."""
    if not seen_by_video(names.values()):
        return {}
    augmented = {label for label, name in names.items() if name.lower().endswith(AUGMENTED)}
    if augmented:
        why = f"a keypoint that the markers called …{AUGMENTED} were computed from"
        return dict.fromkeys(names.keys() - augmented, why)
    why = "a keypoint of the head, which keeps its gaze where the trunk leans, or between two others"
    return {label: why for label, name in names.items() if _HEAD_OR_MIDDLE.fullmatch(name.lower())}


def _by_name(names: Mapping[str, str]) -> dict[str, str]:
    """By what they are called: outputs that are no points of the body, and axes whose ends are all there."""
    found = {
        label: "a computed quantity"
        for label, name in names.items()
        if NOT_ON_THE_BODY.fullmatch(name.lower())
    }
    ends: dict[str, dict[str, str]] = defaultdict(dict)
    for label, name in names.items():
        ends[name[:-1].lower()][name[-1:].lower()] = label
    for stem, with_end in ends.items():
        tetrad = len(stem) > 2 and "o" in with_end and len(with_end.keys() & set(AXES)) > 2
        triad = stem.endswith("_") and len(stem) > 1 and with_end.keys() >= set("xyz")
        if tetrad or triad:
            of_axes = {label for end, label in with_end.items() if end in (AXES if tetrad else "xyz")}
            found |= dict.fromkeys(of_axes, "an axis of a segment")
    return found


@dataclass(frozen=True)
class _Seen:
    """Some frames of a recording, and what its points do to each other."""

    x: Float[np.ndarray, "frames markers 3"]
    distance: Float[np.ndarray, "frames markers markers"]
    stays: Bool[np.ndarray, "markers markers"]  # distances, to the last digit
    moves: Bool[np.ndarray, "markers markers"]  # as those of real markers do
    error: float  # of a coordinate [m]


def _by_motion(markers: Markers, computed: Collection[str], known: Collection[str]) -> dict[str, str]:
    """By what they are: exact functions of other points on every frame, to the file's last digit."""
    names = markers.names
    seen = _seen(markers)
    if seen is None:
        return {}
    found: dict[int, str] = {}
    for origin, ends in _tetrads(seen, names):
        fresh = {*ends, *(() if names[origin] in known else (origin,))}
        found |= dict.fromkeys(fresh, "the axes of a segment: right angles that stay, to the last digit")
    axes = list(found)
    unknown = [k for k, name in enumerate(names) if name not in known and name not in computed]
    for k in unknown:
        if seen.stays[k, axes].sum() > 2:
            found.setdefault(k, "fixed to computed axes, to the last digit")
    real = [k for k, name in enumerate(names) if name not in computed and k not in found]
    for k in unknown:
        if k not in found and (parents := _parents(k, seen, real)):
            found[k] = f"a function of {', '.join(names[i] for i in parents)}, to the last digit"
    rigid = seen.stays[np.ix_(real, real)].any(axis=1).sum()
    simulated = 2 * rigid > len(real)
    return {} if simulated else {names[k]: why for k, why in found.items()}


def _seen(markers: Markers) -> _Seen | None:
    """None where frames or digits are too few to tell a computed point from a marker on a plate."""
    frames = np.unique(np.linspace(0, markers.frames - 1, min(FRAMES, markers.frames)).astype(int))
    x = markers.positions_ground[frames]
    least = _last_digit(x)
    if least > COARSEST_M or len(frames) < FEWEST_FRAMES:
        return None
    error = 2 * FLOAT_M + least
    distance = np.linalg.norm(x[:, :, None] - x[:, None], axis=3)
    there = np.isfinite(distance)
    enough = there.sum(axis=0) >= FEWEST_FRAMES
    lowest = np.where(there, distance, np.inf).min(axis=0)
    with np.errstate(invalid="ignore"):
        span = np.where(there, distance, -np.inf).max(axis=0) - lowest
    stays = enough & (lowest > BASE_M / 3) & (span < 2 * error)
    return _Seen(x, distance, stays, enough & (span > MOVES * error), error)


def _last_digit(x: Float[np.ndarray, "frames markers 3"]) -> float:
    """The smallest step between two coordinates of the file [m]."""
    steps = np.diff(np.unique(np.round(x[np.isfinite(x)], 9)))
    return float(steps.min()) if len(steps) else np.inf


def _tetrads(seen: _Seen, names: Sequence[str]) -> Iterator[tuple[int, frozenset[int]]]:
    """Origin and three ends with fixed distances, at right angles seen from the origin.

    A marker may lie at the origin: the one whose name is like the ends' is the computed one.
    """
    x, stays = seen.x, seen.stays
    best: dict[frozenset[int], tuple[int, int]] = {}
    for origin in np.flatnonzero(stays.sum(axis=1) > 2).tolist():
        others = np.flatnonzero(stays[origin])
        to = x[:, others] - x[:, [origin]]
        length = np.linalg.norm(to, axis=2)
        cosine = np.abs(np.einsum("tik,tjk->tij", to, to)) / (length[:, :, None] * length[:, None])
        right = np.nan_to_num(cosine).max(axis=0) < 4 * seen.error / np.nanmin(length)
        right &= stays[np.ix_(others, others)]
        for i, j in zip(*np.nonzero(np.triu(right)), strict=True):
            for k in np.flatnonzero(right[i] & right[j]):
                ends = frozenset(others[[i, j, k]].tolist())
                alike = max(_shared(names[origin], names[end]) for end in ends)
                best[ends] = max(best.get(ends, (-1, -1)), (alike, origin))
    for ends, (_, origin) in best.items():
        yield origin, ends


def _shared(one: str, other: str) -> int:
    """Letters that two names begin with alike."""
    pairs = enumerate(zip(one, other, strict=False))
    return next((i for i, (a, b) in pairs if a != b), min(len(one), len(other)))


def _parents(k: int, seen: _Seen, real: Sequence[int]) -> tuple[int, ...]:
    """Markers that move against each other and define a point, on their line or at rest in their frame."""
    there = np.isfinite(seen.x[:, k, 0])
    others = [i for i in real if i != k and np.isfinite(seen.x[there, i, 0]).all()]
    if there.sum() < FEWEST_FRAMES or len(others) < 2:
        return ()
    near = np.array(others)[np.argsort(seen.distance[there][:, k, others].mean(axis=0))[:NEAREST]]
    a, b = (near[i] for i in np.nonzero(seen.moves[np.ix_(near, near)]))
    if not len(a):
        return ()
    x = seen.x[there]
    p, start, along = x[:, k, None], x[:, a], x[:, b] - x[:, a]
    share = (((p - start) * along).sum(axis=2) / (along**2).sum(axis=2)).mean(axis=0)
    off = np.linalg.norm(p - start - share[:, None] * along, axis=2).max(axis=0)
    divides = np.flatnonzero((share > 0) & (share < 1) & (off < 2 * seen.error))
    if len(divides):
        return (int(a[divides[0]]), int(b[divides[0]]))
    from_middle = np.ptp(np.linalg.norm(p - start - along / 2, axis=2), axis=0) < 2 * seen.error
    for i in np.flatnonzero(from_middle | seen.stays[k, a]):
        origin = start[:, i] + (along[:, i] / 2 if from_middle[i] else 0.0)
        for c in near:
            if c not in (a[i], b[i]) and _stays_in(origin, along[:, i], x[:, c], p[:, 0], seen.error):
                return (int(a[i]), int(b[i]), int(c))
    return ()


def _stays_in(
    origin: Float[np.ndarray, "frames 3"],
    along: Float[np.ndarray, "frames 3"],
    third: Float[np.ndarray, "frames 3"],
    point: Float[np.ndarray, "frames 3"],
    error: float,
) -> bool:
    """Whether a point rests in the frame of an origin, a first axis, and a third point of its plane."""
    length = np.linalg.norm(along, axis=1)
    normal = np.cross(along, third - origin)
    height = np.linalg.norm(normal, axis=1) / length
    if min(length.min(), height.min()) < BASE_M:
        return False
    x = along / length[:, None]
    z = normal / (height * length)[:, None]
    to = point - origin
    lever = max(1.0, float((np.linalg.norm(to, axis=1) / np.minimum(length, height)).max()))
    coordinates = np.stack([(to * axis).sum(axis=1) for axis in (x, np.cross(z, x), z)])
    return bool(np.ptp(coordinates, axis=1).max() < 4 * error * lever)
