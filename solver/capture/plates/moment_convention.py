"""What the moment columns of a force file mean, found from the numbers, and the plates' wrenches from it.

The columns hold force F, centre of pressure p and a moment that is, depending on who exported the file,

- `free`: the moment about the centre of pressure, which a foot can only exert about the vertical;
- `ground`: the moment about the ground origin;
- `plate`: the moment about some fixed point o of the plate.

All three say M = M_columns + r × F with r = p, 0 or o, and that M − p × F is vertical. So the horizontal part
of M_columns + (r − p) × F, divided by the vertical force, is a lever that must vanish; o follows by a fit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.capture.clock import Clock, find_clock
from solver.capture.formats.storage import PlateColumns, Storage
from solver.capture.plates.centre_of_pressure import LEVEL_GROUND, centre_of_pressure
from solver.capture.plates.force_columns import find_plates
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import CONTACT_N, JUDGED_N

CONVENTIONS = ("free", "ground", "plate")
MEANING = {
    "free": "the free moment at the centre of pressure",
    "ground": "the moment about the ground origin",
    "plate": "the moment about each plate's origin",
}
IN_SHORT = {"free": "free moment", "ground": "about the ground origin", "plate": "about each plate's origin"}
FEWEST_LOADED = 10  # loaded ones that a judgement on moments needs
GOOD_LEVER_M = 0.02  # a moment convention that leaves more than half a foot's width explains nothing
PLATE_HANDICAP_M = 0.001  # a fitted plate origin must do better by this than what needs no fit
ORIGIN_HEIGHT_WEIGHT = 0.01  # of 'the origin lies at the surface': its height shows in the shear force only
USABLE_CENTRE_M = 0.3  # an unloaded centre of pressure farther from all loaded ones is noise
# somebody's foot presses more at some time; less as a file's peak is kN, body weights or N/kg
SMALLEST_LOAD_N = 50.0
LONGEST_LAB_M = 50.0  # levers longer than a laboratory are in mm
LARGEST_FREE_NM = 500.0  # free moments are below 50 N·m; a median beyond this is in N·mm


@dataclass(frozen=True)
class _Columns:
    """One plate's numbers as the file has them; `loaded` where all are known and the force is not small."""

    name: str
    force: Float[np.ndarray, "samples 3"]
    point: Float[np.ndarray, "samples 3"] | None
    moment: Float[np.ndarray, "samples 3"]
    loaded: Bool[np.ndarray, " samples"]


def plates_from_storage(
    storage: Storage, *, moment_convention: str | None = None
) -> tuple[tuple[ForcePlate, ...], tuple[Note, ...]]:
    """Force plates of a .mot or .sto table: wrenches about the ground origin, y up, signs as in the file.

    Args:
        storage: the table, axes already turned to y up.
        moment_convention: "free", "plate" or "ground" to overrule what the numbers say.

    Returns:
        The plates in the file's order, and what was assumed.

    Raises:
        CaptureError: columns are missing, or nothing tells where a force acts.
    """
    if moment_convention not in (None, *CONVENTIONS):
        raise CaptureError(
            f"{storage.path}: moment convention '{moment_convention}': choose {', '.join(CONVENTIONS)}."
        )
    columns, notes = find_plates(storage)
    clock = find_clock(storage.times, path=storage.path, lines=storage.lines)
    if not np.isfinite(clock.rate):
        raise CaptureError(f"{storage.path}: one row of forces is not a recording. Export the whole trial.")
    values = clock.placed(storage.values)
    plates = [_columns(values, plate) for plate in columns]
    plates, unit_notes = _in_metres(plates, storage.path.name)
    origins, convention_notes = _origins(plates, storage, moment_convention)
    built = tuple(
        replace(
            _moved(_force_plate(plate, origin, clock.rate, clock.start_time), clock),
            corners_ground=stated.corners,
        )
        for plate, origin, stated in zip(plates, origins, columns, strict=True)
    )
    return built, storage.notes + notes + unit_notes + convention_notes


def _columns(values: Float[np.ndarray, "samples columns"], plate: PlateColumns) -> _Columns:
    force = values[:, list(plate.force)]
    moment = np.zeros_like(force)
    for axis, column in enumerate(plate.moment or ()):
        if column is not None:
            moment[:, axis] = values[:, column]
    loaded = np.abs(force[:, 1]) > JUDGED_N
    loaded &= np.isfinite(moment).all(axis=1)
    point = values[:, list(plate.point)] if plate.point else None
    stands_beside = point is not None and bool(np.any(point[loaded][:, [0, 2]]))
    if point is not None and loaded.any() and not stands_beside and not _written(point).any():
        point = None  # columns of zeros: the file has none
    if point is not None:
        loaded &= _written(point)
    return _Columns(plate.name, force, point, moment, loaded)


def _in_metres(plates: Sequence[_Columns], source: str) -> tuple[list[_Columns], tuple[Note, ...]]:
    """Centres of pressure in m and moments in N·m, where the file has mm and N·mm."""
    points = [np.abs(plate.point[plate.loaded])[:, [0, 2]] for plate in plates if plate.point is not None]
    distance = _median(np.concatenate(points).max(axis=1)) if points else 0.0
    lever = _median(np.concatenate([_lever(plate, plate.moment) for plate in plates]))
    vertical = _median(np.concatenate([np.abs(plate.moment[plate.loaded, 1]) for plate in plates]))
    in_mm = distance > LONGEST_LAB_M
    in_Nmm = lever > LONGEST_LAB_M or (lever < GOOD_LEVER_M and vertical > LARGEST_FREE_NM)
    notes: tuple[Note, ...] = ()
    if in_mm:
        notes += noted(
            Kind.PLATES, f"{source}: centres of pressure read as mm: they lie {distance:.4g} from the origin"
        )
    if in_Nmm:
        notes += noted(
            Kind.OTHER,
            f"{source}: moments read as N·mm: their median lever arm is {lever:.3g}, the median vertical one "
            f"{vertical:.4g}",
        )
    return [
        replace(
            plate,
            point=plate.point * 1e-3 if in_mm and plate.point is not None else plate.point,
            moment=plate.moment * 1e-3 if in_Nmm else plate.moment,
        )
        for plate in plates
    ], notes


def _origins(
    plates: Sequence[_Columns], storage: Storage, forced: str | None
) -> tuple[list[Float[np.ndarray, "3"] | None], tuple[Note, ...]]:
    """Per plate the point about which its moment columns are; None for the centre of pressure."""
    judged = [p for p in plates if p.point is not None and p.loaded.sum() >= FEWEST_LOADED]
    blind = [p for p in plates if p.point is None and p.loaded.any()]
    notes: tuple[Note, ...] = ()
    convention = forced or "free"
    if judged:
        convention, notes = _judge(judged, storage.path.name, forced)
    if blind:
        notes += _without_centres(blind, storage, forced)
    notes += _gap_notes(plates, storage.path.name, convention)
    if not judged and not blind:
        hint = _scale_hint(plates)
        text = f"{storage.path.name}: no plate is loaded long enough to determine what its moments mean{hint}"
        notes += noted(Kind.FORCES_AGAINST_BODY if hint else Kind.OTHER, text)
    origins: list[Float[np.ndarray, "3"] | None] = []
    for plate in plates:
        if plate.point is None or convention == "ground":
            origins.append(np.zeros(3))
        else:
            origins.append(None if convention == "free" else _fitted_origin(plate))
    return origins, notes


def _scale_hint(plates: Sequence[_Columns]) -> str:
    """A question where forces are there, but too small to carry anybody."""
    largest = max((float(np.nanmax(np.abs(plate.force), initial=0.0)) for plate in plates), default=0.0)
    if not 0 < largest < SMALLEST_LOAD_N:
        return ""
    return f"; the largest force is {largest:.3g}: are the columns in kN, body weights or N/kg instead of N?"


def _judge(plates: Sequence[_Columns], source: str, forced: str | None) -> tuple[str, tuple[Note, ...]]:
    """The convention under which the moment about the centre of pressure is most nearly vertical."""
    levers: dict[str, list[Float[np.ndarray, " loaded"]]] = {convention: [] for convention in CONVENTIONS}
    origins = [_fitted_origin(plate) for plate in plates]
    for plate, origin in zip(plates, origins, strict=True):
        assert plate.point is not None
        about_centre = plate.moment - np.cross(plate.point, plate.force)
        levers["free"].append(_lever(plate, plate.moment))
        levers["ground"].append(_lever(plate, about_centre))
        levers["plate"].append(_lever(plate, about_centre + np.cross(origin, plate.force)))
    left = {convention: _median(np.concatenate(parts)) for convention, parts in levers.items()}
    scores = {**left, "plate": left["plate"] + PLATE_HANDICAP_M}
    best = min(CONVENTIONS, key=lambda convention: scores[convention])
    misses = ", ".join(
        f"{IN_SHORT[convention]} {1000 * left[convention]:.0f} mm" for convention in CONVENTIONS
    )
    evidence = f"how far forces miss their centres of pressure, by reading: {misses}"
    if forced:
        contradiction = "" if forced == best else f", although the numbers suggest {MEANING[best]}"
        return forced, noted(
            Kind.PLATES,
            f"{source}: moment columns read as {MEANING[forced]}, as stated{contradiction} ({evidence})",
        )
    if left[best] > GOOD_LEVER_M:
        return "free", noted(
            Kind.PLATES,
            f"{source}: centres of pressure, forces and moments contradict each other ({evidence}); moment "
            f"columns read as {MEANING['free']}",
        )
    return best, noted(Kind.PLATES, f"{source}: moment columns read as {MEANING[best]} ({evidence})")


def _gap_notes(plates: Sequence[_Columns], source: str, convention: str) -> tuple[Note, ...]:
    notes: tuple[Note, ...] = ()
    for plate in plates:
        if plate.point is None:
            continue
        lost = (np.abs(plate.force[:, 1]) > JUDGED_N) & ~_written(plate.point)
        guess = (
            "; the force is assumed to act in the middle of the known ones" if convention == "free" else ""
        )
        if lost.any():
            notes += noted(
                Kind.FORCES_AGAINST_BODY,
                f"{source}: {plate.name}: no centre of pressure on {lost.sum()} loaded samples{guess}",
            )
    return notes


def _without_centres(blind: Sequence[_Columns], storage: Storage, forced: str | None) -> tuple[Note, ...]:
    """What is assumed where a loaded plate has no centre of pressure of its own."""
    names = ", ".join(plate.name for plate in blind)
    if forced == "plate":
        raise CaptureError(
            f"{storage.path}: {names}: moments about the plate's origin, but the file does not say where "
            "that is. Export the centre of pressure, or moments about the ground origin."
        )
    if forced == "free" or any(not _lever(plate, plate.moment).any() for plate in blind):
        raise CaptureError(
            f"{storage.path}: {names}: neither a centre of pressure nor a horizontal moment: the point "
            "where the force acts is unknown. Export the centre of pressure."
        )
    return noted(
        Kind.OTHER,
        f"{storage.path.name}: {names}: no centre of pressure in the file; recomputed at the height y = 0 "
        "from the moment columns, assumed to be about the ground origin",
    )


def _fitted_origin(plate: _Columns) -> Float[np.ndarray, "3"]:
    """The fixed point o for which M + (o − p) × F is most nearly vertical (least absolute levers) [m]."""
    assert plate.point is not None
    if plate.loaded.sum() < FEWEST_LOADED:
        return np.median(plate.point[plate.loaded], axis=0) if plate.loaded.any() else np.zeros(3)
    force = plate.force[plate.loaded]
    vertical = np.abs(force[:, 1])
    known = (plate.moment - np.cross(plate.point, plate.force))[plate.loaded] / vertical[:, None]
    fx, fy, fz = (force / vertical[:, None]).T
    nought = np.zeros_like(fx)
    rows = np.stack([np.stack([nought, fz, -fy], axis=1), np.stack([fy, -fx, nought], axis=1)], axis=1)
    sought = -known[:, [0, 2]]
    height = np.array([0.0, ORIGIN_HEIGHT_WEIGHT, 0.0])
    at_surface = ORIGIN_HEIGHT_WEIGHT * float(np.median(plate.point[plate.loaded, 1]))
    weights = np.ones(len(force))
    origin = np.zeros(3)
    for _ in range(20):  # reweighted least squares settle in a handful of rounds
        scaled = rows * weights[:, None, None]
        normal = np.einsum("sij,sik->jk", scaled, rows) + np.outer(height, height) * weights.sum()
        right = np.einsum("sij,si->j", scaled, sought) + height * at_surface * weights.sum()
        origin = np.linalg.solve(normal, right)
        weights = 1 / np.maximum(np.linalg.norm(rows @ origin - sought, axis=1), 1e-4)
    return origin


def _lever(plate: _Columns, moment: Float[np.ndarray, "samples 3"]) -> Float[np.ndarray, " loaded"]:
    """Horizontal moment over vertical force while loaded [m]."""
    horizontal = np.hypot(moment[plate.loaded, 0], moment[plate.loaded, 2])
    return horizontal / np.abs(plate.force[plate.loaded, 1])


def _median(values: Float[np.ndarray, " values"]) -> float:
    return float(np.median(values)) if len(values) else 0.0


def _force_plate(
    plate: _Columns, origin: Float[np.ndarray, "3"] | None, rate: float, start_time: float
) -> ForcePlate:
    point = _usable_points(plate) if origin is None else origin
    moment = plate.moment + np.cross(point, plate.force)
    pressed = np.abs(plate.force[:, 1]) >= CONTACT_N
    if plate.point is not None:
        centre = np.where(_written(plate.point)[:, None], plate.point, np.nan)
    else:
        sign = np.sign(np.nansum(plate.force[:, 1])) or 1.0
        centre = centre_of_pressure(sign * plate.force, sign * moment, LEVEL_GROUND)
    cop = np.where(pressed[:, None], centre, np.nan)
    columns = None if plate.point is None else centre
    return ForcePlate(plate.name, plate.force, moment, cop, rate, start_time, point_ground=columns)


def _moved(plate: ForcePlate, clock: Clock) -> ForcePlate:
    """The wrench at the clock's samples; centres of pressure, half a sample off at most, stay as they are."""
    return replace(
        plate, force_ground=clock.moved(plate.force_ground), moment_ground=clock.moved(plate.moment_ground)
    )


def _written(point: Float[np.ndarray, "samples 3"]) -> Bool[np.ndarray, " samples"]:
    """Where the file gives a centre of pressure: 0 0 is what programs write for "none"."""
    return np.isfinite(point).all(axis=1) & point[:, [0, 2]].any(axis=1)


def _usable_points(plate: _Columns) -> Float[np.ndarray, "samples 3"]:
    """The file's centres of pressure; where unloaded ones are noise, the middle of the loaded ones.

    Where no load stands beside any (the force columns of two plates may be exchanged), the middle of all.

    A few newtons at a centre of pressure a hundred metres away would else make hundreds of N·m. Where a
    centre of pressure of 0 0 stands beside a moment that is not vertical, the moment is about that point.
    """
    assert plate.point is not None
    loaded = plate.point[plate.loaded if plate.loaded.any() else _written(plate.point)]
    if not len(loaded):
        return np.zeros_like(plate.point)
    low, high = loaded.min(axis=0) - USABLE_CENTRE_M, loaded.max(axis=0) + USABLE_CENTRE_M
    near = _written(plate.point) & ((plate.point >= low) & (plate.point <= high)).all(axis=1)
    nowhere = np.isfinite(plate.point).all(axis=1) & ~_written(plate.point)
    about_origin = nowhere & plate.moment[:, [0, 2]].any(axis=1)
    return np.where((near | about_origin | plate.loaded)[:, None], plate.point, np.median(loaded, axis=0))
