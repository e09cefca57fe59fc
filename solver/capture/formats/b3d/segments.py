"""Which segments of a .b3d file belong to one recording, and in which order.

Long trials were cut before they were processed. Segments that abut are one trial again; a gap, an overlap or
another rate keeps them apart.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from solver.capture.formats.b3d.schema import B3dFile, TrialHeader
from solver.common.notes import Kind, Note, noted

FASTEST_M_S = 3.0  # that the body as a whole moves on from one frame to the next
SAME_STEP = 1e-6  # relative: headers keep double precision, some writers went through single
FEWEST_SHARED = 4  # markers seen on both sides of a cut; fewer do not tell whether it is one


@dataclass(frozen=True)
class SegmentedTrial:
    """One trial: the places of its segments in the file, in order."""

    name: str
    segments: tuple[int, ...]
    notes: tuple[Note, ...] = ()


def trials_in(b3d: B3dFile) -> tuple[SegmentedTrial, ...]:
    """The trials of a file, in the order of their first segments.

    Headers decide where they state frames. Where start and end are left 0, `split_index`, or the number that
    ends the name, gives the order, and the markers tell whether one goes on where the other ended.
    """
    headers = [trial for trial in b3d.header.trial_header if trial.trial_length > 0]
    place_of = {id(trial): place for place, trial in enumerate(b3d.header.trial_header)}
    by_origin: dict[str, list[int]] = {}
    for header in headers:
        by_origin.setdefault(header.original_name or header.name, []).append(place_of[id(header)])
    trials: list[SegmentedTrial] = []
    for origin, places in by_origin.items():
        pieces, notes = _joined(b3d, places)
        for piece in pieces:
            name = origin if len(pieces) == 1 else b3d.header.trial_header[piece[0]].name or origin
            trials.append(SegmentedTrial(name, piece, notes))
    return _with_distinct_names(sorted(trials, key=lambda trial: min(trial.segments)))


def _joined(b3d: B3dFile, places: Sequence[int]) -> tuple[list[tuple[int, ...]], tuple[Note, ...]]:
    """Segments of one origin as runs that abut, and what was found where they do not."""
    headers = b3d.header.trial_header
    stated = all(headers[place].original_end_frame > 0 for place in places)
    ordered = sorted(places, key=lambda place: _order(headers[place], stated))
    pieces, notes = [[ordered[0]]], list[Note]()
    for before, after in pairwise(ordered):
        apart = _why_apart(b3d, before, after, stated)
        if apart:
            notes += noted(
                Kind.OTHER,
                f"{headers[before].name} and {headers[after].name} remain separate trials: {apart}",
            )
            pieces.append([after])
        else:
            pieces[-1].append(after)
    for piece in (piece for piece in pieces if len(piece) > 1):
        how = "their frames follow one another" if stated else "the markers continue where the other ended"
        notes += noted(
            Kind.OTHER, f"{len(piece)} segments of {headers[piece[0]].original_name} are joined again: {how}"
        )
    return [tuple(piece) for piece in pieces], tuple(notes)


def _order(header: TrialHeader, stated: bool) -> tuple[int, int, int]:
    if stated:
        return header.original_start_frame, header.split_index, 0
    number = re.search(r"(\d+)$", header.name)
    return header.split_index, int(number[1]) if number else 0, 0


def _why_apart(b3d: B3dFile, before: int, after: int, stated: bool) -> str:
    """Why one segment does not go on where the other ended; empty where it does."""
    one, other = b3d.header.trial_header[before], b3d.header.trial_header[after]
    if abs(one.trial_timestep - other.trial_timestep) > SAME_STEP * one.trial_timestep:
        return f"one has {1 / one.trial_timestep:g} frames a second, the other {1 / other.trial_timestep:g}"
    if stated:
        gap = other.original_start_frame - one.original_end_frame
        ours = other.original_start_frame - one.original_start_frame - one.trial_length
        if gap == 0 or ours == 0:
            return ""
        return f"{gap} frames lie between them" if gap > 0 else f"they share {-gap} frames"
    return _why_not_going_on(b3d, before, after)


def _why_not_going_on(b3d: B3dFile, before: int, after: int) -> str:
    ends = [
        np.array(b3d.trials[place].sensors.marker_obs[frame]).reshape(-1, 3)
        for place, frame in ((before, -1), (after, 0))
    ]
    seen = [np.isfinite(end).all(axis=1) & end.any(axis=1) for end in ends]
    shared = seen[0] & seen[1]
    if shared.sum() < FEWEST_SHARED:
        return "no frames are stated, and too few markers are seen on both sides of the cut"
    moved_m = float(np.median(np.linalg.norm(ends[1][shared] - ends[0][shared], axis=1)))
    speed = moved_m / b3d.header.trial_header[before].trial_timestep
    if speed < FASTEST_M_S:
        return ""
    return f"no frames are stated, and between them the markers move by {100 * moved_m:.0f} cm"


def _with_distinct_names(trials: Sequence[SegmentedTrial]) -> tuple[SegmentedTrial, ...]:
    """Names that results can be filed under, no two alike."""
    named: dict[str, SegmentedTrial] = {}
    for trial in trials:
        plain = re.sub(r"[/\\]", "_", trial.name).strip().lstrip(".") or "trial"
        name, number = plain, 2
        while name in named:
            name, number = f"{plain}_{number}", number + 1
        said = () if name == trial.name else (f"trial '{trial.name}' is called '{name}' here",)
        named[name] = SegmentedTrial(name, trial.segments, (*trial.notes, *said))
    return tuple(named.values())
