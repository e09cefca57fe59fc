"""The zero level of a force plate that was not tared: found where nobody stands on it, and taken off."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.capture.plates.force_settings import CONDITIONING, ConditioningSettings
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import JUDGED_N
from solver.common.runs import runs

OTHER_PLACE_M = 0.1  # by which a level's lever may differ between rests and loads
EDGE_N = 200.0  # a load below it comes or goes


def zeroed(
    plate: ForcePlate, settings: ConditioningSettings = CONDITIONING
) -> tuple[ForcePlate, tuple[Note, ...]]:
    """The plate less the constant wrench that it shows while unloaded, and what was taken off.

    Left alone: plates that are never unloaded, files whose unloaded samples were set to exactly zero, and
    what a slow filter left between steps, which swings below zero and back.

    Args:
        plate: force up on the foot; NaN where nothing was recorded.
        settings: what counts as unloaded.
    """
    unloaded = unloaded_stretches(plate, settings)
    if not unloaded.any():
        return plate, ()
    level = level_of(plate, unloaded, settings)
    force = np.median(level[:, :3], axis=0)
    if float(np.linalg.norm(force)) < settings.zero_smallest_N:
        return plate, ()
    seconds = unloaded.sum() / plate.rate
    listed = ", ".join(f"{component:.1f}" for component in force)
    notes: tuple[Note, ...] = noted(
        Kind.PLATES,
        f"{plate.name}: reads {listed} N (x, y, z) while unloaded ({seconds:.2f} s); taken off as its zero "
        "level",
    )
    if np.ptp(level[:, 1]):
        notes += noted(
            Kind.OTHER,
            f"{plate.name}: its zero level drifts from {level[0, 1]:.1f} to {level[-1, 1]:.1f} N vertically; "
            "the drift is taken off as well",
        )
    return less(plate, level), notes


def level_of(
    plate: ForcePlate, resting: Bool[np.ndarray, " samples"], settings: ConditioningSettings
) -> Float[np.ndarray, "samples 6"]:
    """Force and moment of the empty plate: constant, or along a line between the rests if that drifts.

    Where a file writes no centre of pressure while the plate rests, its moment then is none of the plate's.

    Args:
        plate: as it is.
        resting: its empty samples.
        settings: from which drift on.
    """
    wrench = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    levels = [float(np.median(wrench[start:end, 1])) for start, end in runs(resting)]
    level = np.tile(np.median(wrench[resting], axis=0), (plate.samples, 1))
    if abs(levels[-1] - levels[0]) > settings.zero_drift_N:
        order = np.flatnonzero(resting)
        slope, at_zero = np.polyfit(order, wrench[resting], 1)
        level = np.clip(np.arange(plate.samples), order[0], order[-1])[:, None] * slope + at_zero
    if plate.point_ground is not None and np.isnan(plate.point_ground[resting]).any(axis=1).mean() > 0.5:
        at_edges = _moment_at_edges(plate, level[:, :3], settings)
        if np.linalg.norm(at_edges - level[0, 3:]) > OTHER_PLACE_M * np.linalg.norm(level[0, :3]):
            level[:, 3:] = at_edges
    return level


def _moment_at_edges(
    plate: ForcePlate, level_N: Float[np.ndarray, "samples 3"], settings: ConditioningSettings
) -> Float[np.ndarray, "3"]:
    """A constant moment without which the pressure stays where it is as a load comes or goes [N·m].

    The pressure is (moment − constant) / force, which small forces spread far if the constant is wrong.
    """
    assert plate.point_ground is not None
    force = plate.force_ground - level_N
    up = np.abs(force[:, 1])
    told = np.isfinite(plate.point_ground).all(axis=1) & (np.abs(plate.force_ground[:, 1]) > JUDGED_N)
    edge = told & (up > settings.threshold_N) & (up < EDGE_N + np.abs(level_N[:, 1]))
    edges = runs(edge)
    if not edges:
        return np.zeros(3)
    columns = np.zeros((int(edge.sum()), 1 + len(edges)))
    columns[:, 0] = 1 / force[edge, 1]
    columns[
        np.arange(len(columns)), 1 + np.repeat(range(len(edges)), [end - start for start, end in edges])
    ] = 1
    levers = plate.moment_ground[edge][:, [0, 2]] / force[edge, 1:2]
    (about_x, about_z), *_ = np.linalg.lstsq(columns, levers, rcond=None)[0]
    return np.array([about_x, 0.0, about_z])


def less(plate: ForcePlate, level: Float[np.ndarray, "samples 6"]) -> ForcePlate:
    """The plate less a zero level."""
    return replace(
        plate,
        force_ground=plate.force_ground - level[:, :3],
        moment_ground=plate.moment_ground - level[:, 3:],
    )


def unloaded_stretches(plate: ForcePlate, settings: ConditioningSettings) -> Bool[np.ndarray, " samples"]:
    """Where nobody stands on the plate; nowhere if the file set such samples to zero, or a filter rings."""
    nobody = np.zeros(plate.samples, dtype=bool)
    fewest = max(2, round(settings.zero_stretch_s * plate.rate))
    if any(end - start >= fewest for start, end in runs((plate.force_ground == 0).all(axis=1))):
        return nobody
    finite = np.isfinite(plate.force_ground).all(axis=1) & np.isfinite(plate.moment_ground).all(axis=1)
    vertical = np.where(finite, plate.force_ground[:, 1], np.inf)
    if not finite.any():
        return nobody
    peak = float(np.abs(vertical[finite]).max())
    limit = settings.zero_largest_N
    if peak > limit + settings.zero_noise_N:
        limit = min(limit, settings.zero_share * peak)
    low = vertical[np.abs(vertical) <= limit]
    if len(low) < fewest:
        return nobody
    level = commonest(low, settings.zero_bin_N)
    near = np.abs(vertical - level) <= settings.zero_noise_N
    for start, end in runs(near):
        if end - start >= fewest:
            nobody[start:end] = True
    rings = level < 0 and nobody.sum() < settings.zero_flat_share * len(low)
    return np.zeros_like(nobody) if rings else nobody


def commonest(values: Float[np.ndarray, " values"], bin_width: float) -> float:
    """Middle of the fullest bin of a histogram smoothed over three bins."""
    low = np.floor(values.min() / bin_width) * bin_width
    counts = np.bincount(((values - low) / bin_width).astype(int))
    smooth = np.convolve(counts, np.ones(3), mode="same")
    return float(low + (np.argmax(smooth) + 0.5) * bin_width)
