"""Anatomical landmarks and their places on the default body."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from solver.skeleton.skeleton import Marker, Skeleton

Kind = Literal["bony", "soft", "cluster", "centre", "pose"]
SPREAD_M: dict[Kind, float] = {"bony": 0.012, "soft": 0.02, "cluster": 0.06, "centre": 0.02, "pose": 0.02}
SIDES = {"r": "right", "l": "left"}
_THIGH_OF_STATURE = 0.245  # Drillis & Contini 1966, as in the default body


@dataclass(frozen=True)
class Landmark:
    """One row of landmarks.toml on one side: `name` is "asis_r", "asis_l", "c7"."""

    name: str
    body: str  # of the default body
    kind: Kind
    says: str
    spread_m: float  # how far markers of that name lie from the place, one standard deviation
    at: str | None = None  # the default body's own marker there; else:
    place: tuple[float, float, float] | None = None  # [stature] in the body's frame

    @property
    def side(self) -> str | None:
        """Right: "r", left: "l", in the midline None."""
        return self.name[-1] if self.name[-2:] in ("_r", "_l") else None

    @property
    def tracks_only(self) -> bool:
        """Whether many markers may share the name, each somewhere on the segment."""
        return self.kind == "cluster"


@cache
def atlas() -> dict[str, Landmark]:
    """All landmarks by name, right before left."""
    rows = tomllib.loads(files(__package__).joinpath("landmarks.toml").read_text(encoding="utf-8"))
    marks = [mark for name, row in rows.items() for mark in _both_sides(name, row)]
    return {mark.name: mark for mark in marks}


def _both_sides(name: str, row: dict[str, Any]) -> list[Landmark]:
    spread = row["spread_mm"] / 1000 if "spread_mm" in row else SPREAD_M[row["kind"]]
    common = {"kind": row["kind"], "says": row["says"], "spread_m": spread}
    at, place = row.get("at"), row.get("place")
    thousandths = tuple(value / 1000 for value in place) if place else None
    if not row.get("paired", True):
        return [Landmark(name, row["body"], at=at, place=thousandths, **common)]
    central = row["body"] in ("pelvis", "torso")
    marks = []
    for side in SIDES:
        mirrored = (
            (thousandths[0], thousandths[1], thousandths[2] * (-1 if side == "l" else 1))
            if thousandths
            else None
        )
        marks.append(
            Landmark(
                f"{name}_{side}",
                row["body"] if central else f"{row['body']}_{side}",
                at=side.upper() + at[1:] if at else None,
                place=mirrored,
                **common,
            )
        )
    return marks


def landmark_marker(landmark: Landmark, name: str, skeleton: Skeleton) -> Marker:
    """A marker at a landmark of the default body.

    Args:
        landmark: of the atlas.
        name: of the new marker.
        skeleton: a default body, at any stature, with its own markers.
    """
    return Marker(
        name,
        skeleton.body_index(landmark.body),
        place_on(landmark, skeleton),
        fixed=landmark.kind == "bony",
        spread_m=landmark.spread_m,
    )


def place_on(landmark: Landmark, skeleton: Skeleton) -> Float[np.ndarray, "3"]:
    """Where a landmark lies in its body's frame [m], on a default body of any stature."""
    if landmark.at is not None:
        return skeleton.markers[skeleton.marker_names.index(landmark.at)].position_body
    knee = skeleton.joints[skeleton.body_index("tibia_r")].p_parent_frame
    stature = float(np.linalg.norm(knee)) / _THIGH_OF_STATURE
    return stature * np.array(landmark.place)
