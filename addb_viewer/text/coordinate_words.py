"""A model's coordinates as people say them: knee_angle_r is the right knee's angle, or its flexion."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from addb_viewer.text.amounts import TO_95

SIDES = {"r": "right", "l": "left"}
SHORTENED = {
    "arm_flex": "shoulder flexion",
    "arm_add": "shoulder adduction",
    "arm_rot": "shoulder rotation",
    "elbow_flex": "elbow flexion",
    "pro_sup": "forearm pronation",
    "wrist_flex": "wrist flexion",
    "wrist_dev": "wrist deviation",
    "mtp_angle": "toe angle",
}
MOTIONS = {"knee_angle": "knee flexion", "ankle_angle": "ankle dorsiflexion"}  # as OpenSim's models have them
TURNED = {"knee_angle": "knee extension"}  # where most of the range is below zero, as in gait2392
COMMON = (  # names of OpenSim's common models, without the side
    *SHORTENED,
    *MOTIONS,
    *("hip_flexion", "hip_adduction", "hip_rotation", "subtalar_angle"),
)
TRUNK = r"pelvis_(?:tilt|list|rotation|t[xyz])|lumbar_(?:extension|bending|rotation)"
NAMED = re.compile(rf"\b(?:(?:{'|'.join(COMMON)})_[rl]|{TRUNK})\b")
JOINTS = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
PLACES = {"tx": "position x", "ty": "height", "tz": "position z"}


class Coordinate(NamedTuple):
    """A coordinate's name, taken apart."""

    stem: str  # without the side
    side: str  # right, left, or nothing

    @classmethod
    def named(cls, name: str) -> "Coordinate":
        """Of a model's name for it."""
        stem, _, letter = name.rpartition("_")
        return cls(stem, SIDES[letter]) if stem and letter in SIDES else cls(name, "")


def coordinate_in_words(name: str) -> str:
    """As people say it: hip_rotation_r is the right hip rotation; whichever way it grows."""
    stem, side = Coordinate.named(name)
    return f"{side} {_plain(stem)}" if side else _plain(name)


def motion_in_words(name: str, limits: tuple[float, float] | None = None) -> str:
    """What grows with it, without the side: knee_angle_r is "knee flexion", pelvis_ty "pelvis height".

    Args:
        name: of the coordinate.
        limits: its range in the model [rad or m], which tells flexion from extension; None: not known.
    """
    stem = Coordinate.named(name).stem
    if stem in TURNED and limits is not None and -limits[0] > limits[1]:
        return TURNED[stem]
    return MOTIONS.get(stem) or _plain(stem)


def torque_in_words(name: str) -> str:
    """What moves it: knee_angle_r has the right knee torque, hip_rotation_r the right hip rotation torque."""
    return f"{coordinate_in_words(name).removesuffix(' angle')} torque"


def torque_bands(std_Nm: Mapping[str, float]) -> dict[str, str]:
    """How far torques may be off at 95 %, of the worse side: "± 4 N·m at the knee"; the largest first.

    Args:
        std_Nm: standard deviations by coordinate.

    Returns:
        By coordinate without its side.
    """
    worse: dict[str, float] = {}
    for name, std in sorted(std_Nm.items(), key=lambda item: -item[1]):
        worse.setdefault(Coordinate.named(name).stem, TO_95 * std)
    return {
        stem: f"± {half:.{0 if half >= 1 else 1}f} N·m "
        + (f"at the {JOINTS[stem]}" if stem in JOINTS else f"in {_plain(stem)}")
        for stem, half in worse.items()
    }


def coordinates_told(text: str) -> str:
    """The text with words in place of the names of common models' coordinates."""
    return NAMED.sub(lambda found: coordinate_in_words(found[0]), text)


def _plain(stem: str) -> str:
    place = re.fullmatch(r"(.+)_(t[xyz])", stem)
    if place:
        return f"{place[1].replace('_', ' ')} {PLACES[place[2]]}"
    return SHORTENED.get(stem, stem.replace("_", " "))
