"""Whether recordings show one person: by distances between markers that sit on one segment in both."""

from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.common.errors import CaptureError
from solver.common.settings_field import setting


@dataclass(frozen=True)
class BodyLengthSettings:
    """What counts as one segment, and how far lengths of one person and of two differ."""

    frames: int = setting(100, unit="frames", why="of a recording, evenly spread; lengths hardly change")
    fewest_frames: int = setting(8, unit="frames", why="in which both markers are seen")
    rigid_m: float = setting(
        0.006, unit="m", why="scatter over time: soft tissue; joints move markers further"
    )
    shortest_m: float = setting(
        0.12, unit="m", why="shorter ones tell where a marker was stuck, not who it is on"
    )
    fewest_lengths: int = setting(5, unit="", why="on three markers or so; fewer tell of one segment only")
    replaced_m: float = setting(
        0.009, unit="m", why="two landmarks found again, 6 mm each (Della Croce et al. 2005)"
    )
    people_share: float = setting(
        0.06, unit="", why="scatter of one bone's length between two adults (Winter 2009)"
    )
    stray_share: float = setting(
        0.15, unit="", why="of lengths: exchanged labels, joints that were held still"
    )
    stray_m: float = setting(0.3, unit="m", why="how far these may be off")
    worth: float = setting(
        0.5, unit="", why="independent lengths a marker: lengths of one segment share markers"
    )


BODY_LENGTHS = BodyLengthSettings()
ONE_SEGMENT_M = 0.25  # longer distances may join two segments that keep still, as all do in a static trial
STAYS_M, MOVES_M = 0.001, 0.02  # four fifths of the time, a bone's length and what is beyond its joint
ON_A_BONE_M = 0.05  # nearer points may be on one plate
FEWEST_JOINTS, JOINTS_SHARE = 4, 0.33  # two legs' knees and ankles; of a suit's 23 points 10, of markers 0

Lengths = dict[tuple[str, str], float]


def body_lengths(markers: Markers, settings: BodyLengthSettings = BODY_LENGTHS) -> Lengths:
    """Median distances [m] of markers that keep it, by their names in alphabetical order."""
    chosen = np.unique(np.linspace(0, markers.frames - 1, settings.frames).round().astype(int))
    positions = markers.positions_ground[chosen]
    lengths: Lengths = {}
    for i, j in combinations(np.argsort(markers.names), 2):
        apart = np.linalg.norm(positions[:, i] - positions[:, j], axis=1)
        apart = apart[np.isfinite(apart)]
        if len(apart) < settings.fewest_frames:
            continue
        low, middle, high = np.percentile(apart, [10, 50, 90])
        if middle >= settings.shortest_m and (high - low) / 2.56 < settings.rigid_m:
            lengths[markers.names[i], markers.names[j]] = float(middle)
    return lengths


def short_lengths(markers: Markers) -> Lengths:
    """Those that lie within one segment, whatever the labels mean."""
    return {pair: length for pair, length in body_lengths(markers).items() if length < ONE_SEGMENT_M}


def odds_for_two(one: Lengths, other: Lengths, settings: BodyLengthSettings = BODY_LENGTHS) -> float | None:
    """Log odds, base e, for two people against one whose markers may have been placed again.

    Args:
        one: of a recording.
        other: of another; only lengths between markers of the same names are compared.
        settings: scatter within and between people.

    Returns:
        None where too few lengths can be compared.
    """
    both = [pair for pair in one if pair in other]
    if len(both) < settings.fewest_lengths:
        return None
    lengths = np.array([[one[pair], other[pair]] for pair in both])
    off = lengths[:, 0] - lengths[:, 1]
    of_people = settings.people_share * lengths.mean(axis=1)
    gain = np.log(_density(off, np.hypot(settings.replaced_m, of_people), settings)) - np.log(
        _density(off, np.full(len(off), settings.replaced_m), settings)
    )
    markers = {name for pair in both for name in pair}
    return float(np.mean(gain) * settings.worth * len(markers))


def refuse_no_markers(markers: Markers, path: Path) -> None:
    """Nothing is made of a recording without a marker, or whose points are a skeleton's joints.

    Raises:
        CaptureError: it is one.
    """
    if not markers.names:
        raise CaptureError(f"{path}: no marker was ever seen. Export the trial with its trajectories.")
    joints = joints_of_a_skeleton(markers)
    if joints:
        raise CaptureError(
            f"{path}: its points are joints of a skeleton ({', '.join(joints[:4])}, …), of an inertial suit "
            "or another program's solve, not markers: they do not show how segments turn about their length. "
            "Export markers, or use that program's angles."
        )


def joints_of_a_skeleton(markers: Markers) -> tuple[str, ...]:
    """Points that keep their distance from two others that move against each other, where many do.

    A joint's centre does, which is on two segments at once; what sits on skin cannot. Where a third of all
    points are such, they are the joints of a skeleton that an inertial suit or another program has solved.
    """
    chosen = np.unique(np.linspace(0, markers.frames - 1, BODY_LENGTHS.frames).round().astype(int))
    positions = markers.positions_ground[chosen]
    positions = positions[np.isfinite(positions).all(axis=(1, 2))]
    if len(positions) < BODY_LENGTHS.fewest_frames:
        return ()
    apart = np.linalg.norm(positions[:, :, None] - positions[:, None], axis=3)
    spread = np.subtract(*np.percentile(apart, [90, 10], axis=0))
    stays = (spread < STAYS_M) & (apart.mean(axis=0) > ON_A_BONE_M)
    moves = (spread > MOVES_M).astype(float)
    joints = np.flatnonzero(np.einsum("ki,ij,kj->k", stays * 1.0, moves, stays * 1.0))
    if len(joints) < FEWEST_JOINTS or len(joints) < JOINTS_SHARE * len(markers.names):
        return ()
    return tuple(markers.names[k] for k in joints)


def _density(
    off: Float[np.ndarray, " lengths"], scatter: Float[np.ndarray, " lengths"], settings: BodyLengthSettings
) -> Float[np.ndarray, " lengths"]:
    normal = np.exp(-0.5 * np.square(off / scatter)) / (np.sqrt(2 * np.pi) * scatter)
    return (1 - settings.stray_share) * normal + settings.stray_share / (2 * settings.stray_m)
