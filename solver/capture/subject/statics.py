"""The static trial among a subject's recordings: by its name, and by a person who stands still in it."""

import re
import unicodedata
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from solver.capture.capture import Markers
from solver.capture.subject.same_motion import markers_of
from solver.common.notes import Kind, Note, noted

STATIC = re.compile(
    r"stati(c|k|sch|que)|estatic|(?<![a-z])("
    r"(stand(ing)?|stehen(d)?|debout)?[-_ ]*"
    r"[ck]al(ib|ibrat(e|ion)|ibrage|ibraci?on|ibracao|ibrazione|ibrierung)?s?|"
    r"stand(ing)?|stehen(d)?|debout|depie|in[-_ ]piedi|upright|neutral|neutr[eo]|postur[ae]|haltung|"
    r"anat(om(ic(al|a|o)?|ique|isch|ia|ie|y))?|[atn][-_ ]*pos[ea]n?)(?![a-z])"
)
STILL_M = 0.05  # [m] nine of ten markers move less: people who stand sway 3 cm, a slow step is 7
SEEN = 0.5  # of the frames; markers that were seen less are not asked
WHOLE = 0.8  # of the markers that other recordings show, in a static trial that no name tells
SHORTEST_S = 0.5  # of such a one
FEWEST_FRAMES = 20  # a longer recording is taken first


@dataclass(frozen=True)
class Shown:
    """What a recording shows of a person."""

    moves_m: float  # [m] nine of ten markers stay within
    markers: int  # that were seen on most frames
    frames: int
    seconds: float

    @property
    def is_still(self) -> bool:
        """Whether nobody moves."""
        return self.markers > 0 and self.moves_m < STILL_M


@dataclass(frozen=True)
class Statics:
    """The static trial of a subject, and what was taken for none."""

    static: Path | None
    others: tuple[Path, ...] = ()  # static trials as well
    notes: tuple[Note, ...] = ()


def is_static(name: str) -> bool:
    """Whether a trial of that name should be a standing calibration, not a motion; whole words count."""
    plain = "".join(c for c in unicodedata.normalize("NFKD", name) if not unicodedata.combining(c))
    return bool(STATIC.search(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", plain).lower()))


def is_static_file(path: Path, folder: Path) -> bool:
    """Whether a marker file of a subject should be a standing calibration, by its name or its place."""
    return is_static(path.stem) or (path.parent != folder and is_static(path.parent.name))


def moves(path: Path) -> bool:
    """Whether somebody moves in a recording that can be read."""
    found = shown(path)
    return found is not None and not found.is_still


def static_among(recordings: Sequence[Path], inside: Collection[Path], folder: Path) -> Statics:
    """Choose the static trial.

    A name alone makes none of a recording in which the person moves. Where no name tells one, the only
    recording in which nobody moves is it. Where there is nothing else, a static trial is a trial.

    Args:
        recordings: marker files of the subject.
        inside: which of them may be looked into.
        folder: the subject's.
    """
    named = [p for p in recordings if is_static_file(p, folder)]
    moving = [p for p in named if p in inside and moves(p)]
    notes = tuple(
        Note(Kind.OTHER, f"{p.name}: a static trial by its name, but somebody moves in it: read as a trial")
        for p in moving
    )
    statics = [p for p in named if p not in moving]
    if len(statics) == len(recordings):
        return Statics(None)
    if not statics and not moving:
        still = _still_ones([p for p in recordings if p in inside])
        if len(still) == 1 and len(recordings) > 1:
            notes += noted(
                Kind.PERSON,
                f"{still[0].name}: nobody moves in it, so it is the static trial; a subject.toml can name it "
                "as a trial",
            )
            return Statics(still[0], (), notes)
    statics.sort(key=lambda p: _rank(shown(p) if p in inside else None))
    others = tuple(statics[1:])
    notes += tuple(
        Note(Kind.OTHER, f"{p.name}: another static trial; {statics[0].name} is used") for p in others
    )
    return Statics(statics[0] if statics else None, others, notes)


def shown(path: Path) -> Shown | None:
    """What a recording shows; None where it cannot be read."""
    status = path.stat()
    return _shown(path, (status.st_mtime_ns, status.st_size))


@lru_cache(maxsize=4096)
def _shown(path: Path, stamp: tuple[int, int]) -> Shown | None:
    """Looked into again when the file's time or size has changed."""
    markers = markers_of(path)
    return None if markers is None else shown_by(markers)


def shown_by(markers: Markers) -> Shown:
    """What markers show of a person."""
    often = np.isfinite(markers.positions_ground).all(axis=2).mean(axis=0) > SEEN
    if not often.any():
        return Shown(np.inf, 0, markers.frames, markers.frames / markers.rate)
    low, high = np.nanpercentile(markers.positions_ground[:, often], [5, 95], axis=0)
    span = np.linalg.norm(high - low, axis=1)
    return Shown(
        float(np.percentile(span, 90)), int(often.sum()), markers.frames, markers.frames / markers.rate
    )


def _still_ones(recordings: Sequence[Path]) -> list[Path]:
    """Recordings of a whole person in which nobody moves."""
    found = {path: what for path in recordings if (what := shown(path)) is not None}
    least = WHOLE * max((what.markers for what in found.values()), default=0)
    return [
        path
        for path, what in found.items()
        if what.is_still and what.markers >= least and what.seconds >= SHORTEST_S
    ]


def _rank(what: Shown | None) -> tuple[bool, bool]:
    """First what can be read, and is not a few frames only."""
    return what is None, what is None or what.frames < FEWEST_FRAMES
