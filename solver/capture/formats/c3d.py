"""Markers and force plates of a C3D file in the laboratory's own axes, and which of these points up."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.axes import VerticalAxis, vertical_axis
from solver.capture.capture import ForcePlate, Markers
from solver.capture.formats.c3d_contents import C3dContents, foot_events, open_c3d
from solver.capture.formats.length_units import METRES_PER_UNIT, metres_per_unit, unit_of
from solver.capture.formats.point_labels import marker_points
from solver.capture.formats.segment_poses import pose_points
from solver.capture.marker_cleaning import far_as_nan, unseen_as_nan
from solver.capture.plates.centre_of_pressure import Surface, centre_of_pressure
from solver.capture.plates.force_platform import Platform, force_platforms, plate_axes
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import CONTACT_N

COMPUTED_GROUPS = frozenset(
    ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS", "MODELED_MARKERS", "MODELLED_MARKERS")
)


@dataclass(frozen=True)
class C3dFile:
    """One C3D file: metres, newtons, NaN where not seen; axes as the laboratory has them.

    Forces have the file's sign. The first stored frame is at 0 s, whatever number it has.
    """

    markers: Markers
    plates: tuple[ForcePlate, ...]
    up: VerticalAxis
    notes: tuple[Note, ...] = ()


def read_c3d(path: Path, up: VerticalAxis | None = None) -> C3dFile:
    """Read markers and force plates.

    Args:
        path: the file.
        up: the axis that points up, where a person said so.

    Raises:
        CaptureError: the file cannot be read, holds no marker, or has force platforms of unknown type.
    """
    path = Path(path)
    contents = open_c3d(path)
    markers, metres, notes = _markers(contents)
    platforms, platform_notes = force_platforms(contents, metres)
    if up is None:
        up = _upwards(contents, markers, platforms)
    rate = contents.rate * contents.samples_per_frame
    plates = tuple(_force_plate(platform, up, rate) for platform in platforms)
    notes += (*_rate_notes(contents, rate if platforms else 0.0), *platform_notes)
    return C3dFile(markers, plates, up, notes)


def read_c3d_markers(path: Path, up: VerticalAxis | None = None) -> C3dFile:
    """Read markers only, whatever the force platforms are.

    Raises:
        CaptureError: the file cannot be read or holds no marker.
    """
    contents = open_c3d(Path(path))
    markers, _, notes = _markers(contents)
    return C3dFile(markers, (), up or _upwards(contents, markers, ()), notes)


def _upwards(contents: C3dContents, markers: Markers, platforms: tuple[Platform, ...]) -> VerticalAxis:
    return vertical_axis(
        markers,
        [platform.force_lab for platform in platforms],
        [platform.corners_lab for platform in platforms],
        default="z",
        screen_up=next(iter(contents.words("POINT", "Y_SCREEN")), ""),
    )


def _markers(contents: C3dContents) -> tuple[Markers, float, tuple[Note, ...]]:
    """The markers, metres per POINT:UNITS, and notes."""
    if not contents.points.shape[1]:
        found = pose_points(contents)
        return _in_metres(contents, found.names, found.positions, found.rate, found.notes)
    source = contents.path.name
    groups = COMPUTED_GROUPS | set(contents.words("POINT", "TYPE_GROUPS")) - {"MARKERS", "MARKER", "LABELS"}
    computed = frozenset(label for group in groups for label in contents.words("POINT", group))
    seen_frames = np.isfinite(contents.points).all(axis=2) & (contents.points != 0).any(axis=2)
    chosen = marker_points(contents.words("POINT", "LABELS"), seen_frames.sum(axis=0), computed, source)
    if not chosen.names:
        listed = "; ".join(chosen.notes).replace(f"{source}: ", "")
        raise CaptureError(
            f"{contents.path}: the file holds no marker ({listed}). Export it with its trajectories."
        )
    points = contents.points[:, list(chosen.columns)]
    return _in_metres(contents, chosen.names, points, contents.rate, chosen.notes)


def _in_metres(
    contents: C3dContents,
    names: tuple[str, ...],
    points: Float[np.ndarray, "frames markers 3"],
    rate: float,
    of_names: tuple[Note, ...],
) -> tuple[Markers, float, tuple[Note, ...]]:
    source = contents.path.name
    seen, unseen_notes = unseen_as_nan(points, names, source)
    metres, unit_notes = _metres(contents, seen)
    positions, far_notes = far_as_nan(seen * metres, names, source)
    notes = (*contents.notes, *of_names, *unit_notes, *unseen_notes, *far_notes)
    whose = {name for name in contents.words("EVENT", "SUBJECTS") if name}
    events = foot_events(contents)[0] if len(whose) < 2 else ()  # of several people, nobody's
    return Markers(names, positions, rate, foot_events=events), metres, notes


def _metres(
    contents: C3dContents, positions: Float[np.ndarray, "frames markers 3"]
) -> tuple[float, tuple[Note, ...]]:
    claimed = next((word for word in contents.words("POINT", "UNITS") if word), None)
    where = "POINT:UNITS"
    if claimed is not None and unit_of(claimed) is None:
        metres, notes = metres_per_unit(None, positions, contents.path, where)
        return metres, (Note(Kind.GUESS, f"{contents.path.name}: unknown POINT:UNITS '{claimed}'"), *notes)
    if claimed is None and np.isnan(positions).all():
        return METRES_PER_UNIT["mm"], noted(
            Kind.OTHER, f"{contents.path.name}: no POINT:UNITS and no marker seen; mm assumed"
        )
    return metres_per_unit(claimed, positions, contents.path, where)


def _rate_notes(contents: C3dContents, rate: float) -> tuple[Note, ...]:
    said = contents.number("ANALOG", "RATE", 0.0)
    if rate and abs(said / rate - 1) > 1e-3:
        return noted(
            Kind.LEFT_OUT,
            f"{contents.path.name}: ANALOG:RATE says {said:g} Hz, the file holds {rate:g} samples a second",
        )
    return ()


def _force_plate(platform: Platform, up: VerticalAxis, rate: float) -> ForcePlate:
    """The plate with the file's sign, and centres of pressure, which are the same for either."""
    force, moment = platform.force_lab, platform.moment_lab
    normal = plate_axes(platform.corners_lab)[:, 2]
    normal = normal * (np.sign(normal @ up.up_lab) or 1.0)
    pressing = np.sign(force @ normal)[:, None]
    surface = Surface(platform.corners_lab.mean(axis=0), normal)
    centre = centre_of_pressure(pressing * force, pressing * moment, surface)
    known = np.abs(force @ up.up_lab) >= CONTACT_N
    return ForcePlate(
        name=platform.name,
        force_ground=force,
        moment_ground=moment,
        cop_ground=np.where(known[:, None], centre, np.nan),
        rate=rate,
        corners_ground=platform.corners_lab,
    )
