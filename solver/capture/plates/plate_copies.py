"""Plates that hold the forces of others once more: copies, in whatever units, and sums of several.

Two plates never carry the same force at the same place at the same time. Programs make such channels: of each
belt and of each foot on a treadmill, of two amplifiers in one file, of all plates together.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations, product

import numpy as np
from jaxtyping import Float

from solver.capture.capture import ForcePlate
from solver.common.notes import Kind, Note, noted

APART = 0.1  # of the force, by which channels of one load differ: amplifiers' ranges, filters
APART_M = 0.03  # and their pressures; two feet are farther apart
UNLIKE_UNITS = 1.5  # by which forces differ that are in other units
SUMMED = 0.1  # of the largest: what bears less is not looked for in sums
MOST_SUMMED = 8  # plates; among more, sums are not looked for
SAMPLES = 2000  # that are compared


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
            gone |= {a: (b,)} if sizes[b] > UNLIKE_UNITS * sizes[a] else {b: (a,)}
    least = SUMMED * max(sizes.values(), default=0.0)
    for one, other in _pairs_of_sets([k for k in left if k not in gone and sizes[k] > least]):
        sum_of_one, sum_of_other = (np.sum([wrenches[k] for k in some], axis=0) for some in (one, other))
        if not gone.keys() & {*one, *other} and _is_same(sum_of_one, sum_of_other, at_scale=1.0):
            stays, goes = sorted((one, other), key=lambda some: (-len(some), some))
            gone |= dict.fromkeys(goes, stays)
    told = [f"{plates[k].name} ({' + '.join(plates[i].name for i in of)})" for k, of in sorted(gone.items())]
    kept = tuple(plate for k, plate in enumerate(plates) if k not in gone)
    if not told:
        return kept, ()
    return kept, noted(
        Kind.PLATES,
        "these plates hold forces of others once more and are left out, or the person would weigh too much: "
        f"{', '.join(told)}",
    )


def _deviations(plate: ForcePlate) -> Float[np.ndarray, "samples 6"]:
    """Force and moment less their means, which zero levels move."""
    wrench = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    wrench = np.nan_to_num(wrench[:: max(1, plate.samples // SAMPLES)])
    return np.asarray(wrench - wrench.mean(axis=0))


def _is_same(
    one: Float[np.ndarray, "samples 6"], other: Float[np.ndarray, "samples 6"], at_scale: float | None = None
) -> bool:
    """Whether the second is the first, times a scale, at the same place."""
    size = np.linalg.norm(other[:, :3])
    scale = at_scale or np.vdot(one[:, :3], other[:, :3]) / np.vdot(one[:, :3], one[:, :3])
    left = other - scale * one
    if np.linalg.norm(left[:, :3]) > APART * size:
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
