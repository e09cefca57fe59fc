"""The default body's marker set: Plug-in-Gait, usual clusters, and other names for those places."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.skeleton.default_frames import BodyFrames
from solver.skeleton.segment_tables import (
    ASIS_SKIN,
    BALL_ALONG_FOOT,
    PELVIC_INCLINATION,
    PSIS_SKIN,
    Lengths,
)
from solver.skeleton.skeleton import Marker, Skeleton

_RADIUS = 0.008  # [m] from the skin to the centre of a usual 14 mm marker, with its base


@dataclass(frozen=True)
class _Place:
    """A place on the right side or in the midline, and what it is called.

    Of the names, `{S}` stands for R or L, `{s}` for r or l. `bony` is the markers' `fixed` flag.
    """

    names: tuple[str, ...]
    body: str
    position: Float[np.ndarray, "3"]  # [m] in the body frame
    bony: bool = True
    paired: bool = True


def default_markers(skeleton: Skeleton, of: Lengths, frames: BodyFrames) -> tuple[Marker, ...]:
    """Markers of the default body.

    Each place comes once a name: a recording uses one of the names, the others stay unmatched. Names are
    compared without case and punctuation by the matching, so spellings need no entry.

    Args:
        skeleton: the default body.
        of: the lengths it was built from.
        frames: likewise.
    """
    places = (
        *_pelvis(of),
        *_thigh(of),
        *_shank(of),
        *_foot(of, frames),
        *_trunk(of, frames),
        *_arm(of, frames),
    )
    markers = []
    for place in places:
        for side in "rl" if place.paired else ("",):
            body = f"{place.body}_{side}" if f"{place.body}_{side}" in skeleton.body_names else place.body
            position = place.position * ((1, 1, -1) if side == "l" else (1, 1, 1))
            markers += [
                Marker(name.format(S=side.upper(), s=side), skeleton.body_index(body), position, place.bony)
                for name in place.names
            ]
    return tuple(markers)


def _pelvis(of: Lengths) -> list[_Place]:
    behind = np.array([-np.cos(PELVIC_INCLINATION), np.sin(PELVIC_INCLINATION), 0.0]) * (
        of.pelvis_depth + PSIS_SKIN * of.stature + _RADIUS
    )
    beside = np.array([0.0, 0.0, 0.026 * of.stature])
    front = np.array([ASIS_SKIN * of.stature + _RADIUS, 0.0, of.pelvis_width / 2])
    return [
        _Place(("{S}ASI", "{S}ASIS", "{S}IAS", "{S}_IAS"), "pelvis", front),
        _Place(("{S}PSI", "{S}PSIS", "{S}IPS"), "pelvis", behind + beside),
        _Place(("SACR", "V.Sacral"), "pelvis", behind, paired=False),
    ]


def _thigh(of: Lengths) -> list[_Place]:
    h, down = of.stature, -of.thigh

    def on_thigh(along: float, forward: float, aside: float) -> Float[np.ndarray, "3"]:
        return np.array([forward * h, along * down, aside * h])

    knee = 0.028 * h + _RADIUS  # half the breadth over the epicondyles, 9.8 cm
    return [
        _Place(("{S}THI",), "femur", on_thigh(0.62, 0.0, 0.045), bony=False),
        _Place(
            ("{S}TH1", "{S}.Thigh.Upper", "{s}_thigh1"), "femur", on_thigh(0.45, 0.010, 0.048), bony=False
        ),
        _Place(
            ("{S}TH2", "{S}.Thigh.Front", "{s}_thigh2"), "femur", on_thigh(0.55, 0.040, 0.022), bony=False
        ),
        _Place(
            ("{S}TH3", "{S}.Thigh.Rear", "{s}_thigh3"), "femur", on_thigh(0.66, -0.012, 0.042), bony=False
        ),
        _Place(
            ("{S}KNE", "{S}LFC", "{S}FLE", "{S}.Knee.Lat", "{S}_knee", "{S}LEPI"),
            "femur",
            np.array([0, down, knee]),
        ),
        _Place(
            ("{S}KNM", "{S}MFC", "{S}FME", "{S}.Knee.Med", "{s}_mknee", "{S}MEPI", "{S}MKNE"),
            "femur",
            np.array([0, down, -knee]),
        ),
    ]


def _shank(of: Lengths) -> list[_Place]:
    h, down = of.stature, -of.shank
    ankle = 0.021 * h + _RADIUS  # half the bimalleolar breadth, 7.3 cm
    # The joint's centre lies 6 mm below the lateral malleolus (de Leva, J Biomech 1996; 29: 1223-1230: shanks
    # of 440.3 and 434.0 mm); the medial malleolus is the higher one by a good centimetre.

    def on_shank(along: float, forward: float, aside: float) -> Float[np.ndarray, "3"]:
        return np.array([forward * h, along * down, aside * h])

    return [
        _Place(("{S}TIB",), "tibia", on_shank(0.50, 0.0, 0.034), bony=False),
        _Place(("{S}TB1", "{S}.Shank.Upper", "{s}_sh2"), "tibia", on_shank(0.33, 0.005, 0.036), bony=False),
        _Place(("{S}TB2", "{S}.Shank.Front", "{S}SK"), "tibia", on_shank(0.42, 0.030, 0.012), bony=False),
        _Place(("{S}TB3", "{S}.Shank.Rear", "{s}_sh3"), "tibia", on_shank(0.55, -0.010, 0.032), bony=False),
        _Place(("{S}TTUB", "{S}TT", "{s}_shank_antsup"), "tibia", on_shank(0.12, 0.033, 0.004)),
        _Place(
            ("{S}ANK", "{S}LMAL", "{S}FAL", "{S}.Ankle.Lat", "{S}_ankle", "{S}LM"),
            "tibia",
            np.array([-0.004 * h, down + 0.0036 * h, ankle]),
        ),
        _Place(
            ("{S}MED", "{S}MMAL", "{S}TAM", "{S}.Ankle.Med", "{s}_mankle", "{S}MM"),
            "tibia",
            np.array([0.004 * h, down + 0.011 * h, -ankle]),
        ),
    ]


def _foot(of: Lengths, frames: BodyFrames) -> list[_Place]:
    ball, low = frames.toes_calcn[0], -frames.calcn_above_sole
    half = of.foot_breadth / 2
    tip = (1 - BALL_ALONG_FOOT) * of.foot
    return [
        _Place(
            ("{S}HEE", "{S}CAL", "{S}.Heel", "{S}FCC", "{s}_calc"),
            "calcn",
            np.array([-frames.heel_behind_calcn - _RADIUS, low + 0.020 * of.stature, 0.0]),
        ),
        _Place(
            ("{S}TOE", "{S}MT2", "{S}FM2", "{s}_toe"),
            "calcn",
            np.array([ball, low + 0.7 * of.ankle_height, 0]),
        ),
        _Place(
            ("{S}MT5", "{S}FM5", "{S}P5MT", "{s}_5meta", "{S}_MTP5"),
            "calcn",
            np.array([0.85 * ball, low + 0.25 * of.ankle_height, half + _RADIUS]),
        ),
        _Place(
            ("{S}MT1", "{S}FM1", "{S}P1MT", "{S}_MTP1"),
            "calcn",
            np.array([1.02 * ball, low + 0.35 * of.ankle_height, -half - _RADIUS]),
        ),
        _Place(("{S}TIP", "{S}.Toe.Tip"), "toes", np.array([tip, low + 0.25 * of.ankle_height, 0.0])),
    ]


def _trunk(of: Lengths, frames: BodyFrames) -> list[_Place]:
    h = of.stature
    middle, upper = of.trunk_above_navel
    notch = of.navel_above_hips + middle + upper

    def on_trunk(above_hips: float, forward: float, aside: float = 0.0) -> Float[np.ndarray, "3"]:
        return frames.trunk_line(above_hips) - frames.torso_pelvis + np.array([forward * h, 0.0, aside * h])

    eyes = of.c7_above_hips + 0.60 * of.head
    shoulder = of.shoulders_above_hips + 0.024 * h  # the acromion stands over the humeral head
    return [
        _Place(("C7", "CV7"), "torso", on_trunk(of.c7_above_hips, -0.048), paired=False),
        _Place(("T10",), "torso", on_trunk(of.navel_above_hips + middle, -0.070), paired=False),
        _Place(("CLAV", "SJN", "IJ"), "torso", on_trunk(notch, 0.030), paired=False),
        _Place(("STRN", "SXS", "PX", "Sternum"), "torso", on_trunk(notch - upper, 0.055), paired=False),
        _Place(("RBAK",), "torso", on_trunk(notch - 0.6 * upper, -0.072, 0.05), bony=False, paired=False),
        _Place(
            ("{S}SHO", "{S}ACR", "{S}AC", "{S}.Acromium", "{S}_Shoulder", "{S}SH"),
            "torso",
            on_trunk(shoulder, -0.005, of.shoulder_half_width / h),
        ),
        _Place(("{S}FHD",), "torso", on_trunk(eyes, 0.052, 0.036)),
        _Place(("{S}BHD",), "torso", on_trunk(eyes, -0.052, 0.036)),
    ]


def _arm(of: Lengths, frames: BodyFrames) -> list[_Place]:
    h = of.stature
    elbow = 0.019 * h + _RADIUS  # half the breadth, 6.6 cm
    wrist = np.array([0.0, 0.0, 0.016 * h + _RADIUS])  # likewise, 5.6 cm
    along = frames.wrist_ulna / of.forearm

    def on_upper_arm(share: float, forward: float, aside: float) -> Float[np.ndarray, "3"]:
        return np.array([forward * h, -share * of.upper_arm, aside * h])

    return [
        _Place(
            ("{S}UPA", "{S}UA1", "{S}.Bicep", "{S}_humerus"),
            "humerus",
            on_upper_arm(0.45, 0.0, 0.032),
            bony=False,
        ),
        _Place(("{S}UA2",), "humerus", on_upper_arm(0.60, 0.020, 0.024), bony=False),
        _Place(("{S}UA3",), "humerus", on_upper_arm(0.60, -0.020, 0.024), bony=False),
        _Place(
            ("{S}ELB", "{S}LEL", "{S}.Elbow", "{S}_elbow_lat"), "humerus", on_upper_arm(1.0, 0.0, elbow / h)
        ),
        _Place(("{S}ELM", "{S}MEL", "{S}_elbow_med"), "humerus", on_upper_arm(1.0, 0.0, -elbow / h)),
        _Place(
            ("{S}FRM", "{S}FAsuperior", "{S}_forearm"),
            "ulna",
            0.45 * of.forearm * along + (-0.024 * h, 0, 0),
            bony=False,
        ),
        _Place(("{S}WRA", "{S}FAradius", "{S}_wrist_radius"), "radius", frames.wrist_radius + wrist),
        _Place(("{S}WRB", "{S}FAulna", "{S}_wrist_ulna"), "radius", frames.wrist_radius - wrist),
        _Place(("{S}FIN",), "hand", frames.knuckle_hand - np.array([_RADIUS, 0.0, 0.0])),
    ]
