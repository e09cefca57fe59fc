"""Which foot a plate's force belongs to: the one whose sole the centre of pressure keeps to over a contact.

A contact is a run of loaded frames of one plate. Along it the states "foot 1", "foot 2", …, "two feet" and
"no foot" compete: each costs its distance from the centre of pressure, every change of state costs as much as
`takeover_m_s`, and the cheapest sequence wins. So a whole contact decides, a stray centre of pressure does
not, and a second foot that steps on the plate takes it over when it really does.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.capture.plates.conditioning import ConditionedPlate
from solver.common.notes import Kind, Note, noted
from solver.common.true_runs import runs
from solver.contact.contact_phases import touching
from solver.contact.settings import ContactSettings
from solver.contact.sole import Sole, independent_feet, soles
from solver.contact.wrenches import NO_FOOT, TWO_FEET, ContactWrenches
from solver.skeleton.skeleton import Skeleton

BETWEEN_FEET_M = 0.02  # [m] so far outside both soles, but between them, a centre of pressure shows two feet
SMALLER_SHARE = 0.1  # and so far on the way from one to the other: real steps on one plate stay below it
SHARE_IF_CARRIED = 0.25  # likewise while another plate carries one of the two: a roll-off reaches 0.18
TAKEOVER_M_S = 0.004  # [m·s] another foot takes a loaded plate over by being 5 cm nearer for 80 ms
FULL_WEIGHT_LOAD = 0.2  # of the plate's peak force: from there the centre of pressure is trusted in full
LYING_STD_N = 5.0  # [N] what lies on a plate all along, or its offset, changes less; a person sways more


def assign(
    plates: Sequence[ConditionedPlate],
    R_ground_body: Float[np.ndarray, "frames bodies 3 3"],
    p_ground_body: Float[np.ndarray, "frames bodies 3"],
    *,
    skeleton: Skeleton,
    foot_bodies: Sequence[str],
    times: Float[np.ndarray, " frames"],
    settings: ContactSettings,
) -> ContactWrenches:
    """Give every plate's force, contact by contact, to a foot.

    A plate is tied to no foot, and no foot to a plate. Where two feet stand on one plate its force goes to
    neither, and the frames say so. The plates' own notes are passed on.

    Args:
        plates: conditioned, at the markers' frames; at least one.
        R_ground_body: orientations of the skeleton's bodies.
        p_ground_body: their origins [m].
        skeleton: scaled.
        foot_bodies: a body for each foot.
        times: of the frames [s].
        settings: thresholds.

    Raises:
        ModelError: a foot body is missing or is no foot.
    """
    feet = independent_feet(skeleton, foot_bodies)
    notes = [note for plate in plates for note in plate.notes]
    notes += [
        Note(Kind.OTHER, f"foot body '{name}' is part of another foot's sole; its forces count for that foot")
        for name in foot_bodies
        if name not in feet
    ]
    outlines = soles(skeleton, feet)
    rate = (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 1.0
    corners = [sole.corners_ground(R_ground_body, p_ground_body) for sole in outlines]
    distances = [_distances(outlines, R_ground_body, p_ground_body, p.cop_ground) for p in plates]
    standing = np.stack([_standing(p.loaded, d) for p, d in zip(plates, distances, strict=True)])
    touches = touching(corners, np.any(standing, axis=0), rate, settings)
    owners = np.full((len(times), len(plates)), NO_FOOT)
    unassigned = np.zeros(len(times), dtype=bool)
    for k, plate in enumerate(plates):
        elsewhere = np.any(np.delete(standing, k, axis=0), axis=0)
        between = _between_two(plate.cop_ground, distances[k], corners, touches=touches, elsewhere=elsewhere)
        both = (touches & ~elsewhere).sum(axis=1) > 1
        cost = _cost(distances[k], between, settings) * _trust(plate)[:, None]
        states = np.array([*range(len(feet)), TWO_FEET, NO_FOOT])
        for start, end in runs(plate.loaded):
            path = _cheapest_path(cost[start:end], TAKEOVER_M_S * rate, unlikely=len(feet))
            owners[start:end, k] = _widened(states[path], both[start:end])
        notes += _notes(plate.name, owners[:, k], plate.loaded, distances[k], times)
        if not lies_there(plate):
            unassigned |= plate.loaded & (owners[:, k] == NO_FOOT)
        owners[:, k] = _with_tails(owners[:, k], plate.loaded)
    return replace(_gathered(plates, owners, feet, notes), unassigned=unassigned)


def lies_there(plate: ConditionedPlate) -> bool:
    """Whether the plate's load is a thing on it, or an offset: there all along and always the same.

    Args:
        plate: at the frames.
    """
    load = plate.force_ground[plate.observed, 1]
    return bool(plate.loaded[plate.observed].all() and np.std(load) < LYING_STD_N)


def _distances(
    outlines: Sequence[Sole],
    R_ground_body: Float[np.ndarray, "frames bodies 3 3"],
    p_ground_body: Float[np.ndarray, "frames bodies 3"],
    cop_ground: Float[np.ndarray, "frames 3"],
) -> Float[np.ndarray, "frames feet"]:
    columns = [sole.distance(R_ground_body, p_ground_body, cop_ground) for sole in outlines]
    return np.stack(columns, axis=1)


def _standing(
    loaded: Bool[np.ndarray, " frames"], distances: Float[np.ndarray, "frames feet"]
) -> Bool[np.ndarray, "frames feet"]:
    """Frames on which the plate's centre of pressure lies under a foot."""
    nearest = distances == distances.min(axis=1, keepdims=True)
    return loaded[:, None] & nearest & (distances < BETWEEN_FEET_M)


def _between_two(
    cop_ground: Float[np.ndarray, "frames 3"],
    distances: Float[np.ndarray, "frames feet"],
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    *,
    touches: Bool[np.ndarray, "frames feet"],
    elsewhere: Bool[np.ndarray, "frames feet"],
) -> Bool[np.ndarray, " frames"]:
    """Whether the centre of pressure lies outside all soles, but between two that touch the ground.

    It must lie farther from both where another plate carries one of them already (`elsewhere`).
    """
    outside = (distances > BETWEEN_FEET_M).all(axis=1)
    between = np.zeros(len(cop_ground), dtype=bool)
    for i, j in combinations(range(len(corners_ground)), 2):
        pair = distances[:, [i, j]]
        carried = elsewhere[:, i] | elsewhere[:, j]
        share = np.where(carried, SHARE_IF_CARRIED, SMALLER_SHARE)
        amid = pair.min(axis=1) > share * pair.sum(axis=1)
        frames = np.flatnonzero(outside & amid & touches[:, i] & touches[:, j])
        around = np.concatenate([corners_ground[i][frames], corners_ground[j][frames]], axis=1)
        between[frames] |= _enclosed(cop_ground[frames], around)
    return between


def _enclosed(
    point_ground: Float[np.ndarray, "frames 3"], corners_ground: Float[np.ndarray, "frames corners 3"]
) -> Bool[np.ndarray, " frames"]:
    """Whether a point lies in the convex hull of corners, seen from above: no half-plane holds them all."""
    offset = corners_ground - point_ground[:, None]
    bearing = np.sort(np.arctan2(offset[..., 2], offset[..., 0]), axis=1)
    gaps = np.diff(bearing, axis=1, append=bearing[:, :1] + 2 * np.pi)
    return gaps.max(axis=1, initial=0.0) < np.pi


def _cost(
    distances: Float[np.ndarray, "frames feet"],
    between: Bool[np.ndarray, " frames"],
    settings: ContactSettings,
) -> Float[np.ndarray, "frames states"]:
    """Of each foot, of two feet, and of no foot [m]."""
    capped = np.minimum(np.nan_to_num(distances, nan=np.inf), 2 * settings.farthest_m)
    together = np.where(between, 0.0, 2 * settings.farthest_m)
    nowhere = np.full(len(between), settings.farthest_m)
    return np.column_stack([capped, together, nowhere])


def _trust(plate: ConditionedPlate) -> Float[np.ndarray, " frames"]:
    """Weight of a centre of pressure: its variance grows with the inverse square of the load."""
    load = np.where(plate.loaded, np.linalg.norm(plate.force_ground, axis=1), 0.0)
    full = FULL_WEIGHT_LOAD * load.max(initial=0.0)
    return np.minimum(1.0, (load / full) ** 2) if full > 0 else load


def _cheapest_path(
    cost: Float[np.ndarray, "frames states"], change: float, unlikely: int
) -> Int[np.ndarray, " frames"]:
    """The sequence of states of least total cost, where each change costs `change` (Viterbi).

    To begin in the state `unlikely` costs as much as a change.
    """
    frames, states = cost.shape
    total = cost[0].copy()
    total[unlikely] += change
    origin = np.empty((frames, states), dtype=int)
    for t in range(1, frames):
        best = int(np.argmin(total))
        stay = total <= total[best] + change
        origin[t] = np.where(stay, np.arange(states), best)
        total = np.where(stay, total, total[best] + change) + cost[t]
    path = np.empty(frames, dtype=int)
    path[-1] = np.argmin(total)
    for t in range(frames - 1, 0, -1):
        path[t - 1] = origin[t, path[t]]
    return path


def _widened(
    owners: Int[np.ndarray, " frames"], both: Bool[np.ndarray, " frames"]
) -> Int[np.ndarray, " frames"]:
    """Two feet on the plate stay two for as long as both touch, though one may carry nearly all."""
    widened = owners.copy()
    for start, end in runs(both):
        if (owners[start:end] == TWO_FEET).any():
            widened[start:end] = TWO_FEET
    return widened


def _with_tails(
    owners: Int[np.ndarray, " frames"], loaded: Bool[np.ndarray, " frames"]
) -> Int[np.ndarray, " frames"]:
    """Unloaded frames go to the foot of the nearest contact in time."""
    known = np.flatnonzero(loaded & (owners >= 0))
    if not len(known):
        return owners
    frames = np.arange(len(owners))
    after = np.clip(np.searchsorted(known, frames), 0, len(known) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(frames - known[before] < known[after] - frames, known[before], known[after])
    nearest = np.where(frames > known[-1], known[-1], nearest)
    return np.where(loaded, owners, owners[nearest])


def _gathered(
    plates: Sequence[ConditionedPlate],
    owners: Int[np.ndarray, "frames plates"],
    feet: tuple[str, ...],
    notes: Sequence[Note],
) -> ContactWrenches:
    frames = len(owners)
    filtered = [np.nan_to_num(np.hstack([p.force_ground, p.moment_ground])) for p in plates]
    recorded = [np.nan_to_num(np.hstack([p.force_raw_ground, p.moment_raw_ground])) for p in plates]
    wrench, raw = np.zeros((frames, len(feet), 6)), np.zeros((frames, len(feet), 6))
    cop = np.full((frames, len(feet), 3), np.nan)
    in_contact = np.zeros((frames, len(feet)), dtype=bool)
    for f in range(len(feet)):
        share = owners == f
        for k in range(len(plates)):
            wrench[:, f] += share[:, k, None] * filtered[k]
            raw[:, f] += share[:, k, None] * recorded[k]
        loaded = share & np.column_stack([p.loaded for p in plates])
        in_contact[:, f] = loaded.any(axis=1)
        cop[:, f] = _cop(plates, loaded, wrench[:, f])
    return ContactWrenches(
        foot_bodies=feet,
        wrench_ground=wrench,
        cop_ground=cop,
        observed=np.all([p.observed for p in plates], axis=0),
        in_contact=in_contact,
        plate=owners,
        wrench_raw_ground=raw,
        notes=tuple(notes),
    )


def _cop(
    plates: Sequence[ConditionedPlate],
    loaded: Bool[np.ndarray, "frames plates"],
    wrench_ground: Float[np.ndarray, "frames 6"],
) -> Float[np.ndarray, "frames 3"]:
    """Centre of pressure under one foot [m]: its plate's, or where two plates carry it, that of their sum.

    At height h: M = r × F + T ŷ gives x = (M_z + h F_x) / F_y and z = (h F_z − M_x) / F_y.
    """
    cop = np.full((len(loaded), 3), np.nan)
    for k, plate in enumerate(plates):
        alone = loaded[:, k] & (loaded.sum(axis=1) == 1)
        cop[alone] = plate.cop_ground[alone]
    both = np.flatnonzero(loaded.sum(axis=1) > 1)
    if len(both):
        load = np.column_stack([p.force_ground[both, 1] for p in plates]) * loaded[both]
        heights = np.nan_to_num(np.column_stack([p.cop_ground[both, 1] for p in plates]))
        height = (load * heights).sum(axis=1) / load.sum(axis=1)
        force, moment = wrench_ground[both, :3], wrench_ground[both, 3:]
        cop[both, 0] = (moment[:, 2] + height * force[:, 0]) / force[:, 1]
        cop[both, 1] = height
        cop[both, 2] = (height * force[:, 2] - moment[:, 0]) / force[:, 1]
    return cop


def _notes(
    plate: str,
    owners: Int[np.ndarray, " frames"],
    loaded: Bool[np.ndarray, " frames"],
    distances: Float[np.ndarray, "frames feet"],
    times: Float[np.ndarray, " frames"],
) -> list[Note]:
    called = plate if plate.lower().startswith("plate") else f"plate {plate}"
    notes: list[Note] = []
    for start, end in runs(owners == TWO_FEET):
        notes += noted(
            Kind.OTHER,
            f"{called}: two feet from {times[start]:.2f} to {times[end - 1]:.2f} s; "
            "its force cannot be divided and is assigned to neither",
        )
    for start, end in runs(loaded & (owners == NO_FOOT)):
        nearest = distances[start:end].min(axis=1)
        where = "unknown"
        if np.isfinite(nearest).any():
            where = f"{np.nanmedian(nearest):.2f} m from the nearest sole"
        notes += noted(
            Kind.OTHER,
            f"{called}: loaded from {times[start]:.2f} to {times[end - 1]:.2f} s, but its centre of "
            f"pressure is {where}; its force is assigned to no foot",
        )
    return notes
