"""Whether two marker files show the same motion, one recording exported twice; and which stands still.

Heights over time are compared, marker by marker, at the one shift of the clocks that suits best: labels,
horizontal axes, units and clocks may differ between two exports, the rise and fall of every marker may not.
"""

import re
import unicodedata
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.capture.formats.recording_files import MarkersInLab, read_markers
from solver.capture.subject.force_pairing import LEAST_OVERLAP_SHARE
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.small_files import kept_while_unchanged

COMPARED_HZ = 50.0  # [Hz] that heights are compared at
MOVES_M = 0.03  # deviation over time; heights that hardly change are alike in any two recordings
# of a marker's own deviation: filters and resampling stay below, two steps of one person do not
LIKE_HEIGHTS_SHARE = 0.12
LIKE_MARKERS_SHARE = 0.8  # that must be alike; some have gaps or were filled
PLACES_M = 0.02  # between heights of a marker that stands still: two exports differ by rounding and filters
PART_SHARE = 0.9  # of the time; exports of a whole trial differ by frames at its ends
FEWEST_MOVING = 3  # markers that move
STATIC = re.compile(
    r"stati(c|k|sch|que)|estatic|(?<![a-z])("
    r"(stand(ing)?|stehen(d)?|debout)?[-_ ]*"
    r"[ck]al(ib|ibrat(e|ion)|ibrage|ibraci?on|ibracao|ibrazione|ibrierung)?s?|"
    r"stand(ing)?|stehen(d)?|debout|depie|in[-_ ]piedi|upright|neutral|neutr[eo]|postur[ae]|haltung|"
    r"anat(om(ic(al|a|o)?|ique|isch|ia|ie|y))?|[atn][-_ ]*pos[ea]n?)(?![a-z])"
)
STILL_M = 0.05  # [m] nine of ten markers move less: people who stand sway 3 cm, a slow step is 7
SEEN_SHARE = 0.5  # of the frames; markers that were seen less are not asked
ALL_MARKERS_SHARE = 0.8  # of the markers that other recordings show, in a static trial that no name tells
SHORTEST_S = 0.5  # of such a one
FEWEST_FRAMES = 20  # a longer recording is taken first


def markers_of(path: Path, prefix: str | None = None) -> Markers | None:
    """The markers of one person in a file, y up; None where it cannot be read.

    Args:
        path: the file.
        prefix: before the person's labels, in a file of several; None: of whom it has most.
    """
    found = _read(path, prefix)
    return None if found is None else found.upright


def people_in(path: Path) -> tuple[str, ...]:
    """What stands before the labels of each person in a file, if anything; the first has most of them."""
    found = _read(path, None)
    return () if found is None or not (found.whose or found.others) else (found.whose, *found.others)


def counterparts_among(tables: Sequence[Path], recordings: Sequence[Path]) -> dict[Path, Path]:
    """Which .trc file shows the same motion as which .c3d file.

    Args:
        tables: .trc files.
        recordings: .c3d files.
    """
    found: dict[Path, Path] = {}
    for recording in recordings:
        for table in tables:
            if table not in found and same_motion(markers_of(table), markers_of(recording)):
                found[table] = recording
                break
    return found


def is_part_of(table: Path, recording: Path) -> bool:
    """Whether a file shows the person for a part of the time only that the other one of the motion does."""
    one, other = markers_of(table), markers_of(recording)
    return one is not None and other is not None and len(_heights(one)) < PART_SHARE * len(_heights(other))


@kept_while_unchanged(most=4096)
def how_they_differ(table: Path, recording: Path) -> str:
    """What tells two files of one name apart; empty where they may be one recording.

    Where nearly nothing moves, heights over time tell little; then the markers must be at the same heights.

    Args:
        table: a .trc file.
        recording: a .c3d file.
    """
    one, other = markers_of(table), markers_of(recording)
    if one is None and other is None:
        return ""  # there is but the name
    if one is None or other is None:
        unread = [path.name for path, found in ((table, one), (recording, other)) if found is None]
        return f"{' and '.join(unread)} cannot be read"
    if same_motion(one, other):
        return ""
    a, b = _heights(one), _heights(other)
    moving = [int((heights.std(axis=0) > MOVES_M).sum()) for heights in (a, b)]
    spans = [(markers.frames - 1) / markers.rate for markers in (one, other)]
    said = f"{spans[0]:.2f} s and {spans[1]:.2f} s"
    if max(moving) < FEWEST_MOVING:
        if a.shape[1] < FEWEST_MOVING or b.shape[1] < FEWEST_MOVING:
            return ""
        apart = np.abs(np.median(a, axis=0)[:, None] - np.median(b, axis=0)).min(axis=1)
        if np.mean(apart < PLACES_M) >= LIKE_MARKERS_SHARE:
            return ""
        return f"{said}; markers are at other heights, typically {100 * np.median(apart):.0f} cm apart"
    return f"{said}; their markers do not rise and fall alike"


def same_motion(one: Markers | None, other: Markers | None) -> bool:
    """Whether two recordings, y up, are of one motion; one that cannot be read is of none."""
    if one is None or other is None:
        return False
    a, b = sorted((_heights(one), _heights(other)), key=lambda heights: heights.shape[1])  # fewer are asked
    shorter = min(len(a), len(b))
    if shorter < COMPARED_HZ * 0.2:
        return False
    least = max(2, int(LEAST_OVERLAP_SHARE * shorter))
    return any(
        _alike(a[max(0, -lag) : len(b) - lag], b[max(0, lag) : len(a) + lag])
        for lag in range(least - len(a), len(b) - least + 1)
    )


def _alike(a: Float[np.ndarray, "frames one"], b: Float[np.ndarray, "frames other"]) -> bool:
    """Whether most markers that move have one in the other recording that moves alike."""
    frames = min(len(a), len(b))
    a, b = a[:frames] - a[:frames].mean(axis=0), b[:frames] - b[:frames].mean(axis=0)
    moves = a.std(axis=0) > MOVES_M
    if moves.sum() < FEWEST_MOVING:
        return False
    a = a[:, moves]
    squares = np.square(a).mean(axis=0)[:, None] + np.square(b).mean(axis=0) - 2 * (a.T @ b) / frames
    nearest = np.sqrt(np.maximum(squares, 0.0).min(axis=1, initial=np.inf))
    return bool(np.mean(nearest < LIKE_HEIGHTS_SHARE * a.std(axis=0)) >= LIKE_MARKERS_SHARE)


def _heights(markers: Markers) -> Float[np.ndarray, "frames markers"]:
    """Heights [m] at a common rate while the person is seen, of markers that are there throughout; no gaps.

    Programs export a trial whole, with nobody in it at first, or cut.
    """
    height = markers.positions_ground[:, :, 1]
    seen = np.isfinite(height)
    share = seen.mean(axis=1) if markers.names else np.zeros(markers.frames)
    present = np.flatnonzero((share > 0) & (share >= 0.5 * share.max(initial=0.0)))
    if len(present) < 2:
        return np.zeros((0, 0))
    height, seen = (table[present[0] : present[-1] + 1] for table in (height, seen))
    often = np.flatnonzero(seen.mean(axis=0) > 0.9)
    own = np.arange(len(height)) / markers.rate
    times = np.arange(0.0, own[-1], 1 / COMPARED_HZ)
    columns = [np.interp(times, own[seen[:, k]], height[seen[:, k], k]) for k in often]
    return np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))


@kept_while_unchanged(most=16)
def _read(path: Path, prefix: str | None) -> MarkersInLab | None:
    try:
        return read_markers(path, prefix=prefix)
    except CaptureError:
        return None


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


@kept_while_unchanged(most=4096)
def shown(path: Path) -> Shown | None:
    """What a recording shows; None where it cannot be read."""
    markers = markers_of(path)
    return None if markers is None else shown_by(markers)


def shown_by(markers: Markers) -> Shown:
    """What markers show of a person."""
    often = np.isfinite(markers.positions_ground).all(axis=2).mean(axis=0) > SEEN_SHARE
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
    least = ALL_MARKERS_SHARE * max((what.markers for what in found.values()), default=0)
    return [
        path
        for path, what in found.items()
        if what.is_still and what.markers >= least and what.seconds >= SHORTEST_S
    ]


def _rank(what: Shown | None) -> tuple[bool, bool]:
    """First what can be read, and is not a few frames only."""
    return what is None, what is None or what.frames < FEWEST_FRAMES
