"""Forces that a program wrote and no plate measured: copies and sums of other plates, zeros at the ends.

Two plates never carry the same force at the same place at the same time. Programs make such channels: of each
belt and of each foot on a treadmill, of two amplifiers in one file, of all plates together. Rows of zeros at
a recording's ends beside a loaded row are theirs as well.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations, product

import numpy as np
from jaxtyping import Float

from solver.capture.capture import ForcePlate
from solver.common.notes import Kind, Note, noted

APART_SHARE = 0.1  # of the force, by which channels of one load differ: amplifiers' ranges, filters
APART_M = 0.03  # and their pressures; two feet are farther apart
UNLIKE_UNITS_RATIO = 1.5  # by which forces differ that are in other units
SUMMED_SHARE = 0.1  # of the largest: what bears less is not looked for in sums
MOST_SUMMED = 8  # plates; among more, sums are not looked for
COMPARED_SAMPLES = 2000  # that are compared
# filters, delays and resampling leave so much empty; longer, the load has to stay, see HOLD_S, or to come
# faster than any landing
LONGEST_ZEROS_S = 0.1
# beside longer zeros the load stays for that long: a foot that lands or leaves takes as long to load or
# unload
HOLD_S = 0.05
HELD_SHARE = 0.5  # of the first load, by which it may change meanwhile: slow moves stay below
# nobody loads or unloads a plate that fast: of sixteen laboratories' recordings a landing on both feet
# reaches 505
FASTEST_LOADING_KN_S = 1000.0
BESIDE_LOADED_N = 100.0  # the row beside carries at least that
BESIDE_LOADED_SHARE = 0.2  # of the plate's largest force: hard strikes begin with less within one sample
STEP_RATIO = 3.0  # by which the step from zero exceeds those after it: a foot that lands goes on rising


def without_copies(plates: Sequence[ForcePlate]) -> tuple[tuple[ForcePlate, ...], tuple[Note, ...]]:
    """The plates that hold a force of their own, and a note on the others.

    Of copies in different units the largest stays: newtons are larger numbers than pounds or kilonewtons. Of
    two sets with one sum the larger set stays, which tells more feet apart. Else the first in the file.

    Args:
        plates: of one recording, y up, with their zero levels or without.
    """
    wrenches = {k: _deviations(plate) for k, plate in enumerate(plates)}
    sizes = {k: float(np.linalg.norm(wrench[:, :3])) for k, wrench in wrenches.items()}
    left = [k for k in sizes if sizes[k] and len(wrenches[k]) == len(wrenches[0])]
    gone: dict[int, tuple[int, ...]] = {}
    for a, b in combinations(left, 2):
        if not gone.keys() & {a, b} and _is_same(wrenches[a], wrenches[b]):
            gone |= {a: (b,)} if sizes[b] > UNLIKE_UNITS_RATIO * sizes[a] else {b: (a,)}
    least = SUMMED_SHARE * max(sizes.values(), default=0.0)
    for one, other in _pairs_of_sets([k for k in left if k not in gone and sizes[k] > least]):
        sum_of_one, sum_of_other = (np.sum([wrenches[k] for k in some], axis=0) for some in (one, other))
        if not gone.keys() & {*one, *other} and _is_same(sum_of_one, sum_of_other, at_scale=1.0):
            stays, goes = sorted((one, other), key=lambda some: (-len(some), some))
            gone |= dict.fromkeys(goes, stays)
    listed = [
        f"{plates[k].name} ({' + '.join(plates[i].name for i in of)})" for k, of in sorted(gone.items())
    ]
    kept = tuple(plate for k, plate in enumerate(plates) if k not in gone)
    if not listed:
        return kept, ()
    return kept, noted(
        Kind.PLATES,
        "these plates hold forces of others once more and are left out, or the person would weigh too much: "
        f"{', '.join(listed)}",
    )


def _deviations(plate: ForcePlate) -> Float[np.ndarray, "samples 6"]:
    """Force and moment less their means, which zero levels move."""
    wrench = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    wrench = np.nan_to_num(wrench[:: max(1, plate.samples // COMPARED_SAMPLES)])
    return np.asarray(wrench - wrench.mean(axis=0))


def _is_same(
    one: Float[np.ndarray, "samples 6"], other: Float[np.ndarray, "samples 6"], at_scale: float | None = None
) -> bool:
    """Whether the second is the first, times a scale, at the same place."""
    size = np.linalg.norm(other[:, :3])
    scale = at_scale or np.vdot(one[:, :3], other[:, :3]) / np.vdot(one[:, :3], one[:, :3])
    left = other - scale * one
    if np.linalg.norm(left[:, :3]) > APART_SHARE * size:
        return False
    up, (about_x, _, about_z) = one[:, 1], one[:, 3:].T
    place = np.array([up @ about_z, 0.0, -(up @ about_x)]) / (up @ up)
    levers = left[:, 3:] - np.cross(place, left[:, :3])
    return bool(np.linalg.norm(levers) <= APART_M * size)


def _pairs_of_sets(plates: Sequence[int]) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Pairs of sets without a plate in common that may have one sum, the smallest first."""
    if len(plates) > MOST_SUMMED:
        return
    choices = [choice for choice in product((0, 1, -1), repeat=len(plates)) if np.count_nonzero(choice) > 2]
    for choice in sorted(choices, key=np.count_nonzero):
        one, other = (tuple(p for p, side in zip(plates, choice, strict=True) if side == s) for s in (1, -1))
        if one and other and one < other:
            yield one, other


def without_edge_zeros(plate: ForcePlate) -> tuple[ForcePlate, tuple[Note, ...]]:
    """The plate with such rows unrecorded (NaN), and a note on each end that has them."""
    first = _zeros_before_a_load(plate.force_ground, plate.rate)
    last = _zeros_before_a_load(plate.force_ground[::-1], plate.rate)
    if not first + last:
        return plate, ()
    unrecorded = np.zeros(plate.samples, dtype=bool)
    unrecorded[:first] = True
    unrecorded[plate.samples - last :] = True
    said = " and ".join(
        f"the {end} {count} rows" for end, count in (("first", first), ("last", last)) if count
    )
    note = Note(
        Kind.OTHER,
        f"{plate.name}: {said} hold zero force next to a row under load; nobody steps on or off a plate that "
        "fast, so they count as not measured",
    )
    return plate.unrecorded_at(unrecorded), (note,)


def _zeros_before_a_load(force: np.ndarray, rate: float) -> int:
    """How many zero rows the force begins with, if it then jumps to a load, and stays there or jumps too far.

    Otherwise none.
    """
    zero = (force == 0).all(axis=1)
    if not len(zero) or not zero[0] or zero.all():
        return 0
    count = int(np.argmin(zero))
    after = np.linalg.norm(force[count : count + 4], axis=1)
    if len(after) < 4 or not np.isfinite(after).all():
        return 0
    too_fast = after[0] * rate > 1000 * FASTEST_LOADING_KN_S
    if count > max(1.0, LONGEST_ZEROS_S * rate) and not too_fast:
        held = np.linalg.norm(force[count : count + 1 + max(4, round(HOLD_S * rate))], axis=1)
        if not np.abs(held - held[0]).max() <= HELD_SHARE * held[0]:
            return 0
    least = max(BESIDE_LOADED_N, BESIDE_LOADED_SHARE * float(np.nanmax(np.linalg.norm(force, axis=1))))
    is_steady = np.abs(np.diff(after)).max() * STEP_RATIO < after[0]
    return count if after[0] >= least and is_steady else 0
