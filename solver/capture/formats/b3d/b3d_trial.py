"""One trial of a .b3d file as measured: its segments put together, markers, plates and what was reviewed."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.capture.capture import ForcePlate, ImportedReason, Markers
from solver.capture.formats.b3d.b3d_fields import (
    REASONS,
    REVIEWED,
    B3dFile,
    B3dTrial,
    Header,
    PassType,
    TrialHeader,
)
from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.capture.formats.b3d.stored import StoredPass, stored_passes
from solver.capture.marker_cleaning import unseen_as_nan
from solver.capture.plates.program_artefacts import without_edge_zeros
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

CENTRE_KNOWN_N = 5.0  # vertical; below it a centre of pressure is noise
SAME_LOAD_N, SAME_LOAD_SHARE = 1.0, 0.02  # by which plates that are the feet's own forces may differ
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


@dataclass(frozen=True)
class B3dReview:
    """What the file says about each frame's force."""

    missing: Bool[np.ndarray, " frames"]
    reasons: tuple[ImportedReason, ...]
    finished: bool  # a person had decided about some of it


@dataclass(frozen=True)
class B3dRecording:
    """Markers and plates at the file's rate, ground frame, y up; forces on the person."""

    markers: Markers
    plates: tuple[ForcePlate, ...]
    review: B3dReview | None
    notes: tuple[Note, ...]
    stored: tuple[StoredPass, ...] = ()


def read_b3d_trial(path: Path, name: str) -> B3dRecording:
    """Read a trial of a .b3d file.

    Args:
        path: of the file.
        name: of the trial, as `trials_in` has it.

    Raises:
        CaptureError: the file or one of the trial's segments is damaged, or has no such trial.
    """
    b3d = read_b3d(path)
    found = next((trial for trial in trials_in(b3d) if trial.name == name), None)
    if found is None:
        known = ", ".join(trial.name for trial in trials_in(b3d))
        raise CaptureError(f"{path}: no trial '{name}'; trials: {known}.")
    segments = [b3d.trials[place] for place in found.segments]
    rate = 1 / segments[0].header.trial_timestep
    start_time = float(segments[0].header.original_start_time)
    names = tuple(name or f"unnamed_{place}" for place, name in enumerate(b3d.header.marker_name))
    positions = np.concatenate([_markers(segment, names) for segment in segments])
    seen, marker_notes = unseen_as_nan(positions, names, path.name)
    guessed = any(segment.header.marker_names_guessed for segment in segments)
    plates, plate_notes = _plates(b3d.header, segments, rate)
    notes = (
        *found.notes,
        *(noted(Kind.OTHER, "according to the file, its markers were named by guessing") if guessed else ()),
        *marker_notes,
        *plate_notes,
    )
    moved = tuple(replace(plate, start_time=start_time) for plate in plates)
    review, stored = review_of(b3d.header, found.segments), stored_passes(b3d.header, segments)
    return B3dRecording(Markers(names, seen, rate, start_time), moved, review, notes, stored)


def review_of(header: Header, segments: Sequence[int]) -> B3dReview | None:
    """What a trial's headers say about its forces; None where nobody and nothing has looked at them.

    All frames without a reason, in a trial whose forces no motion was fitted to, say nothing: writers leave
    them so before they look.
    """
    headers = [header.trial_header[place] for place in segments]
    numbers = np.concatenate([_reasons(each) for each in headers])
    fitted = any(about.type == PassType.DYNAMICS for each in headers for about in each.processing_pass_header)
    by_person = any(bool(np.any(each.has_manual_GRF_annotation)) for each in headers)
    by_person |= bool((numbers == REASONS.index(REVIEWED)).any())
    if not (fitted or by_person or numbers.any()):
        return None
    changes = np.flatnonzero(np.diff(numbers)) + 1
    edges = [0, *changes.tolist(), len(numbers)]
    reasons = tuple(
        ImportedReason(start, end, _word(int(numbers[start])))
        for start, end in pairwise(edges)
        if numbers[start]
    )
    return B3dReview(numbers != 0, reasons, by_person)


def _reasons(header: TrialHeader) -> Int[np.ndarray, " frames"]:
    stored = np.asarray(header.missing_GRF_reason, dtype=int)
    return stored if len(stored) else np.zeros(header.trial_length, dtype=int)


def _word(number: int) -> str:
    return REASONS[number] if 0 <= number < len(REASONS) else REVIEWED


def _markers(segment: B3dTrial, names: Sequence[str]) -> Float[np.ndarray, "frames markers 3"]:
    return np.array(segment.sensors.marker_obs).reshape(segment.header.trial_length, len(names), 3)


@dataclass(frozen=True)
class _Loads:
    """Wrenches of one segment, plate by plate; NaN where not recorded."""

    names: tuple[str, ...]
    force: Float[np.ndarray, "frames plates 3"]  # [N]
    moment: Float[np.ndarray, "frames plates 3"]  # [N·m] about the ground origin
    cop: Float[np.ndarray, "frames plates 3"]  # [m]


def _plates(
    header: Header, segments: Sequence[B3dTrial], rate: float
) -> tuple[tuple[ForcePlate, ...], tuple[Note, ...]]:
    """The trial's plates; where the file holds none of their values, the forces on the contact bodies."""
    raw = [_raw_loads(segment) for segment in segments]
    of_bodies = [_body_loads(header, segment) for segment in segments]
    notes: list[Note] = []
    if not any(np.nan_to_num(loads.force).any() for loads in raw):
        if not any(loads is not None and loads.force.any() for loads in of_bodies):
            return (), ()
        raw = [loads for loads in of_bodies if loads is not None]
        notes += noted(
            Kind.LEFT_OUT, "the file holds no plate data: the forces on its contact bodies are used instead"
        )
    elif _are_feet(raw, of_bodies):
        notes += noted(Kind.OTHER, "each plate stands for a foot: its values are those of one contact body")
    count = max(len(loads.names) for loads in raw)
    names = next(loads.names for loads in raw if len(loads.names) == count)
    corners = _corners(segments, count)
    plates = []
    for k in range(count):
        pieces = []
        for place, loads in enumerate(raw):
            piece, said = without_edge_zeros(_piece(loads, k, names[k], rate))
            notes += (note.of(segments[place].header.name) for note in said)
            pieces.append(piece)
        force, moment, cop = (
            np.concatenate([getattr(piece, part) for piece in pieces])
            for part in ("force_ground", "moment_ground", "cop_ground")
        )
        plates.append(ForcePlate(names[k], force, moment, cop, rate, corners_ground=corners[k]))
    return tuple(plates), tuple(notes)


def _piece(loads: _Loads, k: int, name: str, rate: float) -> ForcePlate:
    """One plate in one segment; not recorded where the segment has fewer plates."""
    if k >= len(loads.names):
        nothing = np.full((len(loads.force), 3), np.nan)
        return ForcePlate(name, nothing, nothing, nothing, rate)
    force, cop = loads.force[:, k], loads.cop[:, k]
    known = (np.abs(force[:, 1]) >= CENTRE_KNOWN_N) & cop[:, [0, 2]].any(axis=1)
    return ForcePlate(name, force, loads.moment[:, k], np.where(known[:, None], cop, np.nan), rate)


def _raw_loads(segment: B3dTrial) -> _Loads:
    frames = segment.header.trial_length
    force, torque, cop = (
        np.array(getattr(segment.sensors, f"raw_force_plate_{part}")).reshape(frames, -1, 3)
        for part in ("force", "torque", "cop")
    )
    count = force.shape[1]
    if segment.header.num_force_plates:
        count = min(count, segment.header.num_force_plates)  # the rest fills up to the largest trial's number
    force, torque, cop = force[:, :count], torque[:, :count], cop[:, :count]
    names = tuple(f"plate {k + 1}" for k in range(count))
    return _Loads(names, force, torque + np.cross(cop, force), cop)


def _body_loads(header: Header, segment: B3dTrial) -> _Loads | None:
    """The forces on the contact bodies as the first pass has them; None where it has none."""
    bodies = header.ground_contact_body
    if not segment.passes or not bodies or not segment.passes[0].ground_contact_wrench.size:
        return None
    shape = segment.header.trial_length, len(bodies)
    wrench = np.array(segment.passes[0].ground_contact_wrench).reshape(*shape, 6)
    cop = np.array(segment.passes[0].ground_contact_center_of_pressure)
    points = cop.reshape(*shape, 3) if cop.size else np.zeros((*shape, 3))
    return _Loads(tuple(bodies), wrench[..., 3:], wrench[..., :3], points)


def _are_feet(raw: Sequence[_Loads], of_bodies: Sequence[_Loads | None]) -> bool:
    """Whether each plate carries what one contact body does, on every frame."""
    for plates, bodies in zip(raw, of_bodies, strict=True):
        if bodies is None or len(plates.names) != len(bodies.names):
            return False
        off = np.abs(np.nan_to_num(plates.force) - bodies.force)
        allowed = SAME_LOAD_N + SAME_LOAD_SHARE * np.abs(bodies.force)
        crossed = np.abs(np.nan_to_num(plates.force)[:, ::-1] - bodies.force)
        if not ((off <= allowed).all() or (crossed <= allowed[:, ::-1]).all()):
            return False
    return True


def _corners(segments: Sequence[B3dTrial], count: int) -> list[Float[np.ndarray, "4 3"] | None]:
    for segment in segments:
        stored = np.asarray(segment.header.force_plate_corners, dtype=float)
        if stored.size == 12 * count:
            by_plate = stored.reshape(count, 4, 3)
            return [each if np.isfinite(each).all() and each.any() else None for each in by_plate]
    return [None] * count
