"""Which laboratory axis points up, found from the recording; and turning all to y up by one rotation."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.capture.capture import ForcePlate, Markers
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import FEWEST_JUDGED, JUDGED_N, UNTARED_SHARE

AXES = "xyz"
FEET = re.compile(r"hee|toe|ank|mal+(eol|$)|met|mt[1-5p]|[1-5]mt|calc|foot|fcc|fm[125]|hallux", re.IGNORECASE)
TRUNK = re.compile(r"head|hd$|sho|clav|ster?n|acro|acr$|c7|t10|asi|psi|sac|pelv|scap", re.IGNORECASE)


FLAT_SHARE = 0.98  # of a plate's normal along one axis: level within 11°
FORCE_SHARE = 0.85  # of the squared force along one axis: friction stays below 40 % of the load
FORCE_WEIGHT = 6.0  # gravity itself; outweighs a body that lies down
PLATE_WEIGHT = 2.0  # plates lie flat, but for ramps and stairs
NAMES_SHARE = 0.8  # of the way from feet to trunk along one axis: upright
NAMES_WEIGHT = 3.0  # feet below trunk; not so when lying
SPREAD_RATIO = 1.25  # people are taller than wide, standing or walking
SPREAD_WEIGHT = 2.0  # a strong ratio of height to width
FLOOR_WEIGHT = 1.5  # the floor is at zero; walkways have it in the middle
FLOOR_SLACK_M = 0.05  # how far below zero markers may be: tilted axes
SCREEN_WEIGHT = 1.0  # POINT:Y_SCREEN: how a program draws; its sign says nothing
DEFAULT_WEIGHT = 0.5  # z in C3D files, y in OpenSim's; decides ties only
CERTAIN_MARGIN = 1.0  # tentative smaller than this over the next axis is ambiguous
UPRIGHT_M = 0.3  # with less between feet and trunk, up and down cannot be distinguished
STILL_M_S = 0.03  # a planted foot; a standing trunk sways faster
STILL_SHARE = 0.25  # of the frames: in walking a foot rests longer
FLOOR_RATIO = 0.3  # the floor is at zero: one end of the axis is near it


@dataclass(frozen=True)
class VerticalAxis:
    """The laboratory's axis (0, 1, 2) and sign that point up, and why."""

    axis: int
    sign: int
    evidence: tuple[str, ...] = ()
    certain: bool = True

    @property
    def name(self) -> str:
        """As in "+z"."""
        return f"{'+' if self.sign > 0 else '-'}{AXES[self.axis]}"

    @property
    def up_lab(self) -> Float[np.ndarray, "3"]:
        """Unit vector upwards."""
        return np.eye(3)[self.axis] * self.sign

    @property
    def R_ground_lab(self) -> Float[np.ndarray, "3 3"]:
        """Rotation to y up, never a reflection. x stays x, unless it is the one that points up."""
        x_ground = np.eye(3)[1 if self.axis == 0 else 0]
        return np.stack([x_ground, self.up_lab, np.cross(x_ground, self.up_lab)])

    def notes(self, source: str) -> tuple[Note, ...]:
        """What was found, for the capture's notes."""
        because = f" ({'; '.join(self.evidence)})" if self.evidence else ""
        if not self.certain:
            remedy = "`up` in the trial's table of subject.toml overrides this"
            return noted(
                Kind.GUESS,
                f"{source}: which axis points up is ambiguous; {self.name} assumed{because}; {remedy}",
            )
        return noted(Kind.PLATES, f"{source}: {self.name} points up{because}")


def vertical_axis_named(name: str) -> VerticalAxis:
    """The axis that a person named: "z", "+z" or "-z".

    Raises:
        CaptureError: no such axis.
    """
    match = re.fullmatch(r"([+-]?)([xyz])", name.strip().lower())
    if match is None:
        raise CaptureError(
            f"up = '{name}': no such axis. Write x, y or z, with - before it if it points down."
        )
    return VerticalAxis(AXES.index(match[2]), -1 if match[1] == "-" else 1, ("as stated",))


def vertical_axis(
    markers: Markers | None,
    forces: Sequence[Float[np.ndarray, "samples 3"]] = (),
    corners: Sequence[Float[np.ndarray, "4 3"]] = (),
    *,
    default: str,
    screen_up: str = "",
) -> VerticalAxis:
    """Find the axis that points up by weighing what the recording holds.

    Args:
        markers: in the laboratory's axes [m]; None where only forces were recorded.
        forces: of each plate in the same axes [N], whichever way they point.
        corners: of each plate whose corners are known [m].
        default: "y" or "z", assumed where nothing tells.
        screen_up: the axis that the recording program draws upwards ("+Z"), if the file says.
    """
    weights = np.zeros(3)
    weights[AXES.index(default)] = DEFAULT_WEIGHT
    trunk_from_feet = None if markers is None else _trunk_from_feet(markers)
    indications = [
        _from_forces(forces),
        _from_corners(corners),
        _from_names(trunk_from_feet),
        None if markers is None else _from_spread(markers),
        None if markers is None else _from_floor(markers),
        _from_screen(screen_up),
    ]
    evidence = [one for one in indications if one is not None]
    for one in evidence:
        weights[one.axis] += one.weight
    order = np.argsort(-weights, kind="stable")
    certain = bool(evidence) and bool(weights[order[0]] - weights[order[1]] >= CERTAIN_MARGIN)
    axis = int(order[0]) if certain else AXES.index(default)
    sign, sign_sentence = (1, []) if markers is None else _sign(markers, axis, trunk_from_feet)
    said = [one.sentence for one in evidence if one.axis == axis] + sign_sentence
    against = [one.sentence for one in evidence if one.axis != axis]
    if against:
        said.append("although " + ", ".join(against))
    return VerticalAxis(axis, sign, tuple(said), certain)


def markers_y_up(markers: Markers, up: VerticalAxis) -> Markers:
    """The markers in axes of which y points up."""
    return replace(markers, positions_ground=markers.positions_ground @ up.R_ground_lab.T)


def plate_y_up(plate: ForcePlate, up: VerticalAxis) -> ForcePlate:
    """The plate in axes of which y points up."""
    R = up.R_ground_lab.T
    return replace(
        plate,
        force_ground=plate.force_ground @ R,
        moment_ground=plate.moment_ground @ R,
        cop_ground=plate.cop_ground @ R,
        corners_ground=None if plate.corners_ground is None else plate.corners_ground @ R,
        point_ground=None if plate.point_ground is None else plate.point_ground @ R,
    )


@dataclass(frozen=True)
class _Evidence:
    """One sign of the vertical, and how much it counts."""

    axis: int
    weight: float
    sentence: str


def _from_forces(forces: Sequence[Float[np.ndarray, "samples 3"]]) -> _Evidence | None:
    squares, count = np.zeros(3), 0
    for force in forces:
        size = np.nan_to_num(np.linalg.norm(force, axis=1))
        loaded = size > max(JUDGED_N, UNTARED_SHARE * float(size.max(initial=0.0)))
        squares += np.square(force[loaded]).sum(axis=0)
        count += int(loaded.sum())
    axis = int(np.argmax(squares))
    if count < FEWEST_JUDGED or squares[axis] < FORCE_SHARE * squares.sum():
        return None
    return _Evidence(axis, FORCE_WEIGHT, f"the plates' forces act along {AXES[axis]}")


def _from_corners(corners: Sequence[Float[np.ndarray, "4 3"]]) -> _Evidence | None:
    normals = [np.abs(np.cross(c[0] - c[1], c[0] - c[3])) for c in corners]
    axes = {int(np.argmax(normal)) for normal in normals}
    if len(axes) != 1 or any(normal.max() < FLAT_SHARE * np.linalg.norm(normal) for normal in normals):
        return None
    axis = axes.pop()
    return _Evidence(axis, PLATE_WEIGHT, f"the plates lie flat across {AXES[axis]}")


def _trunk_from_feet(markers: Markers) -> Float[np.ndarray, "3"] | None:
    """The way from markers named like feet to those named like a trunk, in the median frame [m]."""
    feet = np.array([bool(FEET.search(name)) for name in markers.names])
    trunk = np.array([bool(TRUNK.search(name)) for name in markers.names]) & ~feet
    way = _mean(markers.positions_ground[:, trunk]) - _mean(markers.positions_ground[:, feet])
    way = way[np.isfinite(way).all(axis=1)]
    return np.median(way, axis=0) if len(way) else None


def _from_names(trunk_from_feet: Float[np.ndarray, "3"] | None) -> _Evidence | None:
    if trunk_from_feet is None:
        return None
    axis = int(np.argmax(np.abs(trunk_from_feet)))
    if abs(trunk_from_feet[axis]) < NAMES_SHARE * np.linalg.norm(trunk_from_feet):
        return None
    return _Evidence(axis, NAMES_WEIGHT, f"trunk and feet lie apart along {AXES[axis]}")


def _from_spread(markers: Markers) -> _Evidence | None:
    """The axis along which the markers of a frame spread most."""
    enough = np.isfinite(markers.positions_ground).all(axis=2).sum(axis=1) >= 3
    if not enough.any():
        return None
    spread = np.median(np.nanstd(markers.positions_ground[enough], axis=1), axis=0)
    second, first = np.argsort(spread)[1:]
    if spread[first] < SPREAD_RATIO * spread[second]:
        return None
    return _Evidence(int(first), SPREAD_WEIGHT, f"the markers spread most along {AXES[first]}")


def _from_floor(markers: Markers) -> _Evidence | None:
    """The one axis on one side of whose zero all markers stay."""
    seen = markers.positions_ground[np.isfinite(markers.positions_ground).all(axis=2)]
    if not len(seen):
        return None
    low, high = np.percentile(seen, [1, 99], axis=0)
    sided = np.flatnonzero((low > -FLOOR_SLACK_M) | (high < FLOOR_SLACK_M))
    if len(sided) != 1:
        return None
    return _Evidence(int(sided[0]), FLOOR_WEIGHT, f"all markers are on one side of {AXES[sided[0]]} = 0")


def _from_screen(screen_up: str) -> _Evidence | None:
    match = re.fullmatch(r"[+-]?([XYZ])", screen_up.strip().upper())
    if match is None:
        return None
    return _Evidence(AXES.index(match[1].lower()), SCREEN_WEIGHT, f"the file draws {screen_up} upwards")


def _sign(
    markers: Markers, axis: int, trunk_from_feet: Float[np.ndarray, "3"] | None
) -> tuple[int, list[str]]:
    """Upwards by the names; else by which end rests; else by the floor at zero; else as the axis points."""
    way = 0.0 if trunk_from_feet is None else trunk_from_feet[axis]
    if abs(way) > UPRIGHT_M:
        return (1, []) if way > 0 else (-1, ["with the trunk on the negative side of the feet"])
    way = _height_above_resting(markers, axis)
    if abs(way) > UPRIGHT_M:
        return (1, []) if way > 0 else (-1, ["with markers at its positive end that rest as planted feet do"])
    along = markers.positions_ground[:, :, axis]
    if np.isfinite(along).any():
        bottom, top = np.nanpercentile(along, [1, 99])
        if bottom < -UPRIGHT_M and abs(top) < FLOOR_RATIO * abs(bottom):
            return -1, ["with the floor, near zero, at its positive end"]
    return 1, []


def _height_above_resting(markers: Markers, axis: int) -> float:
    """How far along the axis the markers that move lie from those that rest [m]; 0 where none or all do."""
    steps = np.linalg.norm(np.diff(markers.positions_ground, axis=0), axis=2) * markers.rate
    seen = np.isfinite(steps).sum(axis=0)
    resting = (steps < STILL_M_S).sum(axis=0) > STILL_SHARE * np.maximum(seen, 1)
    moving = (seen > 0) & ~resting
    if not resting.any() or resting.sum() > moving.sum():
        return 0.0
    along = markers.positions_ground[:, :, axis]
    return float(np.nanmedian(along[:, moving]) - np.nanmedian(along[:, resting]))


def _mean(positions: Float[np.ndarray, "frames markers 3"]) -> Float[np.ndarray, "frames 3"]:
    seen = np.isfinite(positions)
    with np.errstate(invalid="ignore"):
        return np.where(seen, positions, 0.0).sum(axis=1) / seen.sum(axis=1)
