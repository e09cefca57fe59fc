"""What a recording with this diagnosis is good for, in one line.

Takes the plain values of `diagnose --json`.
"""

from collections.abc import Mapping
from typing import Any

from addb_viewer.residual_words import in_markers

TAKEN_OFF = "taken off as its zero level"  # says the cause that reading the files puts right

Figures = Mapping[str, Any]


def put_right_on_reading(effect: Figures) -> bool:
    """Whether every fit is without a cause already."""
    return TAKEN_OFF in effect["sentence"]


def use(figures: Figures) -> str:
    """Whether to use the recording as it is, and for what."""
    if figures["verdict"] == "clean":
        return "Use: as it is."
    if figures["verdict"] != "explained":
        return "Use: not for joint torques, before the rest is understood."
    left = [effect for effect in figures["effects"] if not put_right_on_reading(effect)]
    if not left:
        return "Use: as it is; what was wrong is put right on reading."
    if in_markers(figures):
        return "Use: once the markers are mended; the forces are not in doubt."
    if all(effect["id"] == "off_plate_step" for effect in left):
        return "Use: outside the frames named below; flag these first."
    if figures["alternatives"]:
        return "Use: not for joint torques, before it is known which cause it is."
    return "Use: not for joint torques as it is, but with the cause put right (see what next)."
