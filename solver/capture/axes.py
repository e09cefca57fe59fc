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
from solver.common.settings_field import setting

AXES = "xyz"
FEET = re.compile(r"hee|toe|ank|mal+(eol|$)|met|mt[1-5p]|[1-5]mt|calc|foot|fcc|fm[125]|hallux", re.IGNORECASE)
TRUNK = re.compile(r"head|hd$|sho|clav|ster?n|acro|acr$|c7|t10|asi|psi|sac|pelv|scap", re.IGNORECASE)


@dataclass(frozen=True)
class AxesSettings:
    """What tells the vertical, and how much each sign of it weighs."""

    loaded_N: float = setting(JUDGED_N, unit="N", why="the direction of smaller forces is noise")
    loaded_share: float = setting(
        UNTARED_SHARE, unit="", why="of the largest force: an untared plate's offset is no load"
    )
    flat_share: float = setting(0.98, unit="", why="of a plate's normal along one axis: level within 11°")
    fewest_samples: int = setting(
        FEWEST_JUDGED, unit="", why="loaded samples that make the force's direction evidence"
    )
    force_share: float = setting(
        0.85, unit="", why="of the squared force along one axis: friction stays below 40 % of the load"
    )
    force_weight: float = setting(6.0, unit="", why="gravity itself; outweighs a body that lies down")
    plate_weight: float = setting(2.0, unit="", least=0.0, why="plates lie flat, but for ramps and stairs")
    names_share: float = setting(0.8, unit="", why="of the way from feet to trunk along one axis: upright")
    names_weight: float = setting(3.0, unit="", least=0.0, why="feet below trunk; not so when lying")
    spread_ratio: float = setting(1.25, unit="", why="people are taller than wide, standing or walking")
    spread_weight: float = setting(2.0, unit="", least=0.0, why="a strong ratio of height to width")
    floor_weight: float = setting(
        1.5, unit="", least=0.0, why="the floor is at zero; walkways have it in the middle"
    )
    floor_slack_m: float = setting(
        0.05, unit="m", least=0.0, why="how far below zero markers may be: tilted axes"
    )
    screen_weight: float = setting(
        1.0, unit="", least=0.0, why="POINT:Y_SCREEN: how a program draws; its sign says nothing"
    )
    default_weight: float = setting(0.5, unit="", why="z in C3D files, y in OpenSim's; decides ties only")
    margin: float = setting(
        1.0, unit="", least=0.0, why="tentative smaller than this over the next axis is ambiguous"
    )
    upright_m: float = setting(
        0.3, unit="m", why="with less between feet and trunk, up and down cannot be distinguished"
    )
    still_m_s: float = setting(0.03, unit="m/s", why="a planted foot; a standing trunk sways faster")
    still_share: float = setting(0.25, unit="", why="of the frames: in walking a foot rests longer")
    floor_ratio: float = setting(0.3, unit="", why="the floor is at zero: one end of the axis is near it")


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
    return VerticalAxis(AXES.index(match[2]), -1 if match[1] == "-" else 1, ("as told",))


def vertical_axis(
    markers: Markers | None,
    forces: Sequence[Float[np.ndarray, "samples 3"]] = (),
    corners: Sequence[Float[np.ndarray, "4 3"]] = (),
    *,
    default: str,
    screen_up: str = "",
    settings: AxesSettings = AxesSettings(),
) -> VerticalAxis:
    """Find the axis that points up by weighing what the recording holds.

    Args:
        markers: in the laboratory's axes [m]; None where only forces were recorded.
        forces: of each plate in the same axes [N], whichever way they point.
        corners: of each plate whose corners are known [m].
        default: "y" or "z", assumed where nothing tells.
        screen_up: the axis that the recording program draws upwards ("+Z"), if the file says.
        settings: weights of the evidence.
    """
    weights = np.zeros(3)
    weights[AXES.index(default)] = settings.default_weight
    trunk_from_feet = None if markers is None else _trunk_from_feet(markers)
    indications = [
        _from_forces(forces, settings),
        _from_corners(corners, settings),
        _from_names(trunk_from_feet, settings),
        None if markers is None else _from_spread(markers, settings),
        None if markers is None else _from_floor(markers, settings),
        _from_screen(screen_up, settings),
    ]
    evidence = [one for one in indications if one is not None]
    for one in evidence:
        weights[one.axis] += one.weight
    order = np.argsort(-weights, kind="stable")
    certain = bool(evidence) and bool(weights[order[0]] - weights[order[1]] >= settings.margin)
    axis = int(order[0]) if certain else AXES.index(default)
    sign, sign_sentence = (1, []) if markers is None else _sign(markers, axis, trunk_from_feet, settings)
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


def _from_forces(
    forces: Sequence[Float[np.ndarray, "samples 3"]], settings: AxesSettings
) -> _Evidence | None:
    squares, count = np.zeros(3), 0
    for force in forces:
        size = np.nan_to_num(np.linalg.norm(force, axis=1))
        loaded = size > max(settings.loaded_N, settings.loaded_share * float(size.max(initial=0.0)))
        squares += np.square(force[loaded]).sum(axis=0)
        count += int(loaded.sum())
    axis = int(np.argmax(squares))
    if count < settings.fewest_samples or squares[axis] < settings.force_share * squares.sum():
        return None
    return _Evidence(axis, settings.force_weight, f"the plates' forces act along {AXES[axis]}")


def _from_corners(corners: Sequence[Float[np.ndarray, "4 3"]], settings: AxesSettings) -> _Evidence | None:
    normals = [np.abs(np.cross(c[0] - c[1], c[0] - c[3])) for c in corners]
    axes = {int(np.argmax(normal)) for normal in normals}
    if len(axes) != 1 or any(
        normal.max() < settings.flat_share * np.linalg.norm(normal) for normal in normals
    ):
        return None
    axis = axes.pop()
    return _Evidence(axis, settings.plate_weight, f"the plates lie flat across {AXES[axis]}")


def _trunk_from_feet(markers: Markers) -> Float[np.ndarray, "3"] | None:
    """The way from markers named like feet to those named like a trunk, in the median frame [m]."""
    feet = np.array([bool(FEET.search(name)) for name in markers.names])
    trunk = np.array([bool(TRUNK.search(name)) for name in markers.names]) & ~feet
    way = _mean(markers.positions_ground[:, trunk]) - _mean(markers.positions_ground[:, feet])
    way = way[np.isfinite(way).all(axis=1)]
    return np.median(way, axis=0) if len(way) else None


def _from_names(trunk_from_feet: Float[np.ndarray, "3"] | None, settings: AxesSettings) -> _Evidence | None:
    if trunk_from_feet is None:
        return None
    axis = int(np.argmax(np.abs(trunk_from_feet)))
    if abs(trunk_from_feet[axis]) < settings.names_share * np.linalg.norm(trunk_from_feet):
        return None
    return _Evidence(axis, settings.names_weight, f"trunk and feet lie apart along {AXES[axis]}")


def _from_spread(markers: Markers, settings: AxesSettings) -> _Evidence | None:
    """The axis along which the markers of a frame spread most."""
    enough = np.isfinite(markers.positions_ground).all(axis=2).sum(axis=1) >= 3
    if not enough.any():
        return None
    spread = np.median(np.nanstd(markers.positions_ground[enough], axis=1), axis=0)
    second, first = np.argsort(spread)[1:]
    if spread[first] < settings.spread_ratio * spread[second]:
        return None
    return _Evidence(int(first), settings.spread_weight, f"the markers spread most along {AXES[first]}")


def _from_floor(markers: Markers, settings: AxesSettings) -> _Evidence | None:
    """The one axis on one side of whose zero all markers stay."""
    seen = markers.positions_ground[np.isfinite(markers.positions_ground).all(axis=2)]
    if not len(seen):
        return None
    low, high = np.percentile(seen, [1, 99], axis=0)
    sided = np.flatnonzero((low > -settings.floor_slack_m) | (high < settings.floor_slack_m))
    if len(sided) != 1:
        return None
    return _Evidence(
        int(sided[0]), settings.floor_weight, f"all markers are on one side of {AXES[sided[0]]} = 0"
    )


def _from_screen(screen_up: str, settings: AxesSettings) -> _Evidence | None:
    match = re.fullmatch(r"[+-]?([XYZ])", screen_up.strip().upper())
    if match is None:
        return None
    return _Evidence(
        AXES.index(match[1].lower()), settings.screen_weight, f"the file draws {screen_up} upwards"
    )


def _sign(
    markers: Markers, axis: int, trunk_from_feet: Float[np.ndarray, "3"] | None, settings: AxesSettings
) -> tuple[int, list[str]]:
    """Upwards by the names; else by which end rests; else by the floor at zero; else as the axis points."""
    way = 0.0 if trunk_from_feet is None else trunk_from_feet[axis]
    if abs(way) > settings.upright_m:
        return (1, []) if way > 0 else (-1, ["with the trunk on the negative side of the feet"])
    way = _height_above_resting(markers, axis, settings)
    if abs(way) > settings.upright_m:
        return (1, []) if way > 0 else (-1, ["with markers at its positive end that rest as planted feet do"])
    along = markers.positions_ground[:, :, axis]
    if np.isfinite(along).any():
        bottom, top = np.nanpercentile(along, [1, 99])
        if bottom < -settings.upright_m and abs(top) < settings.floor_ratio * abs(bottom):
            return -1, ["with the floor, near zero, at its positive end"]
    return 1, []


def _height_above_resting(markers: Markers, axis: int, settings: AxesSettings) -> float:
    """How far along the axis the markers that move lie from those that rest [m]; 0 where none or all do."""
    steps = np.linalg.norm(np.diff(markers.positions_ground, axis=0), axis=2) * markers.rate
    seen = np.isfinite(steps).sum(axis=0)
    resting = (steps < settings.still_m_s).sum(axis=0) > settings.still_share * np.maximum(seen, 1)
    moving = (seen > 0) & ~resting
    if not resting.any() or resting.sum() > moving.sum():
        return 0.0
    along = markers.positions_ground[:, :, axis]
    return float(np.nanmedian(along[:, moving]) - np.nanmedian(along[:, resting]))


def _mean(positions: Float[np.ndarray, "frames markers 3"]) -> Float[np.ndarray, "frames 3"]:
    seen = np.isfinite(positions)
    with np.errstate(invalid="ignore"):
        return np.where(seen, positions, 0.0).sum(axis=1) / seen.sum(axis=1)
